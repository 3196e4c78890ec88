// SPDX-License-Identifier: Apache-2.0
// IDUW on a device against the processor's function.
#include "gpu/iduw.h"

#include <gtest/gtest.h>

#include <limits>

#include "estimators/test_images.h"
#include "gpu/agreement.h"

namespace covary::gpu {
namespace {

using test_support::agreeing, test_support::test_device;

/// The fraction of values that agree, and whether the same gamma was chosen.
std::pair<double, bool> compare(const test::Grouped& crn, const test::Grouped& independent, const IduwOptions& options,
                                const Trial& trial = {}) {
  float expected_gamma = 0, found_gamma = 0;
  const EstimatorResult expected = covary::iduw(crn.view(), independent.view(), options, &expected_gamma),
                        found = iduw(test_device(), crn.view(), independent.view(), options, &found_gamma, trial);
  EXPECT_EQ(found.nonfinite_pixels, expected.nonfinite_pixels);
  return {agreeing(found.estimate, expected.estimate), expected_gamma == found_gamma};
}

TEST(IduwOnDevice, AgreesWithTheProcessor) {
  test::Grouped crn = test::crn_image(41, 27, 12, 1), independent = test::independent_image(41, 27, 8, 2);
  IduwOptions options;
  options.samples = 48;
  for (const int window : {15, 5}) {
    options.window = window;
    const auto [agreeing, same_gamma] = compare(crn, independent, options);
    EXPECT_GE(agreeing, 0.999) << window;
    EXPECT_TRUE(same_gamma) << window;
  }
  options.gammas = {0.3f};
  crn.pixel(3, 4)[1] = std::numeric_limits<float>::quiet_NaN();
  crn.counts.assign(41 * 27, 50);
  EXPECT_GE(compare(crn, independent, options).first, 0.999);
}

/// The image is reflected, repeatedly where the window is larger.
TEST(IduwOnDevice, AgreesForSmallImages) {
  const test::Grouped crn = test::crn_image(3, 1, 4, 1), independent = test::independent_image(3, 1, 4, 2);
  IduwOptions options;
  options.samples = 4;
  EXPECT_GE(compare(crn, independent, options).first, 0.999);
}

TEST(IduwOnDevice, PlantedBugIsNoticed) {
  const test::Grouped crn = test::crn_image(41, 27, 12, 1), independent = test::independent_image(41, 27, 8, 2);
  IduwOptions options;
  options.samples = 48;
  Trial trial;
  trial.planted_bug = "iduw.cl";
  EXPECT_LT(compare(crn, independent, options, trial).first, 0.9);
}

}  // namespace
}  // namespace covary::gpu
