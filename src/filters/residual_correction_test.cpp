// SPDX-License-Identifier: Apache-2.0
// What a denoiser removed is restored where it is missing, for any side of the cells.
#include "filters/residual_correction.h"

#include <gtest/gtest.h>

#include "filters/planes.h"

namespace covary {
namespace {

/// The estimate is grey; h grows from row to row. A window contains rows on both sides of the pixel's own.
TEST(ResidualCorrection, GivesBackTheResidualOfTheRowsAround) {
  constexpr int kWidth = 40, kHeight = 64, kWindow = 9;
  const std::vector<unsigned char> valid(kWidth * kHeight, 1);
  const auto brightness = [](int y) { return 1 + 0.5f * static_cast<float>(y) / kHeight; };
  Moments h{Planes(kWidth, kHeight, 3, 0, 0), Planes(kWidth, kHeight, 3, 0, 0.01f), {}};
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < kHeight; ++y) std::fill_n(h.mean.row(c, y), kWidth, brightness(y));
  for (const int cell : {2, 4}) {
    Image estimate(kWidth, kHeight, 3);
    std::fill(estimate.data.begin(), estimate.data.end(), 1.0f);
    add_residual(h, {0.5f, kWindow, cell}, valid, estimate);
    for (int y = kWindow; y < kHeight - kWindow; ++y)
      ASSERT_NEAR(estimate.pixel(kWidth / 2, y)[1], brightness(y), 0.51f * static_cast<float>(cell) / kHeight)
          << "cells of " << cell << ", row " << y;
  }
}

}  // namespace
}  // namespace covary
