// SPDX-License-Identifier: Apache-2.0
// Errors of moving pictures F_t against references R_t: of single frames, of their changes, and of regions.
//
// Errors are means over pixels and channels of products (F - R1)(F - R2) w, as relMSE in metrics/metrics.h, with
// w = 1 / (R'^2 + 0.01); with one reference R2 = R1.
//     temporal error   (dF - dR1)(dF - dR2) w, dF = F_t - F_{t-1}: flicker and trails, but no bias that stays. w is the
//                      smaller weight of both frames, that of the brighter one: a light that appears has not the weight
//                      of the darkness before it.
//     temporal FLIP    |FLIP(F_{t-1}, F_t) - FLIP(R_{t-1}, R_t)|: change that is seen and should not be, or the other
//                      way round. This is tLP of [Chu2020] (metrics.py of its code) with FLIP for LPIPS, at every
//                      pixel; the references' noise is in it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// Side of a region in pixels; a smaller image is one region along that side.
inline constexpr int kRegionSide = 32;

/// Means over the regions of an image, by rows. Where sides are no multiples of kRegionSide, the last regions reach
/// into those before.
struct RegionErrors {
  int columns = 0, rows = 0;
  std::vector<double> error;
  std::vector<double> noise;  ///< variance of `error` by the references' noise, as their difference tells; 0 for one
  bool empty() const { return error.empty(); }
};

/// Values of a frame; those of changes are not-a-number for the first one.
struct FrameErrors {
  double relmse = 0, temporal = 0, temporal_flip = 0;
  /// relMSE of what the references find unchanged since the frame before, and the part of the pixels that it is about;
  /// not-a-number where that is 0.
  double still_relmse = 0, still_part = 0;
  uint64_t n_non_finite = 0;  ///< pixels that are left out here
  RegionErrors regions, temporal_regions;
};

/// Takes the frames of a sequence in their order. Keeps one frame and its references.
class SequenceErrors {
 public:
  /// The next frame and its one or two references, of the same size, 3 channels, linear RGB. `low_dynamic_range` as for
  /// compute_metric(). Throws Error(kInput) where sizes differ, also from those of the frame before.
  void add(Image frame, std::vector<Image> references, bool low_dynamic_range = false);
  const std::vector<FrameErrors>& frames() const { return frames_; }

 private:
  void add_changes(const Image& frame, const std::vector<Image>& references, bool low_dynamic_range,
                   FrameErrors& errors) const;
  void add_still(const Image& frame, const std::vector<Image>& references, FrameErrors& errors) const;
  std::vector<FrameErrors> frames_;
  Image before_;
  std::vector<Image> references_before_;
};

/// Frame by frame the means over renders of different seeds, of regions as well. Empty for none.
std::vector<FrameErrors> mean_over_renders(std::span<const std::vector<FrameErrors>> renders);

/// Means over frames, those of changes over all but the first, and of what is unchanged over its pixels.
struct SequenceSummary {
  double relmse, temporal, temporal_flip, still_relmse, still_part;
};
SequenceSummary summary_of(std::span<const FrameErrors> frames);

/// The region where a sequence is worst beside another one, which shows where light of frames before stays behind.
struct WorstRegion {
  double ratio;       ///< of errors; not-a-number where the references are too noisy to tell the other's error anywhere
  int frame;          ///< index; -1 for means over frames
  int column, row;    ///< of the region
  uint64_t left_out;  ///< regions whose error the references do not tell: less than 4 standard errors above 0
};
/// Regions of the frames of both sequences, equally many; empty ones (of a first frame) are passed over.
WorstRegion worst_region_of_means(std::span<const RegionErrors* const> tested,
                                  std::span<const RegionErrors* const> other);
WorstRegion worst_region_of_frames(std::span<const RegionErrors* const> tested,
                                   std::span<const RegionErrors* const> other);

/// All four of a sequence beside another one.
struct WorstRegions {
  WorstRegion relmse, relmse_of_frame, temporal, temporal_of_frame;
};
WorstRegions worst_regions(std::span<const FrameErrors> tested, std::span<const FrameErrors> other);

}  // namespace covary
