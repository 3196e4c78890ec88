// SPDX-License-Identifier: Apache-2.0
// The predicted error of an image, by hand.
#include "estimators/predicted_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"

namespace covary {
namespace {

TEST(PredictedError, IsTheMeanOfRelativeSquares) {
  EstimatorResult result;
  result.estimate = Image(3, 1, 3);
  result.std_error = Image(3, 1, 3);
  result.estimate.data = {1, 2, 3, 0, 0, 0, 1, 1, 1};
  result.std_error.data = {0.1f, 0.2f, 0.3f, 0.1f, 0, 0, std::numeric_limits<float>::quiet_NaN(), 0, 0};
  // The third pixel is not finite and does not count.
  const double first = (0.01 + 0.04 + 0.09) / 3 / (4 + 0.01), second = 0.01 / 3 / 0.01;
  EXPECT_NEAR(predicted_relmse(result), (first + second) / 2, 1e-7);
}

/// 4 x 5 blocks, the last ones smaller, of which block i has the error i.
TEST(PredictedError, OfBlocksIsTheirPercentile) {
  EstimatorResult result;
  result.estimate = Image(60, 70, 3);
  result.std_error = Image(60, 70, 3);
  for (int y = 0; y < 70; ++y)
    for (int x = 0; x < 60; ++x)
      for (int c = 0; c < 3; ++c)
        result.std_error.pixel(x, y)[c] = std::sqrt(0.01f * static_cast<float>(y / 16 * 4 + x / 16));
  EXPECT_NEAR(predicted_blocks(result), 18, 1e-4);  // 19 of 20 have no more
  result.estimate = result.std_error = Image(3, 2, 3);
  EXPECT_EQ(predicted_blocks(result), 0);
}

TEST(PredictedError, NeedsAStandardError) {
  EstimatorResult result;
  result.estimate = Image(2, 2, 3);
  try {
    predicted_relmse(result);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "predicted_relmse: the result has no standard error; set std_error in the options");
  }
}

}  // namespace
}  // namespace covary
