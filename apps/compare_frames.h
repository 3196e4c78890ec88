// SPDX-License-Identifier: Apache-2.0
// covary compare for numbered frames: errors of frames, of their changes, and of the worst region.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "film/pictures.h"
#include "metrics/metrics.h"

namespace covary {

/// Options of `covary compare`.
struct CompareOptions {
  std::vector<std::string> images;
  std::string reference, reference2, denominator, error_map, frames, baseline;
  PictureChoice choice;  ///< of each file
  std::vector<std::string> metrics{"relmse"};
  std::vector<double> error_range;
  std::optional<std::string> json;  // "" and "-": standard output
  bool overwrite = false;           // of error maps
};

/// Whether any metric is relative to --denominator or the denoised references, given two.
bool has_relative_metric(const CompareOptions& options);
/// What is printed of a metric.
std::string formula_text(const CompareOptions& options, const MetricInfo& metric);

/// Whether the images are patterns with '#'. Throws Error(kUsage) if only some are, or if options do not fit.
bool compares_frames(const CompareOptions& options);

/// Prints a table of the frames' errors, and writes JSON if requested. References without a '#' are used for all
/// frames.
void compare_frames(const CompareOptions& options);

}  // namespace covary
