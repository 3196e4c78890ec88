// SPDX-License-Identifier: Apache-2.0
// NL-means and regression on a device, against filters/.
#include <gtest/gtest.h>

#include <algorithm>

#include "denoising/denoising_parts.h"
#include "estimators/test_images.h"
#include "filters/nl_means.h"
#include "filters/regression.h"
#include "gpu/comparison.h"
#include "gpu/nl_means.h"
#include "gpu/regression.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;

constexpr int kWidth = 70, kHeight = 47;

/// A noisy image, its error, two features; and the same on the device.
struct Scene {
  Image image, std_error, other, albedo = Image(kWidth, kHeight, 3), normal = albedo;
  std::vector<unsigned char> valid;
  device::Buffer<float> d_image, d_error, d_other, d_albedo, d_normal;
  device::Buffer<unsigned char> d_valid;

  Scene() {
    const test::Grouped noisy = test::noisy_image(kWidth, kHeight, 8, 5, 1);
    const DenoisingParts parts = covary::parts_of_mean(noisy.view());
    image = parts.whole.image.estimate, std_error = parts.whole.image.std_error;
    other = parts.halves[0].image.estimate;
    valid = parts.valid;
    valid[3 * kWidth + 40] = valid[46 * kWidth + 69] = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) {
          albedo.pixel(x, y)[c] = 0.5f + 0.3f * test::noise(9, static_cast<uint64_t>(x / 9 + y / 7 * 100), c);
          normal.pixel(x, y)[c] = x > y ? 0.1f * static_cast<float>(c) : 0.01f * static_cast<float>(x);
        }
    device::Device& device = test_device();
    const auto up = [&](const Image& from) { return device.upload(std::span(std::as_const(from.data))); };
    d_image = up(image), d_error = up(std_error), d_other = up(other), d_albedo = up(albedo), d_normal = up(normal);
    d_valid = device.upload(std::span(std::as_const(valid)));
  }
};

Planes feature_planes(const std::vector<std::pair<const Image*, float>>& features) {
  Planes planes(kWidth, kHeight, 3 * static_cast<int>(features.size()), kNlMeansRadius, 0);
  for (size_t i = 0; i < features.size(); ++i)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c)
          planes.row(3 * static_cast<int>(i) + c, y)[x] = features[i].first->pixel(x, y)[c] / features[i].second;
  return planes;
}

/// Filtered with so many features and bandwidths on the device.
std::vector<std::vector<float>> filtered(const Scene& s, int n_features, std::vector<float> bandwidths, bool planted) {
  device::Device& device = test_device();
  NlMeansInput input{kWidth, kHeight, &s.d_image, &s.d_error, &s.d_valid, {}, bandwidths, planted};
  if (n_features > 0) input.features.push_back({&s.d_albedo, 0.07f});
  if (n_features > 1) input.features.push_back({&s.d_normal, 0.2f});
  const size_t values = s.image.data.size();
  const auto result = device.make<float>(bandwidths.size() * values);
  std::vector<Place> places;
  for (size_t i = 0; i < bandwidths.size(); ++i) places.push_back({&result, i * values});
  nl_means(device, input, places);
  std::vector<std::vector<float>> images(bandwidths.size(), std::vector<float>(values));
  for (size_t i = 0; i < images.size(); ++i) device.read(result, images[i], i * values);
  return images;
}

TEST(GpuNlMeans, IsThatOfTheProcessor) {
  const Scene s;
  for (const int n_features : {0, 1, 2})
    for (const std::vector<float>& bandwidths : {std::vector{0.5f}, std::vector{0.5f, 1.0f}}) {
      SCOPED_TRACE(n_features);
      std::vector<std::pair<const Image*, float>> features = {{&s.albedo, 0.07f}, {&s.normal, 0.2f}};
      features.resize(static_cast<size_t>(n_features));
      const Planes planes = n_features ? feature_planes(features) : Planes();
      NlMeansSteering steering{&s.image, &s.std_error, {}};
      for (const float bandwidth : bandwidths) steering.tasks.push_back({bandwidth, {&s.image}});
      const std::vector<Image> expected =
          covary::nl_means(std::span(&steering, 1), n_features ? &planes : nullptr, s.valid);
      const std::vector<std::vector<float>> found = filtered(s, n_features, bandwidths, false);
      for (size_t i = 0; i < found.size(); ++i) EXPECT_TRUE(agree(expected[i].data, found[i]));
    }
}

