// SPDX-License-Identifier: Apache-2.0
// Errors of animations F_t against references R_t: of frames, of the changes between them, and of regions.
//
// Errors are means over pixels and channels of products (F - R1)(F - R2) w, as for relMSE in metrics/metrics.h, with w
// the weight of relMSE, relative_weight(); with one reference R2 = R1.
//     temporal error   (dF - dR1)(dF - dR2) w, dF = F_t - F_{t-1}: flicker and ghosting, but no constant bias. w is
//     the smaller weight of the two frames, that of the brighter one, so that a light that appears is not weighted
//     by the darkness before it.
//     temporal FLIP    |FLIP(F_{t-1}, F_t) - FLIP(R_{t-1}, R_t)|: visible change that should not be there, or vice
//     versa. This is tLP of [Chu2020] (metrics.py in its code) per pixel with FLIP instead of LPIPS; it includes
//     the references' noise.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// Side of a region in pixels; an image smaller than that is one region in that dimension.
inline constexpr int kRegionSide = 32;

/// Means over the regions of an image, row-major. If a side is not a multiple of kRegionSide, the last regions overlap
/// their predecessors.
struct RegionErrors {
  int columns = 0, rows = 0;
  std::vector<double> error;
  std::vector<double> noise;  ///< variance of `error` by the references' noise, from their difference; 0 for one
  bool empty() const { return error.empty(); }
};

/// Errors of a frame; those of changes are NaN for the first one.
struct FrameErrors {
  double relmse = 0, temporal = 0, temporal_flip = 0;
  /// relMSE over blocks that are unchanged in the references since the frame before, and their fraction of the pixels;
  /// NaN if that is 0.
  double still_relmse = 0, still_part = 0;
  uint64_t n_non_finite = 0;  ///< pixels left out
  RegionErrors regions, temporal_regions;
};

/// Takes the frames of a sequence in order. Keeps only the last frame and its references.
class SequenceErrors {
 public:
  /// Adds the next frame and its one or two references, all of the same size, 3 channels, linear RGB.
  /// `low_dynamic_range`, `denominators`: see compute_metric(). Throws Error(kInput) if sizes differ, also
  /// from the frame before.
  void add(Image frame, std::vector<Image> references, bool low_dynamic_range = false,
           std::vector<Image> denominators = {});
  const std::vector<FrameErrors>& frames() const { return frames_; }

 private:
  /// The weights of a frame's squared errors, per pixel.
  using Weights = std::vector<double>;
  void add_changes(const Image& frame, const std::vector<Image>& references, const Weights& weights,
                   bool low_dynamic_range, FrameErrors& errors) const;
  void add_still(const Image& frame, const std::vector<Image>& references, const Weights& weights,
                 FrameErrors& errors) const;
  std::vector<FrameErrors> frames_;
  Image before_;
  std::vector<Image> references_before_;
  Weights weights_before_;
};

/// Per-frame means over renders with different seeds, regions included. Empty if there are no renders.
std::vector<FrameErrors> mean_over_renders(std::span<const std::vector<FrameErrors>> renders);

/// Means over frames; those of changes exclude the first frame, those of unchanged blocks are weighted by pixels.
struct SequenceSummary {
  double relmse, temporal, temporal_flip, still_relmse, still_part;
};
SequenceSummary summary_of(std::span<const FrameErrors> frames);

/// The region where a sequence is worst relative to another, which shows where light of earlier frames lingers.
struct WorstRegion {
  double ratio;       ///< of errors; NaN if the references are too noisy to resolve the other's error anywhere
  int frame;          ///< index; -1 for means over frames
  int column, row;    ///< of the region
  uint64_t left_out;  ///< regions whose error the references do not resolve (under 4 standard errors above 0)
};
/// Regions of the same number of frames of both sequences; empty ones (first frames) are skipped.
WorstRegion worst_region_of_means(std::span<const RegionErrors* const> tested,
                                  std::span<const RegionErrors* const> other);
WorstRegion worst_region_of_frames(std::span<const RegionErrors* const> tested,
                                   std::span<const RegionErrors* const> other);

/// All four comparisons of a sequence with another.
struct WorstRegions {
  WorstRegion relmse, relmse_of_frame, temporal, temporal_of_frame;
};
WorstRegions worst_regions(std::span<const FrameErrors> tested, std::span<const FrameErrors> other);

}  // namespace covary
