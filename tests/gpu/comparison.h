// SPDX-License-Identifier: Apache-2.0
// Values of a device against those of the processor, with the worst of them; agreement.h compares images.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "filters/planes.h"
#include "gpu/agreement.h"

namespace covary::test_support {

/// Whether 99.9 % of the values are within 1e-4 of |value| + 0.01 of those expected.
inline testing::AssertionResult agree(const std::vector<float>& expected, const std::vector<float>& found) {
  if (expected.size() != found.size())
    return testing::AssertionFailure() << fmt::format("{} values, {} expected", found.size(), expected.size());
  size_t agreeing = 0, worst = 0;
  double largest = -1;
  for (size_t i = 0; i < expected.size(); ++i) {
    double relative = std::abs(double{found[i]} - expected[i]) / (std::abs(expected[i]) + 0.01);
    if (expected[i] == found[i]) relative = 0;  // infinities
    if (std::isnan(relative)) relative = std::numeric_limits<double>::infinity();
    if (relative > largest) largest = relative, worst = i;
    agreeing += relative <= 1e-4;
  }
  const double part = static_cast<double>(agreeing) / static_cast<double>(expected.size());
  auto result = part >= 0.999 ? testing::AssertionSuccess() : testing::AssertionFailure();
  return result << fmt::format("{:.4f} of the values agree; the worst, number {}: {} instead of {}", part, worst,
                               found.empty() ? 0 : found[worst], expected.empty() ? 0 : expected[worst]);
}

/// The first three planes as an image.
inline std::vector<float> values_of(const Planes& planes) {
  std::vector<float> values;
  for (int y = 0; y < planes.height(); ++y)
    for (int x = 0; x < planes.width(); ++x)
      for (int c = 0; c < 3; ++c) values.push_back(planes.row(c, y)[x]);
  return values;
}

}  // namespace covary::test_support
