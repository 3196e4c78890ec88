// SPDX-License-Identifier: Apache-2.0
// Layers add up to the picture and are denoised with its weights.
#include "denoising/layers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "denoising/mixed_denoising.h"
#include "denoising/weighed_candidate.h"
#include "estimators/test_images.h"

namespace covary {
namespace {

constexpr int kWidth = 48, kHeight = 40, kGroups = 8;

/// Groups of noisy samples around a brightness that depends on the column; part of it is direct light.
struct Scene {
  std::vector<float> all, direct, indirect;
  Scene() {
    uint64_t n = 0;
    const auto uniform = [&] { return test::noise(1, 0, n++) + 0.5f; };
    for (int i = 0; i < kWidth * kHeight * kGroups * 3; ++i) {
      const int x = i / (3 * kGroups) % kWidth;
      direct.push_back(x < kWidth / 2 ? 0.5f + uniform() : 0.0f);
      indirect.push_back(uniform() < 2e-4f ? 90.0f : 0.2f * uniform());
      all.push_back(direct.back() + indirect.back());
    }
  }
  GroupedImage view(const std::vector<float>& data) const { return {kWidth, kHeight, kGroups, data.data()}; }
  std::vector<Layer> layers() const { return {{"Direct", view(direct)}, {"Indirect", view(indirect)}}; }
};

void expect_sum(const Image& image, const std::vector<Image>& layers) {
  ASSERT_EQ(layers.size(), 2u);
  for (size_t i = 0; i < image.data.size(); ++i)
    ASSERT_NEAR(layers[0].data[i] + layers[1].data[i], image.data[i], 1e-5f * std::max(1.0f, std::abs(image.data[i])));
}

double deviation(const Image& image, int first_x, int last_x) {
  double sum = 0, squares = 0, n = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = first_x; x < last_x; ++x) {
      const double v = image.pixel(x, y)[1];
      sum += v, squares += v * v, n += 1;
    }
  return std::sqrt(squares / n - sum / n * (sum / n));
}

/// A network that darkens, dim layers more than bright ones.
CandidateMaker planted_network() {
  CandidateMaker maker;
  maker.names = {"planted"};
  const auto dimmed = [](const Image& image) {
    Image result = image;
    for (float& v : result.data) v = 0.7f * v / (0.1f + v) * v;
    return result;
  };
  maker.make = one_by_one([dimmed](const CandidateInput& in) { return std::vector{dimmed(*in.estimate)}; });
  maker.make_layers = [dimmed](const CandidateInput&, std::span<const Image> layers) {
    std::vector<Image> images;
    for (const Image& layer : layers) images.push_back(dimmed(layer));
    return std::vector<std::vector<Image>>{images};
  };
  return maker;
}

TEST(Layers, OfFiltersAddUpWithoutHelp) {
  const Scene scene;
  const DenoisingParts parts = parts_of_mean(scene.view(scene.all));
  const MixedDenoising mixed = denoise_by_mixture(parts, {filtered_candidates({}, CandidateBase::kMean)},
                                                  DenoiseMode::kAuto, false, scene.layers());
  expect_sum(mixed.result.estimate, mixed.result.layers);
  for (int half : {0, 1}) {
    const double before = deviation(
        mean_image(moments(scene.view(half ? scene.indirect : scene.direct), parts.valid, 0, 0.0f)), 2, kWidth / 2 - 2);
    EXPECT_LT(deviation(mixed.result.layers[half], 2, kWidth / 2 - 2), 0.7 * before) << half;
  }
  for (int y = 0; y < kHeight; ++y) EXPECT_EQ(mixed.result.layers[0].pixel(kWidth - 1, y)[0], 0) << "no direct light";
}

TEST(Layers, OfANetworkAddUp) {
  const Scene scene;
  const MixedDenoising mixed = denoise_by_mixture(parts_of_mean(scene.view(scene.all)), {planted_network()},
                                                  DenoiseMode::kAuto, false, scene.layers());
  expect_sum(mixed.result.estimate, mixed.result.layers);
  for (const Image& layer : mixed.result.layers)
    for (const float v : layer.data) ASSERT_GE(v, 0);
}

/// Filters with given weights and shares are linear, so that layers add up without help.
TEST(Layers, OfACandidateThatConsistsOfOthersAddUpWithoutHelp) {
  const Scene scene;
  Image albedo(kWidth, kHeight, 3);
  std::fill(albedo.data.begin(), albedo.data.end(), 0.5f);
  Features features;
  features.albedo = &albedo;
  std::vector<CandidateMaker> makers = {filtered_candidates(features, CandidateBase::kMean, FilterKinds::kAll)};
  add_weighing_maker(features, makers);
  ASSERT_EQ(makers.size(), 2u);
  std::vector<Layer> layers = scene.layers();
  for (Layer& layer : layers) layer.sum = Layer::kNoSum;  // they are not made to add up
  const DenoisingParts parts = parts_of_mean(scene.view(scene.all));
  const MixedDenoising mixed = denoise_by_mixture(parts, makers, DenoiseMode::kAuto, false, layers);
  double weight = 0;
  for (const float w : mixed.weights.back().data) weight += w;
  EXPECT_GT(weight, 0.01 * kWidth * kHeight) << "the candidate has a part";
  double missing = 0, all = 0;
  for (size_t i = 0; i < mixed.result.estimate.data.size(); ++i) {
    const float sum = mixed.result.layers[0].data[i] + mixed.result.layers[1].data[i];
    missing += std::abs(sum - mixed.result.estimate.data[i]), all += mixed.result.estimate.data[i];
  }
  EXPECT_LT(missing, 0.02 * all);
}

TEST(Layers, OfAPictureWithoutOthersThanBlackOnesShareIt) {
  Image picture(1, 1, 3);
  picture.data = {1, -2, 0};
  std::vector<Image> layers(2, Image(1, 1, 3));
  layers[0].data[1] = -1, layers[1].data[1] = -3;
  std::vector<Image*> all;
  for (Image& layer : layers) all.push_back(&layer);
  add_up(picture, all);
  EXPECT_EQ(layers[0].data, (std::vector<float>{0.5f, -0.5f, 0}));
  EXPECT_EQ(layers[1].data, (std::vector<float>{0.5f, -1.5f, 0}));
}

TEST(Layers, KeepToPixelsThatAreNotFinite) {
  Scene scene;
  scene.all[0] = scene.indirect[0] = NAN;
  const MixedDenoising mixed =
      denoise_by_mixture(parts_of_mean(scene.view(scene.all)), {filtered_candidates({}, CandidateBase::kMean)},
                         DenoiseMode::kAuto, false, scene.layers());
  expect_sum(mixed.result.estimate, mixed.result.layers);
}

}  // namespace
}  // namespace covary
