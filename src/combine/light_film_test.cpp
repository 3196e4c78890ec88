// SPDX-License-Identifier: Apache-2.0
#include "combine/light_film.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/files.h"

namespace covary::light_film_test {
namespace {

using test_support::contains, test_support::message_of;

TEST(LightFilm, MeansAndVariancesAdd) {
  const float groups[] = {1, 2, 3, 3, 2, 1};  // two groups of one pixel
  const GroupedImage light{1, 1, 2, groups};
  EstimatorResult result;
  result.estimate = Image(1, 1, 3), result.std_error = Image(1, 1, 3);
  result.estimate.data = {10, 20, 30}, result.std_error.data = {2, 3, 4};
  add_light(light, result);
  EXPECT_EQ(result.estimate.data, (std::vector<float>{12, 22, 32}));
  // Standard errors of the light film's means: 1, 0, 1.
  EXPECT_FLOAT_EQ(result.std_error.data[0], std::sqrt(5.0f));
  EXPECT_EQ(result.std_error.data[1], 3);
  EXPECT_FLOAT_EQ(result.std_error.data[2], std::sqrt(17.0f));
}

TEST(LightFilm, OneGroupHasNoStandardError) {
  const float value[] = {1, 2, 3};
  const GroupedImage light{1, 1, 1, value};
  EstimatorResult result;
  result.estimate = Image(1, 1, 3);
  add_light(light, result);
  EXPECT_EQ(result.estimate.data, (std::vector<float>{1, 2, 3}));
  EXPECT_TRUE(result.std_error.data.empty());
  result.std_error = Image(1, 1, 3);
  EXPECT_TRUE(contains(message_of([&] { add_light(light, result); }, ErrorCode::kInput), "2 or more groups"));
}

}  // namespace
}  // namespace covary::light_film_test
