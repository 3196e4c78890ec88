// SPDX-License-Identifier: Apache-2.0
// Combines two grouped images, or denoises an independent one: checks the inputs, estimates the image and its error,
// adds the light film. The one pipeline of `covary combine`, Python and C++; renders end with its last two steps.
#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "combine/grouped_source.h"
#include "combine/input_checks.h"
#include "combine/layer_sources.h"
#include "estimators/method.h"
#include "filters/stray_values.h"
#include "risk/predicted_error.h"

namespace covary {

/// What is known about the inputs before estimation.
struct InputFindings {
  InputReport report;
  std::vector<Finding> findings;                  ///< of the report, and from the images' own attributes
  std::vector<StrayValue> strays_of_crn, strays;  ///< of both images: values that are left out
};

struct CombineRequest {
  std::optional<GroupedSource> crn;  ///< none for a method of one pass
  GroupedSource independent;
  std::optional<GroupedSource> light;  ///< a light film (film/splat_layer.h), to be added
  std::vector<LayerSource> layers;     ///< parts of the independent image, for estimators that split them
  Method estimator;                    ///< of a pair of images, or of an independent one
  MethodSettings settings;
  bool force = false;  ///< combine even if there are errors among the findings
  /// Memory limit in bytes: larger images are combined in bands of rows, with the same bits, if the estimator's halo
  /// is limited.
  double memory = std::numeric_limits<double>::infinity();
  /// Memory limit in bytes where bands do not help; default: memory_limit() (core/memory_limit.h).
  std::optional<double> max_memory;
  /// Called after the inputs are checked, before errors among the findings are thrown.
  std::function<void(const InputFindings&)> checked;
  const std::atomic<bool>* stop = nullptr;  ///< true, from any thread, ends combine() soon
};

struct CombinedImage {
  EstimatorResult image;
  /// The request's layers by name, and kRest if these leave some of the image: together they sum to its estimate.
  std::map<std::string, Image> layers;
  std::optional<PredictedError> predicted;  ///< if there is a standard error
  InputFindings inputs;
  double planned_memory = 0;  ///< planned_memory() of the request
  double check_seconds = 0, estimate_seconds = 0;
  bool interrupted = false;  ///< by CombineRequest::stop; nothing else is known then
};

/// Checks the two images as combine() does. Throws Error(kInput) if they do not show the same pixels.
InputFindings examine(const CombineRequest& request);

/// Throws Error(kUsage) if it would need too much memory, Error(kInput) if there are errors among the findings and
/// `force` is not set, and whatever the estimator throws.
CombinedImage combine(const CombineRequest& request);

/// relMSE of the mean of `image` (the plain samples), predicted from its groups, reading `rows` rows at a time.
double predicted_relmse_of_mean(const GroupedSource& image, int rows);

/// Approximate peak memory of combine() in bytes: input, working memory of the estimator, and result.
double planned_memory(const CombineRequest& request);
/// Same for `rows` rows at a time.
double memory_of_rows(const CombineRequest& request, int rows);
/// Rows that combine() has in memory at a time.
int rows_in_memory(const CombineRequest& request);
/// Sets the memory limits as `--memory` does; by default, bands are as large as 6144 MiB allow, and other work as
/// memory_limit() does.
void limit_memory(CombineRequest& request, std::optional<double> mebibytes);

/// Rows of both images; empty for a missing one.
struct Band {
  GroupedImage crn, independent;
  int first = 0;
};
/// Rows first … last - 1 and the estimator's halo on both sides, so that bands have the bits of the whole.
Band band_around(const CombineRequest& request, int first, int last);

/// The last steps for every image that a method made from films: its error follows from what the samples tell of it
/// (risk/error_interval.h), and the mean of the light film's rows, if any, is added.
EstimatorResult finish(MethodImage image, const GroupedImage* light = nullptr);

}  // namespace covary
