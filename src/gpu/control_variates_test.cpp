// SPDX-License-Identifier: Apache-2.0
// IICV and the CV baseline on a device against the processor's functions; kernels that are slightly wrong; bands.
#include "gpu/control_variates.h"

#include <gtest/gtest.h>

#include <limits>

#include "estimators/control_variates.h"
#include "estimators/test_images.h"
#include "gpu/agreement.h"

namespace covary::gpu {
namespace {

using device::Device;
using test_support::agreeing, test_support::test_device;

constexpr int kWidth = 41, kHeight = 27;
constexpr double kAgreeing = 0.999;

test::Grouped crn_image(int groups = 12) { return test::crn_image(kWidth, kHeight, groups, 1); }
test::Grouped independent_image(int groups = 12) { return test::independent_image(kWidth, kHeight, groups, 2); }

/// Fraction of the values of image and error that agree.
struct Agreement {
  double estimate, std_error;
};
Agreement compare(const test::Grouped& crn, const test::Grouped& independent, const IicvOptions& options,
                  const Trial& trial = {}, double relative = 1e-4) {
  const EstimatorResult expected = covary::iicv(crn.view(), independent.view(), options),
                        found = iicv(test_device(), crn.view(), independent.view(), options, trial);
  EXPECT_EQ(found.nonfinite_pixels, expected.nonfinite_pixels);
  return {agreeing(found.estimate, expected.estimate, relative),
          agreeing(found.std_error, expected.std_error, relative)};
}

IicvOptions defaults() {
  IicvOptions options;
  options.std_error = true;
  return options;
}
IicvOptions paper() {
  IicvOptions options = IicvOptions::paper();
  options.std_error = true;
  return options;
}

void expect_agreement(const Agreement& agreement, const std::string& of) {
  EXPECT_GE(agreement.estimate, kAgreeing) << of;
  EXPECT_GE(agreement.std_error, kAgreeing) << of;
}

/// Both forms of the systems, shared and own coefficients of channels, all penalties, several numbers of groups.
TEST(ControlVariatesOnDevice, AgreeWithTheProcessor) {
  const test::Grouped crn = crn_image(), independent = independent_image();
  expect_agreement(compare(crn, independent, defaults()), "defaults");
  expect_agreement(compare(crn, independent, paper()), "paper");
  // Each set of options is a kernel to compile, which takes most of the time.
  for (const auto& [k, window, shared, penalty] : {std::tuple{50, 21, true, Penalty::kSample},
                                                   {8, 7, false, Penalty::kAsymmetric},
                                                   {1, 3, true, defaults().penalty}}) {
    IicvOptions options = defaults();
    options.k = k, options.window = window, options.shared_coefficients = shared, options.penalty = penalty;
    expect_agreement(compare(crn, independent, options), "k = " + std::to_string(k));
  }
}

TEST(ControlVariatesOnDevice, AgreeForOtherNumbersOfGroups) {
  for (const auto& [crn_groups, independent_groups] : {std::pair{3, 2}, {24, 7}})
    expect_agreement(compare(crn_image(crn_groups), independent_image(independent_groups), defaults()),
                     std::to_string(crn_groups) + " groups");
}

/// A single group of the independent image has no variance.
TEST(ControlVariatesOnDevice, AgreeForOneIndependentGroup) {
  const EstimatorResult expected = covary::iicv(crn_image().view(), independent_image(1).view(), IicvOptions::paper());
  const test::Grouped crn = crn_image(), independent = independent_image(1);
  const EstimatorResult found = iicv(test_device(), crn.view(), independent.view(), IicvOptions::paper());
  EXPECT_GE(agreeing(found.estimate, covary::iicv(crn.view(), independent.view(), IicvOptions::paper()).estimate),
            kAgreeing);
  EXPECT_TRUE(found.std_error.data.empty());
}

TEST(ControlVariatesOnDevice, AgreeForUnequalCounts) {
  test::Grouped crn = crn_image(), independent = independent_image();
  const auto add_counts = [](test::Grouped& image, uint32_t least, uint32_t spread) {
    image.counts.resize(static_cast<size_t>(kWidth) * kHeight);
    for (size_t i = 0; i < image.counts.size(); ++i)
      image.counts[i] = least + static_cast<uint32_t>(mix64(i + 3) % spread);
  };
  add_counts(independent, 24, 30);
  expect_agreement(compare(crn, independent, defaults()), "independent counts");
  add_counts(crn, 30, 1);
  expect_agreement(compare(crn, independent, defaults()), "unequal groups");
  add_counts(crn, 30, 9);
  expect_agreement(compare(crn, independent, defaults()), "all counts");
}

/// Light that the CRN image lacks in a third of the picture. There, only the mean constraint is left of the systems,
/// whose condition numbers reach 10^5, so that the order of sums shows in the fourth digit.
TEST(ControlVariatesOnDevice, AgreeForMissingLight) {
  test::Grouped crn = crn_image(), independent = independent_image();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < 14; ++x) std::fill_n(crn.pixel(x, y), 36, 0.0f);
  expect_agreement(compare(crn, independent, defaults(), {}, 1e-3), "missing light");
  expect_agreement(compare(crn, independent, paper()), "missing light, as published");
}

/// Values that are not numbers, and a huge one.
TEST(ControlVariatesOnDevice, AgreeForUnusableValues) {
  test::Grouped crn = crn_image(), independent = independent_image();
  crn.pixel(20, 10)[5] = std::numeric_limits<float>::quiet_NaN();
  independent.pixel(0, 26)[0] = std::numeric_limits<float>::infinity();
  expect_agreement(compare(crn, independent, defaults()), "not numbers");
  independent.pixel(33, 3)[7] = 1e8f;
  expect_agreement(compare(crn, independent, defaults()), "huge");
}

TEST(ControlVariatesOnDevice, BaselineAgrees) {
  const test::Grouped crn = crn_image(), independent = independent_image();
  for (const float ridge : {0.01f, 1.0f}) {
    CvBaselineOptions options;
    options.ridge = ridge;
    options.std_error = true;
    const EstimatorResult expected = covary::cv_baseline(crn.view(), independent.view(), options),
                          found = cv_baseline(test_device(), crn.view(), independent.view(), options);
    EXPECT_GE(agreeing(found.estimate, expected.estimate), kAgreeing) << ridge;
    EXPECT_GE(agreeing(found.std_error, expected.std_error), kAgreeing) << ridge;
  }
}

/// A kernel that is slightly wrong is noticed.
TEST(ControlVariatesOnDevice, PlantedBugsAreNoticed) {
  const test::Grouped crn = crn_image(), independent = independent_image();
  for (const char* file :
       {"pair_moments.cl", "similar_pixels.cl", "nearest.cl", "control_variates.cl", "residual_correction.cl"}) {
    Trial trial;
    trial.planted_bug = file;
    EXPECT_LT(compare(crn, independent, defaults(), trial).estimate, 0.99) << file;
  }
}

TEST(ControlVariatesOnDevice, GiveTheSameBitsAgain) {
  const test::Grouped crn = crn_image(), independent = independent_image();
  const auto run = [&] { return iicv(test_device(), crn.view(), independent.view(), defaults()); };
  const EstimatorResult first = run(), second = run();
  EXPECT_EQ(first.estimate.data, second.estimate.data);
  EXPECT_EQ(first.std_error.data, second.std_error.data);
}

/// Bands have the bits of the whole.
TEST(ControlVariatesOnDevice, BandsChangeNoBit) {
  const test::Grouped crn = test::crn_image(9, 130, 4, 1), independent = test::independent_image(9, 130, 4, 2);
  IicvOptions options = defaults();
  options.residual_options.window = 9;
  const EstimatorResult whole = iicv(test_device(), crn.view(), independent.view(), options);
  Trial trial;
  trial.rows_at_once = 2 * (5 + 5 + 16) + 24;
  const EstimatorResult bands = iicv(test_device(), crn.view(), independent.view(), options, trial);
  EXPECT_EQ(whole.estimate.data, bands.estimate.data);
  EXPECT_EQ(whole.std_error.data, bands.std_error.data);
  trial.rows_at_once = 40;
  EXPECT_THROW(iicv(test_device(), crn.view(), independent.view(), options, trial), device::Failure);
}

TEST(ControlVariatesOnDevice, RefuseWhatDoesNotFit) {
  const test::Grouped crn = crn_image(), independent = independent_image();
  IicvOptions options;
  options.k = 2000, options.window = 63;
  try {
    iicv(test_device(), crn.view(), independent.view(), options);
    FAIL();
  } catch (const device::Failure& failure) {
    EXPECT_EQ(std::string(failure.what()).find("2000 control variates with 12 groups need "), 0u) << failure.what();
  }
}

}  // namespace
}  // namespace covary::gpu
