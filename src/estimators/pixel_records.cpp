// SPDX-License-Identifier: Apache-2.0
#include "estimators/pixel_records.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "film/groups.h"
#include "filters/neighbours.h"

namespace covary {

PixelRecords::PixelRecords(const ControlVariateInput& input, const ControlVariateSettings& settings,
                           const std::vector<unsigned char>& valid)
    : in_(input),
      valid_(valid),
      T_(input.crn.groups),
      weights_differ_(input.crn_moments->relative_count.has_value()),
      layout_(weights_differ_ ? T_ : T_ - 1, settings.mean_constraint > 0, settings.shared),
      weights_(T_) {
  for (int j = 1; j < T_; ++j) weights_[j] = 1.0f / std::sqrt(static_cast<float>(j) * static_cast<float>(j + 1));
}

/// Contrast j: (x_0 + … + x_{j-1} - j x_j) / sqrt(j (j + 1)). `squares`: sum of squared contrasts per channel.
void PixelRecords::make_contrasts(const float* p, float* record, float* squares) const {
  typedef float Rgb __attribute__((vector_size(4 * sizeof(float))));  // the fourth lane is unused
  Rgb sum = {p[0], p[1], p[2], 0}, total = {};
  const auto add = [&](int j, Rgb value) {
    const Rgb contrast = (sum - static_cast<float>(j) * value) * weights_[j];
    sum += value;
    total += contrast * contrast;
    std::memcpy(record + 3 * (j - 1), &contrast, sizeof contrast);  // the spilled lane is overwritten later
  };
  for (int j = 1; j < T_ - 1; ++j) {
    Rgb value;
    std::memcpy(&value, p + 3 * j, sizeof value);
    add(j, value);
  }
  const float* last = p + 3 * (T_ - 1);  // memory beyond it may not be readable
  if (T_ > 1) add(T_ - 1, Rgb{last[0], last[1], last[2], 0});
  for (int c = 0; c < 3; ++c) squares[c] = total[c];
}

/// Same for groups of unequal sizes, with weights w_t = size T / count, of mean 1: with W = w_0 + … + w_{j-1}, ((w_0
/// x_0 + … + w_{j-1} x_{j-1}) / W - x_j) sqrt(w_j W / (W + w_j)). The squares sum to sum w_t (x_t - mean)^2.
void PixelRecords::make_weighted_contrasts(const float* p, uint32_t count, float* record, float* squares) const {
  const auto weight = [&, unit = static_cast<float>(T_) / static_cast<float>(count)](int t) {
    return unit * static_cast<float>(group_size(count, T_, t));
  };
  float total = weight(0), sum[3] = {total * p[0], total * p[1], total * p[2]};
  for (int j = 1; j < T_; ++j) {
    const float w = weight(j), factor = std::sqrt(w * total / (total + w));
    for (int c = 0; c < 3; ++c) {
      const float value = p[3 * j + c], contrast = (sum[c] / total - value) * factor;
      sum[c] += w * value;
      squares[c] += contrast * contrast;
      record[3 * (j - 1) + c] = contrast;
    }
    total += w;
  }
}

/// If weights w_t differ between pixels: sqrt(w_t) (x_t - mean).
void PixelRecords::make_centred_means(const float* p, uint32_t count, const float* mean, float* record,
                                      float* squares) const {
  for (int t = 0; t < T_; ++t) {
    const float weight =
        static_cast<float>(T_) * static_cast<float>(group_size(count, T_, t)) / static_cast<float>(count);
    for (int c = 0; c < 3; ++c) {
      const float value = std::sqrt(weight) * (p[3 * t + c] - mean[c]);
      squares[c] += value * value;
      record[3 * t + c] = value;
    }
  }
}

void PixelRecords::put_penalties(const float* values, float* to) const {
  if (layout_.penalties == 1)
    to[0] = values[0] + values[1] + values[2];
  else
    std::copy_n(values, 3, to);
}

void PixelRecords::fill(int x, int y, float* record) const {
  const bool inside = x >= 0 && y >= 0 && x < in_.crn.width && y < in_.crn.height;
  if (!inside || !valid_[static_cast<size_t>(y) * in_.crn.width + x]) {
    std::fill(record, record + layout_.size, 0.0f);
    const float useless[3] = {kUseless, kUseless, kUseless};
    put_penalties(useless, record + layout_.error);
    return;
  }
  float squares[3] = {}, mean[3];
  for (int c = 0; c < 3; ++c) mean[c] = in_.crn_moments->mean.row(c, y)[x];
  if (weights_differ_)
    make_centred_means(in_.crn.pixel(x, y), in_.crn.count(x, y), mean, record, squares);
  else if (in_.crn.has_equal_groups(x, y))
    make_contrasts(in_.crn.pixel(x, y), record, squares);
  else
    make_weighted_contrasts(in_.crn.pixel(x, y), in_.crn.count(x, y), record, squares);
  if (layout_.contrasts > layout_.group_contrasts)
    for (int c = 0; c < 3; ++c) record[layout_.group_contrasts + c] = mean[c] + missing(c, x, y);
  float error[3], group_variance[3];
  for (int c = 0; c < 3; ++c) {
    record[layout_.difference + c] = mean[c] - in_.h->row(c, y)[x];
    record[layout_.h_variance + c] = in_.variance_of_h ? in_.variance_of_h->row(c, y)[x] : 0.0f;
    record[layout_.missing + c] = missing(c, x, y);
    error[c] = in_.error_of_h ? static_cast<float>(T_) * in_.error_of_h->row(c, y)[x] : 0.0f;
    group_variance[c] = squares[c] / static_cast<float>(T_ - 1);
  }
  put_penalties(error, record + layout_.error);
  put_penalties(group_variance, record + layout_.group_variance);
}

}  // namespace covary
