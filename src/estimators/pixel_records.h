// SPDX-License-Identifier: Apache-2.0
// Per-pixel input of the regressions of its neighbours (control_variates.h), contiguous in memory.
//
// The T centred group means of a pixel span only T - 1 dimensions. They are replaced by T - 1 orthonormal (Helmert)
// contrasts, which have the same inner products: no centring, and systems of T - 1 instead of T rows. Group weights
// rotate that space; if they differ between pixels, the T weighted and centred means are kept instead.
#pragma once

#include <cstdint>
#include <vector>

#include "estimators/control_variates.h"

namespace covary {

/// Offsets within a pixel's record.
struct RecordLayout {
  /// `shared`: whether channels share their coefficients, and so their penalties.
  RecordLayout(int rows, bool condition, bool shared)
      : penalties(shared ? 1 : 3),
        group_contrasts(3 * rows),
        contrasts(group_contrasts + (condition ? 3 : 0)),
        difference(contrasts),
        h_variance(contrasts + 3),
        missing(contrasts + 6),
        error(contrasts + 9),
        group_variance(error + penalties),
        size(group_variance + penalties),
        stride((size + lanes::kLanes - 1) / lanes::kLanes * lanes::kLanes) {}
  int penalties;        ///< 1: summed over channels; 3: one per channel
  int group_contrasts;  ///< number of group contrasts (or centred means) in all channels: [contrast][rgb], at offset 0
  int contrasts;        ///< same including the row of the mean constraint, which acts like one more contrast
  int difference;       ///< g - h
  int h_variance;       ///< variance of h
  int missing;          ///< light missing from g
  int error;            ///< `penalties` values: error variance of h for the penalty, times T
  int group_variance;   ///< `penalties` values: sample variance of the CRN groups
  int size;
  int stride;  ///< floats from one record to the next: whole vectors
};

class PixelRecords {
 public:
  /// `valid`: 0 marks pixels that contribute nothing.
  PixelRecords(const ControlVariateInput& input, const ControlVariateSettings& settings,
               const std::vector<unsigned char>& valid);

  const RecordLayout& layout() const { return layout_; }

  /// Writes the record of a pixel, layout().size floats; outside the image, a record that contributes nothing.
  void fill(int x, int y, float* record) const;

 private:
  void make_contrasts(const float* p, float* record, float* squares) const;
  void make_weighted_contrasts(const float* p, uint32_t count, float* record, float* squares) const;
  void make_centred_means(const float* p, uint32_t count, const float* mean, float* record, float* squares) const;
  /// Stores the three channels, or their sum.
  void put_penalties(const float* values, float* to) const;
  float missing(int c, int x, int y) const { return in_.missing ? in_.missing->row(c, y)[x] : 0.0f; }

  const ControlVariateInput& in_;
  const std::vector<unsigned char>& valid_;
  const int T_;
  const bool weights_differ_;  // between pixels
  const RecordLayout layout_;
  std::vector<float> weights_;  // of contrasts
};

}  // namespace covary
