// SPDX-License-Identifier: Apache-2.0
// Features of several renders: means, halves, and what noise in them does to the predicted error.
#include "denoising/render_features.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"
#include "denoising/part_features.h"
#include "estimators/test_images.h"
#include "risk/error_interval.h"
#include "support/files.h"

namespace covary::render_features_test {
namespace {

constexpr float kOfDifferences = 0.003f;  // of 8 digits
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Image constant(std::initializer_list<float> pixels) {
  Image image(static_cast<int>(pixels.size()), 1, 3);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = *(pixels.begin() + i / 3);
  return image;
}

std::vector<float> values(const Image& image) {
  std::vector<float> firsts;
  for (size_t i = 0; i < image.data.size(); i += 3) firsts.push_back(image.data[i]);
  return firsts;
}

void expect_near(const std::vector<float>& found, const std::vector<float>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], kOfDifferences) << i;
}

TEST(RenderFeatures, AreMeansOfAllRendersAndOfEverySecond) {
  RenderFeatures features;
  features.add(feature::kAlbedo, "a", constant({0.1f, 0.4f, kNan, kNan}));
  features.add(feature::kAlbedo, "b", constant({0.2f, kNan, 0.5f, kNan}));
  features.add(feature::kAlbedo, "c", constant({0.6f, 0.8f, kNan, kNan}));
  const Features view = features.view();
  ASSERT_TRUE(view.differences);
  expect_near(values(*view.albedo), (std::vector<float>{0.3f, 0.6f, 0.5f, 0}));
  expect_near(values(feature_of_part(view, feature::kAlbedo, 1)), (std::vector<float>{0.35f, 0.6f, 0.5f, 0}));
  expect_near(values(feature_of_part(view, feature::kAlbedo, 2)), (std::vector<float>{0.2f, 0.6f, 0.5f, 0}));
}

TEST(RenderFeatures, AssignRendersWithoutOne) {
  RenderFeatures features;
  for (const float normal : {1.0f, 2.0f, 3.0f, 4.0f}) {
    features.add(feature::kAlbedo, "a", normal == 2 ? std::nullopt : std::optional(constant({normal / 8})));
    features.add(feature::kNormal, "a", constant({normal}));
  }
  expect_near(values(feature_of_part(features.view(), feature::kAlbedo, 1)), std::vector<float>{0.25f});
  expect_near(values(feature_of_part(features.view(), feature::kAlbedo, 2)), std::vector<float>{0.5f});
  expect_near(values(feature_of_part(features.view(), feature::kNormal, 2)), std::vector<float>{3});
}

TEST(RenderFeatures, HaveNoHalvesIfTheyAreAlike) {
  const auto made = [](bool are_of_groups, float difference) {
    RenderFeatures features(are_of_groups);
    for (const float sign : {1.0f, -1.0f}) features.add(feature::kAlbedo, "a", constant({0.5f + sign * difference}));
    features.add(feature::kNormal, "a", constant({1})), features.add(feature::kNormal, "b", constant({1}));
    return features;
  };
  EXPECT_FALSE(made(true, 0).view().differences);
  EXPECT_FALSE(made(false, 0.1f).view().differences);
  RenderFeatures noisy = made(true, 0.1f);
  ASSERT_TRUE(noisy.view().differences);
  EXPECT_NEAR(feature_of_part(noisy.view(), feature::kAlbedo, 2).data[0], 0.4f, kOfDifferences);
  EXPECT_EQ(feature_of_part(noisy.view(), feature::kNormal, 2).data[0], 1);
}

TEST(RenderFeatures, LimitAlbedos) {
  RenderFeatures features;
  features.add(feature::kAlbedo, "a", constant({155, -1, kNan, 0.5f}));
  features.add(feature::kAlbedo, "b", constant({0.5f, 0.5f, 0.5f, 0.5f}));
  features.add(feature::kNormal, "a", constant({-1, 2, 1, 1}));
  EXPECT_EQ(values(*features.view().albedo), (std::vector<float>{0.75f, 0.25f, 0.5f, 0.5f}));
  EXPECT_EQ(values(*features.view().normal), (std::vector<float>{-1, 2, 1, 1}));
}

