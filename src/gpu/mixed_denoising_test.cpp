// SPDX-License-Identifier: Apache-2.0
// The default's denoising on a device, as a whole, against the processor's.
#include "gpu/mixed_denoising.h"

#include <gtest/gtest.h>

#include "combine/registry.h"
#include "estimators/test_images.h"
#include "gpu/comparison.h"
#include "risk/error_interval.h"
#include "risk/plain_mean.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;

constexpr int kWidth = 72, kHeight = 53;

struct Pictures {
  Image albedo = Image(kWidth, kHeight, 3), normal = albedo, position = albedo;

  Pictures() {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) {
          albedo.pixel(x, y)[c] = 0.4f + 0.3f * test::noise(4, static_cast<uint64_t>(x / 8 + y / 8 * 100), c);
          normal.pixel(x, y)[c] = x + y > 45 ? 0.3f : -0.6f;
          position.pixel(x, y)[c] = static_cast<float>(c == 0 ? x : c == 1 ? y : x + y) * 0.05f;
        }
  }
};

Method denoised_mean(DenoiseMode mode, bool on_device) {
  MixedDenoisingOptions options;
  options.mode = mode;
  options.use_oidn = false;
  if (on_device)
    options.mix_mean = [](const MeanMixture& request, const auto&) { return mix_mean(test_device(), request); };
  return with_denoising(make_estimator(kMixture), options);
}

EstimatorResult picture_of(const test::Grouped& image, const Guides& guides, DenoiseMode mode, bool on_device,
                           bool std_error = true) {
  MethodSettings settings;
  settings.std_error = std_error;
  settings.guides = guides;
  return with_error(denoised_mean(mode, on_device).image({{}, image.view()}, settings));
}

void expect_same(const test::Grouped& image, const Guides& guides, DenoiseMode mode) {
  const EstimatorResult expected = picture_of(image, guides, mode, false),
                        found = picture_of(image, guides, mode, true);
  EXPECT_TRUE(agree(expected.estimate.data, found.estimate.data));
  EXPECT_TRUE(agree(expected.std_error.data, found.std_error.data));
  EXPECT_TRUE(agree(expected.bias.data, found.bias.data));
  EXPECT_EQ(expected.nonfinite_pixels, found.nonfinite_pixels);
  ASSERT_TRUE(found.interval && found.risks);
  EXPECT_NEAR(found.interval->below, expected.interval->below, 1e-3);
  EXPECT_NEAR(found.interval->above, expected.interval->above, 1e-3 * expected.interval->above);
  ASSERT_EQ(found.risks->images.size(), expected.risks->images.size());
  for (size_t i = 0; i < found.risks->images.size(); ++i) {
    EXPECT_EQ(found.risks->images[i].name, expected.risks->images[i].name);
    EXPECT_NEAR(found.risks->images[i].relmse, expected.risks->images[i].relmse,
                1e-3 * expected.risks->images[i].relmse);
  }
}

TEST(GpuMixedDenoising, IsThatOfTheProcessor) {
  const Pictures p;
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 12, 21, 1);
  expect_same(image, {&p.albedo, &p.normal, nullptr, nullptr, &p.position}, DenoiseMode::kAuto);
  expect_same(image, {}, DenoiseMode::kAuto);
}

TEST(GpuMixedDenoising, TakesManySamplesAndPixelsThatAreLeftOut) {
  const Pictures p;
  test::Grouped image = test::noisy_image(kWidth, kHeight, 8, 22, 1);
  image.counts.assign(size_t{kWidth} * kHeight, 96);  // NL-means beside the regression
  image.pixel(10, 11)[2] = std::numeric_limits<float>::infinity();
  expect_same(image, {&p.albedo, &p.normal}, DenoiseMode::kBalanced);
}

TEST(GpuMixedDenoising, TakesTwoGroups) {
  const Pictures p;
  test::Grouped image = test::noisy_image(kWidth, kHeight, 2, 23, 1);
  image.counts.assign(size_t{kWidth} * kHeight, 8);
  expect_same(image, {&p.albedo}, DenoiseMode::kAuto);
}

TEST(GpuMixedDenoising, IsTheSameEveryTime) {
  const Pictures p;
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 12, 24, 1);
  const Guides guides{&p.albedo, &p.normal};
  const EstimatorResult first = picture_of(image, guides, DenoiseMode::kAuto, true),
                        second = picture_of(image, guides, DenoiseMode::kAuto, true);
  EXPECT_EQ(first.estimate.data, second.estimate.data);
  EXPECT_EQ(first.std_error.data, second.std_error.data);
}

TEST(GpuMixedDenoising, TellsItsStages) {
  const Pictures p;
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 6, 26, 1);
  MethodSettings settings;
  settings.guides = {&p.albedo, &p.normal};
  const auto expected = denoised_mean(DenoiseMode::kAuto, false).stages({{}, image.view()}, settings),
             found = denoised_mean(DenoiseMode::kAuto, true).stages({{}, image.view()}, settings);
  ASSERT_EQ(found.size(), 4u);
  for (const auto& [name, stage] : expected) EXPECT_TRUE(agree(stage.data, found.at(name).data)) << name;
}

TEST(GpuMixedDenoising, MakesThePictureAlone) {
  const Pictures p;
  const test::Grouped image = test::noisy_image(kWidth, kHeight, 6, 25, 1);
  const EstimatorResult expected = picture_of(image, {&p.albedo}, DenoiseMode::kAuto, false, false),
                        found = picture_of(image, {&p.albedo}, DenoiseMode::kAuto, true, false);
  EXPECT_TRUE(agree(expected.estimate.data, found.estimate.data));
  EXPECT_TRUE(found.std_error.data.empty());
}

}  // namespace
}  // namespace covary::gpu
