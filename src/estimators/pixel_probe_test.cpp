// SPDX-License-Identifier: Apache-2.0
// The control variates that a probe reports are those that made the estimate.
#include "estimators/estimator_result.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "estimators/cv_baseline.h"
#include "estimators/iicv.h"
#include "estimators/reference_control_variates.h"
#include "estimators/test_images.h"

namespace covary {
namespace {

/// [YM2025] Eq. (7) with the probe's coefficients.
reference::Rgb estimate_from(const PixelProbe& probe, const GroupedImage& crn, const GroupedImage& independent) {
  reference::Rgb f = reference::mean(crn, probe.x, probe.y);
  for (const ControlVariate& v : probe.control_variates) {
    const reference::Rgb g = reference::mean(crn, probe.x + v.dx, probe.y + v.dy);
    const reference::Rgb h = reference::mean(independent, probe.x + v.dx, probe.y + v.dy);
    for (int c = 0; c < 3; ++c) f[c] -= v.beta[c] * (g[c] - h[c]);
  }
  return f;
}

template <typename Estimator, typename Options>
void expect_explained(Estimator estimator, Options options, size_t expected_count) {
  const test::Grouped crn = test::crn_image(40, 21, 12, 5), independent = test::independent_image(40, 21, 12, 5);
  for (const auto& [x, y] : {std::pair{0, 0}, {17, 9}, {39, 20}, {31, 0}}) {
    PixelProbe probe{x, y, {}};
    options.probe = &probe;
    const EstimatorResult result = estimator(crn.view(), independent.view(), options);
    EXPECT_EQ(probe.control_variates.size(), expected_count);
    const reference::Rgb expected = estimate_from(probe, crn.view(), independent.view());
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(result.estimate.pixel(x, y)[c], expected[c], 1e-4 * std::abs(expected[c]) + 1e-6) << x << ", " << y;
  }
}

TEST(PixelProbe, ExplainsTheEstimate) {
  IicvOptions options = IicvOptions::paper();
  expect_explained(iicv, options, 25);
  options.shared_coefficients = false;
  expect_explained(iicv, options, 25);
  options.k = 9;
  expect_explained(iicv, options, 9);
  CvBaselineOptions baseline;
  baseline.ridge = 0.1f;
  expect_explained(cv_baseline, baseline, 25);
}

TEST(PixelProbe, LeavesOutPlacesOutsideTheFrame) {
  const test::Grouped crn = test::crn_image(4, 3, 12, 5),
                      independent = test::independent_image(4, 3, 12, 5);  // fewer pixels than the 25 control variates
  IicvOptions options = IicvOptions::paper();
  PixelProbe probe{1, 1, {}};
  options.probe = &probe;
  iicv(crn.view(), independent.view(), options);
  EXPECT_EQ(probe.control_variates.size(), 12u);
  for (const ControlVariate& v : probe.control_variates) {
    EXPECT_TRUE(probe.x + v.dx >= 0 && probe.x + v.dx < 4 && probe.y + v.dy >= 0 && probe.y + v.dy < 3);
  }
}

}  // namespace
}  // namespace covary
