// SPDX-License-Identifier: Apache-2.0
// What a pixel contributes to the regressions of its neighbours (control_variates.h), contiguous in memory.
//
// The T centred group means of a pixel span only T - 1 dimensions. They are replaced by T - 1 orthonormal contrasts
// (Helmert), which have the same inner products: no centring, and systems of T - 1 instead of T rows. Weights of groups
// turn that space; where they differ between pixels, the T weighted and centred means are kept.
#pragma once

#include <cstdint>
#include <vector>

#include "estimators/control_variates.h"

namespace covary {

/// Offsets in the record of a pixel.
struct RecordLayout {
  RecordLayout(int rows, bool condition)
      : group_contrasts(3 * rows),
        contrasts(group_contrasts + (condition ? 3 : 0)),
        difference(contrasts),
        error(contrasts + 3),
        group_variance(contrasts + 6),
        h_variance(contrasts + 9),
        missing(contrasts + 12),
        size(contrasts + 15) {}
  int group_contrasts;  ///< number of contrasts (or centred means) of the groups, all channels: [contrast][rgb], at 0
  int contrasts;        ///< the same with the row of the condition, which acts like one more contrast
  int difference;       ///< g - h
  int error;            ///< error variance of h for the penalty, times T
  int group_variance;   ///< sample variance of the CRN groups
  int h_variance;       ///< variance of h
  int missing;          ///< light that g lacks
  int size;
};

class PixelRecords {
 public:
  /// `condition`: with a row for the condition on the coefficients; `valid`: 0 marks pixels that contribute nothing.
  PixelRecords(const ControlVariateInput& input, bool condition, const std::vector<unsigned char>& valid);

  const RecordLayout& layout() const { return layout_; }

  /// Writes the record of a pixel, layout().size floats; of one outside the image, one that contributes nothing.
  void fill(int x, int y, float* record) const;

 private:
  void make_contrasts(const float* p, float* record, float* squares) const;
  void make_weighted_contrasts(const float* p, uint32_t count, float* record, float* squares) const;
  void make_centred_means(const float* p, uint32_t count, const float* mean, float* record, float* squares) const;
  float missing(int c, int x, int y) const { return in_.missing ? in_.missing->row(c, y)[x] : 0.0f; }

  const ControlVariateInput& in_;
  const std::vector<unsigned char>& valid_;
  const int T_;
  const bool weights_differ_;  // between pixels
  const RecordLayout layout_;
  std::vector<float> weights_;  // of contrasts
};

}  // namespace covary