/// With the weights of the image.
TEST(GpuNlMeans, AveragesAnotherImage) {
  const Scene s;
  device::Device& device = test_device();
  const Planes planes = feature_planes({{&s.albedo, 0.07f}});
  const NlMeansSteering steering{&s.image, &s.std_error, {{0.5f, {&s.albedo}}, {1, {&s.albedo}}}};
  const std::vector<Image> expected = covary::nl_means({&steering, 1}, &planes, s.valid);
  const size_t values = s.image.data.size();
  const auto result = device.make<float>(2 * values);
  NlMeansInput input{kWidth, kHeight, &s.d_image, &s.d_error, &s.d_valid, {{&s.d_albedo, 0.07f}}, {0.5f}};
  input.source = &s.d_albedo;
  std::vector<float> found(values);
  const auto expect = [&](const Image& image, size_t first) {
    device.read(result, found, first);
    EXPECT_TRUE(agree(image.data, found)) << first;
  };
  nl_means(device, input, {{Place{&result}}});
  expect(expected[0], 0);
  input.bandwidths = {0.5f, 1};
  nl_means(device, input, {{Place{&result}, Place{&result, values}}});
  expect(expected[0], 0);
  expect(expected[1], values);
}

TEST(GpuNlMeans, IsTheSameEveryTime) {
  const Scene s;
  EXPECT_EQ(filtered(s, 2, {0.5f, 1}, false), filtered(s, 2, {0.5f, 1}, false));
}

TEST(GpuNlMeans, NoticesTooSmallPatches) {
  const Scene s;
  const std::vector<float> expected = filtered(s, 0, {0.5f}, false)[0];
  EXPECT_FALSE(agree(expected, filtered(s, 0, {0.5f}, true)[0]));
}

struct RegressionCase {
  bool coarse = false, with_position = true, planted_bug = false;
  size_t weights_at_once = size_t{1} << 25;
  bool fits_normal = false;  ///< with the weights of the image
};

std::vector<float> fitted(const Scene& s, const RegressionCase& choice) {
  device::Device& device = test_device();
  const FeatureBuffer features =
      features_of(device, {&s.d_albedo, &s.d_normal}, choice.with_position ? &s.d_other : nullptr);
  const auto result = device.make<float>(s.image.data.size());
  regressed(device,
            {kWidth,
             kHeight,
             &s.d_image,
             &s.d_error,
             &s.d_valid,
             &features,
             {&s.d_other},
             choice.coarse,
             choice.planted_bug,
             choice.weights_at_once,
             choice.fits_normal ? &s.d_normal : nullptr},
            result);
  return device.download(result);
}

std::vector<float> fitted_by_processor(const Scene& s, const RegressionCase& choice) {
  RegressionInput input{&s.image,   &s.std_error, {choice.fits_normal ? &s.normal : &s.image},
                        {&s.other}, nullptr,      choice.coarse};
  if (choice.with_position) input.position = &s.other;
  const std::vector<const Image*> features = {&s.albedo, &s.normal};
  return covary::regressed(input, features, s.valid)[0].data;
}

TEST(GpuRegression, IsThatOfTheProcessor) {
  const Scene s;
  for (const bool coarse : {false, true})
    for (const bool with_position : {false, true}) {
      const RegressionCase choice{coarse, with_position};
      SCOPED_TRACE(fmt::format("coarse {}, position {}", coarse, with_position));
      EXPECT_TRUE(agree(fitted_by_processor(s, choice), fitted(s, choice)));
    }
}

TEST(GpuRegression, WorksInBands) {
  const Scene s;
  const RegressionCase in_bands{false, true, false, size_t{441} * 24 * 5};  // five rows of windows at once
  EXPECT_TRUE(agree(fitted_by_processor(s, {}), fitted(s, in_bands)));
}

TEST(GpuRegression, FitsAnotherImage) {
  const Scene s;
  RegressionCase choice;
  choice.fits_normal = true;
  EXPECT_TRUE(agree(fitted_by_processor(s, choice), fitted(s, choice)));
}

TEST(GpuRegression, IsTheSameEveryTime) {
  const Scene s;
  EXPECT_EQ(fitted(s, {}), fitted(s, {}));
}

TEST(GpuRegression, NoticesTooLargeRidges) {
  const Scene s;
  EXPECT_FALSE(agree(fitted(s, {}), fitted(s, {false, true, true})));
}

}  // namespace
}  // namespace covary::gpu
