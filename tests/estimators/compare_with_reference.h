// SPDX-License-Identifier: Apache-2.0
// Whole images of the control variates of src/estimators against reference_control_variates.h.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimators/estimator_result.h"
#include "estimators/reference_control_variates.h"
#include "filters/neighbours.h"

namespace covary::reference {

/// The neighbours of all pixels (neighbours_test checks them).
inline std::vector<std::vector<Pixel>> neighbours(const GroupedImage& crn, int k, int window) {
  const std::vector<unsigned char> valid(static_cast<size_t>(crn.width) * crn.height, 1);
  const Planes guide = moments(crn, valid, window / 2, kFar).mean;
  const NeighbourSearch search(k, window);
  std::vector<lanes::vint> keys(search.offsets().size());
  std::vector<uint16_t> chosen(search.chosen_size());
  std::vector<std::vector<Pixel>> result(valid.size());
  for (int y = 0; y < crn.height; ++y)
    for (int x = 0; x < crn.width; ++x) {
      search.find(guide, x, y, keys.data(), chosen.data());
      for (int i = 0; i < k; ++i) {
        const Offset o = search.offsets()[chosen[i]];
        const Pixel q{x + o.dx, y + o.dy};
        if (q.x >= 0 && q.y >= 0 && q.x < crn.width && q.y < crn.height) result[y * crn.width + x].push_back(q);
      }
    }
  return result;
}

/// Largest differences of the estimate and the standard error from the reference, in units of the standard deviation of
/// the CRN mean and its missing light.
struct Difference {
  double estimate = 0, std_error = 0;
};

inline Difference compare(const EstimatorResult& fast, const GroupedImage& crn, const GroupedImage& independent,
                          const RgbImage& error_of_h, int k, int window, const Settings& settings) {
  const auto all = neighbours(crn, k, window);
  const RgbImage h = map_pixels(independent, [&](int x, int y) { return mean(independent, x, y); });
  const RgbImage variance = map_pixels(independent, [&](int x, int y) { return variance_of_mean(independent, x, y); });
  const RgbImage missing = missing_light(crn, independent);
  Difference worst;
  for (int y = 0; y < crn.height; ++y)
    for (int x = 0; x < crn.width; ++x) {
      const Result exact =
          control_variates(crn, h, error_of_h, variance, {x, y}, all[y * crn.width + x], settings, missing);
      const Rgb noise = variance_of_mean(crn, x, y);
      for (int c = 0; c < 3; ++c) {
        const double unit = std::sqrt(noise[c]) + std::abs(missing[y * crn.width + x][c]) + 1e-9;
        worst.estimate = std::max(worst.estimate, std::abs(fast.estimate.pixel(x, y)[c] - exact.estimate[c]) / unit);
        if (!fast.std_error.data.empty())
          worst.std_error =
              std::max(worst.std_error, std::abs(fast.std_error.pixel(x, y)[c] - exact.std_error[c]) / unit);
      }
    }
  return worst;
}

/// The pilot error of all pixels of the independent image.
inline RgbImage pilot_of(const GroupedImage& crn, const GroupedImage& independent, int window) {
  return pilot_error(crn, map_pixels(independent, [&](int x, int y) { return mean(independent, x, y); }), window,
                     independent);
}

}  // namespace covary::reference
