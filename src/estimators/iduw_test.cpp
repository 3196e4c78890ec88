// SPDX-License-Identifier: Apache-2.0
#include "estimators/iduw.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "core/error.h"
#include "estimators/reference_iduw.h"
#include "estimators/test_images.h"

namespace covary {
namespace {

TEST(Iduw, AgreesWithTheReference) {
  for (const auto& [width, height, groups] : {std::tuple{21, 13, 12}, {3, 5, 4}, {1, 2, 6}}) {
    const test::Grouped crn = test::crn_image(width, height, groups, 1),
                        independent = test::independent_image(width, height, groups, 2);
    const GroupedImage crn_view = crn.view(), independent_view = independent.view();
    const reference::Iduw exact{crn_view, independent_view, 7, 96};
    IduwOptions options;
    options.window = 7;
    options.samples = 96;
    options.gammas = {0.01f, 0.2f, 2.5f};
    float gamma = 0;
    const EstimatorResult fast = iduw(crn_view, independent_view, options, &gamma);

    double best = 0, smallest = 1e300;
    for (float g : options.gammas)
      if (const double loss = exact.loss(g); loss < smallest) smallest = loss, best = g;
    EXPECT_EQ(gamma, static_cast<float>(best));
    for (float g : options.gammas) {
      options.gammas = {g};
      const EstimatorResult one = iduw(crn_view, independent_view, options);
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          for (int c = 0; c < 3; ++c) EXPECT_NEAR(one.estimate.pixel(x, y)[c], exact.result(x, y, c, g), 1e-4);
    }
  }
}

TEST(Iduw, BitsDoNotDependOnThreads) {
  const test::Grouped crn = test::crn_image(70, 40, 4, 1), independent = test::independent_image(70, 40, 4, 2);
  IduwOptions options;
  options.samples = 16;
  const auto with_threads = [&](int n) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, n);
    return iduw(crn.view(), independent.view(), options).estimate.data;
  };
  const std::vector<float> one = with_threads(1);
  EXPECT_EQ(one, with_threads(2));
  EXPECT_EQ(one, with_threads(5));
}

TEST(Iduw, DegenerateInputs) {
  IduwOptions options;
  options.samples = 16;
  // No noise in CRN: every weight is 1, and the result is the CRN image shifted to the window's independent mean.
  const test::Grouped flat = test::constant_image(20, 20, 4, 0.5f), black = test::constant_image(20, 20, 4, 0);
  for (float v : iduw(flat.view(), flat.view(), options).estimate.data) EXPECT_NEAR(v, 0.5f, 1e-6f);
  for (float v : iduw(black.view(), black.view(), options).estimate.data) EXPECT_EQ(v, 0.0f);

  const test::Grouped crn = test::crn_image(30, 20, 4, 1), independent = test::independent_image(30, 20, 4, 2);
  test::Grouped bad = independent;
  bad.pixel(3, 4)[2] = NAN;
  const EstimatorResult good = iduw(crn.view(), independent.view(), options),
                        result = iduw(crn.view(), bad.view(), options);
  EXPECT_EQ(result.nonfinite_pixels, 1);
  for (float v : result.estimate.data) EXPECT_TRUE(std::isfinite(v));
  EXPECT_NEAR(result.estimate.pixel(20, 10)[0], good.estimate.pixel(20, 10)[0], 0.05f);
}

TEST(Iduw, ReportsEveryProblemAtOnce) {
  const test::Grouped three = test::constant_image(8, 6, 3, 1);
  IduwOptions options;
  try {
    iduw(three.view(), three.view(), options);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_STREQ(
        e.what(),
        "iduw: samples is 0, expected the samples per pixel of the CRN image; the CRN image has 3 groups, at least 4 "
        "are needed (12 are recommended); the independent image has 3 groups, at least 4 are needed with these "
        "settings");
  }
}

}  // namespace
}  // namespace covary