TEST(RenderFeatures, HaveNoNormalWithoutAnAlbedo) {
  RenderFeatures features;
  features.add(feature::kNormal, "a", constant({1}));
  EXPECT_FALSE(features.view().normal);
}

TEST(RenderFeatures, RefuseImagesOfOtherSizes) {
  RenderFeatures features;
  features.add(feature::kAlbedo, "a.exr", constant({1}));
  EXPECT_EQ(test_support::message_of([&] {
              features.add(feature::kAlbedo, "b.exr", constant({1, 2}));
            }),
            "'b.exr' has 2 x 1 pixels, others have 1 x 1");
  Image grey(1, 1, 1), cut(1, 2, 3);
  cut.data.pop_back();
  EXPECT_EQ(test_support::message_of([&] { features.add(feature::kAlbedo, "b.exr", grey); }),
            "'b.exr' has 1 x 1 pixels of 1 channels and 1 values; expected 3 channels and as many values");
  EXPECT_EQ(test_support::message_of([&] { features.add(feature::kNormal, "b.exr", cut); }),
            "'b.exr' has 1 x 2 pixels of 3 channels and 5 values; expected 3 channels and as many values");
}

/// A checkered floor whose albedo and light have the same noise, as from few samples of a fine texture.
struct NoisyFloor {
  static constexpr int kSize = 96, kGroups = 4;
  Image truth = Image(kSize, kSize, 3);
  test::Grouped samples = test::noisy_image(kSize, kSize, kGroups, 5, 1);
  RenderFeatures features;

  NoisyFloor() {
    std::vector<Image> albedos(kGroups, Image(kSize, kSize, 3));
    const auto noise = [](int x, int y, int g) {
      return test::noise(7, static_cast<uint64_t>((y * kSize + x) * 64 + g), 0);
    };
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)
        for (int g = 0; g < kGroups; ++g)
          for (int c = 0; c < 3; ++c) {
            truth.pixel(x, y)[c] = 0.5f;
            albedos[g].pixel(x, y)[c] = 0.5f + 0.3f * noise(x, y, g);
            samples.pixel(x, y)[3 * g + c] = albedos[g].pixel(x, y)[c];
          }
    samples.counts.assign(size_t{kSize} * kSize, 16);
    for (Image& albedo : albedos) features.add(feature::kAlbedo, "a", albedo);
  }
  /// Predicted over true relative error.
  double predicted_over_true(const Features& used) const {
    MixedDenoisingOptions options;
    options.mode = DenoiseMode::kAuto, options.use_oidn = false;
    MethodSettings settings;
    settings.std_error = true, settings.features = used;
    const EstimatorResult found =
        with_error(with_denoising(make_estimator(kMixture), options).image({{}, samples.view()}, settings));
    double predicted = 0, error = 0;
    for (size_t i = 0; i < truth.data.size(); ++i) {
      predicted += std::pow(found.std_error.data[i], 2);
      error += std::pow(found.estimate.data[i] - truth.data[i], 2);
    }
    return predicted / error;
  }
};

TEST(RenderFeatures, OfHalvesKeepNoiseFromPassingForDetail) {
  NoisyFloor floor;
  ASSERT_TRUE(floor.features.view().differences);
  Features mean = floor.features.view();
  mean.differences = nullptr;
  const double of_mean = floor.predicted_over_true(mean), of_halves = floor.predicted_over_true(floor.features.view());
  EXPECT_LT(of_mean, 0.6);
  EXPECT_GT(of_halves, 0.75);
  EXPECT_LT(of_halves, 2.2);
}

}  // namespace
}  // namespace covary::render_features_test
