// SPDX-License-Identifier: Apache-2.0
// The predicted error of an image, checked by hand.
#include "risk/predicted_error.h"

#include <gtest/gtest.h>

#include <algorithm>
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
  // The third pixel is not finite and is ignored.
  const double first = (0.01 + 0.04 + 0.09) / 3 / (4 + 0.01), second = 0.01 / 3 / 0.01;
  EXPECT_NEAR(predicted_relmse(result), (first + second) / 2, 1e-7);
}

/// 4 x 5 blocks, the last ones smaller, where block i has error i.
TEST(PredictedError, OfBlocksIsTheirPercentile) {
  EstimatorResult result;
  result.estimate = Image(60, 70, 3);
  result.std_error = Image(60, 70, 3);
  for (int y = 0; y < 70; ++y)
    for (int x = 0; x < 60; ++x)
      for (int c = 0; c < 3; ++c)
        result.std_error.pixel(x, y)[c] = std::sqrt(0.01f * static_cast<float>(y / 16 * 4 + x / 16));
  EXPECT_NEAR(predicted_blocks(result), 18, 1e-4);  // 19 of 20 have no more
  EXPECT_EQ(predicted_error(result, 47, 48)->doubt, "fewer than 48 samples per pixel");
  EXPECT_EQ(predicted_error(result, 1, 0)->doubt, "");
  result.estimate = result.std_error = Image(3, 2, 3);
  EXPECT_EQ(predicted_blocks(result), 0);
}

TEST(PredictedError, IsDoubtedWhereFewPixelsHoldIt) {
  EstimatorResult result;
  result.estimate = result.std_error = Image(40, 25, 3);
  std::fill(result.std_error.data.begin(), result.std_error.data.end(), 0.1f);
  EXPECT_EQ(predicted_error(result, 48, 48)->doubt, "");
  // 990 pixels with 1 each and 10 with 70 each: 0.41 of 1690.
  for (int x = 0; x < 10; ++x)
    for (int c = 0; c < 3; ++c) result.std_error.pixel(3 * x, 7)[c] = 0.1f * std::sqrt(70.0f);
  EXPECT_EQ(predicted_error(result, 48, 48)->doubt, "41 % of it lies in 1 % of the pixels");
  for (int x = 0; x < 10; ++x)
    for (int c = 0; c < 3; ++c) result.std_error.pixel(3 * x, 7)[c] = 0.1f * std::sqrt(60.0f);  // 0.38
  EXPECT_EQ(predicted_error(result, 48, 48)->doubt, "");
  std::fill(result.std_error.data.begin(), result.std_error.data.end(), 0.0f);
  EXPECT_EQ(predicted_error(result, 48, 48)->doubt, "");
  EXPECT_EQ(predicted_error(result, 47, 48)->doubt, "fewer than 48 samples per pixel");
  EXPECT_EQ(predicted_error(result, 1, 0)->doubt, "");
  result.estimate = result.std_error = Image(3, 2, 3);
  result.std_error.pixel(1, 1)[0] = 1;
  EXPECT_EQ(predicted_error(result, 48, 48)->doubt, "") << "six pixels have no hundredth";
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

/// A grey image of brightness 0.5 and standard error 0.02.
EstimatorResult flat_result() {
  EstimatorResult result;
  result.estimate = result.std_error = Image(40, 25, 3);
  std::fill(result.estimate.data.begin(), result.estimate.data.end(), 0.5f);
  std::fill(result.std_error.data.begin(), result.std_error.data.end(), 0.02f);
  return result;
}

void set_pixel(EstimatorResult& result, int x, int y, float value, float error) {
  std::fill_n(result.estimate.pixel(x, y), 3, value), std::fill_n(result.std_error.pixel(x, y), 3, error);
}

TEST(PredictedError, FirefliesCountRelativeToWhatIsAround) {
  EstimatorResult result = flat_result();
  EXPECT_EQ(fireflies_in(result).pixels, 0u);
  set_pixel(result, 10, 10, 15000, 14000),
      set_pixel(result, 11, 10, 15000, 14000);  // adjacent: neither hides the other
  const Fireflies found = fireflies_in(result);
  EXPECT_EQ(found.pixels, 2u);
  EXPECT_NEAR(found.relmse, 2 * 14000.0 * 14000 / 0.26 / 1000, 1e-4 * found.relmse);
  EXPECT_LT(predicted_relmse(result), 0.01) << "relative to themselves, they count little";
}

TEST(PredictedError, KnownLampsAndTheirEdgesAreNoFireflies) {
  EstimatorResult result = flat_result();
  set_pixel(result, 10, 10, 100, 5);  // known to a twentieth
  EXPECT_EQ(fireflies_in(result).pixels, 0u);
  set_pixel(result, 11, 10, 40, 20);  // the lamp's edge
  EXPECT_EQ(fireflies_in(result).pixels, 0u);
  set_pixel(result, 30, 10, 4, 2);  // eight times as bright as around
  EXPECT_EQ(fireflies_in(result).pixels, 0u);
  set_pixel(result, 30, 10, 6, 3);
  EXPECT_EQ(fireflies_in(result).pixels, 1u);
}

}  // namespace
}  // namespace covary
