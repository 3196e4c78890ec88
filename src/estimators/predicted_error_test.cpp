// SPDX-License-Identifier: Apache-2.0
// The predicted error of an image, by hand.
#include "estimators/predicted_error.h"

#include <gtest/gtest.h>

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
