// SPDX-License-Identifier: Apache-2.0
// Layers of a picture on a device, against denoising/layers.h.
#include "gpu/layers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "denoising/layers.h"
#include "denoising/limited_groups.h"
#include "denoising/mixed_denoising.h"
#include "denoising/weighed_candidate.h"
#include "estimators/test_images.h"
#include "gpu/comparison.h"
#include "gpu/mixed_denoising.h"
#include "gpu/weighing.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;

/// A picture with fireflies and a pixel that is left out: two layers that are parts of it, in unequal shares, and
/// alpha.
struct LayeredPicture {
  int width, height;
  test::Grouped all, direct, indirect, alpha;
  Image albedo, normal;
  std::vector<Layer> layers;

  LayeredPicture(int w, int h, int groups)
      : width(w), height(h), all(test::noisy_image(w, h, groups, 41, 1)), albedo(w, h, 3), normal(w, h, 3) {
    for (int x = 3; x < w; x += 13) all.pixel(x, h / 2)[3 * (x % groups)] *= 1000;
    all.pixel(7, 5)[0] = std::numeric_limits<float>::quiet_NaN();
    direct = indirect = alpha = all;
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x)
        for (int i = 0; i < 3 * groups; ++i) {
          const float share = x > w / 2 ? 0.8f : 0.3f + 0.2f * test::noise(5, static_cast<uint64_t>(y * w + x), i / 3);
          direct.pixel(x, y)[i] = share * all.pixel(x, y)[i];
          indirect.pixel(x, y)[i] = all.pixel(x, y)[i] - direct.pixel(x, y)[i];
          alpha.pixel(x, y)[i] = x + i / 3 < w / 3 ? 0.0f : 1.0f;
          albedo.pixel(x, y)[i % 3] = 0.4f + 0.3f * test::noise(4, static_cast<uint64_t>(x / 8 + y / 8 * 100), i % 3);
          normal.pixel(x, y)[i % 3] = x + y % 50 > 30 ? 0.3f : -0.6f;
        }
    layers = {{"Direct", direct.view(), 0}, {"Indirect", indirect.view(), 0}, {"A", alpha.view(), Layer::kNoSum}};
  }
  Features features() const { return {&albedo, &normal}; }
};

/// Means of a layer against those of the processor's groups.
void expect_means(bool is_part, bool planted_bug) {
  const LayeredPicture p(45, 37, 7);
  const Groups picture = upload(test_device(), p.all.view());
  const std::vector<unsigned char> valid = test_device().download(picture.valid);
  const Limits limits = limits_of(test_device(), picture, {});
  const LayerBuffers found =
      upload_layer(test_device(), p.direct.view(), picture, is_part ? &limits : nullptr, planted_bug);
  const LimitedGroups limited(p.all.view(), valid);
  std::vector<float> mean(3 * valid.size()), noisy(3 * valid.size());
  for (size_t i = 0; i < mean.size(); ++i) {
    if (!valid[i / 3]) continue;
    for (int t = 0; t < 7; ++t) {
      const size_t k = (i / 3 * 7 + t) * 3;
      const float scale = is_part && p.all.view().data[k] > 0 ? limited.view().data[k] / p.all.view().data[k] : 1;
      mean[i] += p.direct.view().data[k + i % 3] / 7;
      noisy[i] += scale * p.direct.view().data[k + i % 3] / 7;
    }
  }
  EXPECT_TRUE(agree(mean, test_device().download(found.mean)));
  EXPECT_EQ(static_cast<bool>(agree(noisy, test_device().download(found.noisy))), !planted_bug);
}

TEST(GpuLayers, HaveTheMeansOfTheProcessor) {
  expect_means(true, false);
  expect_means(false, false);
}

TEST(GpuLayers, NoticeGroupsThatAreNotLimited) { expect_means(true, true); }

MixedDenoising on_device(const LayeredPicture& p, const Features& features, const Trial& trial = {}) {
  MeanMixture request{p.all.view(), features, FilterKinds::kAll, {1, 1, false}, {}, false, true, p.layers};
  return mix_mean(test_device(), request, trial);
}

void expect_layers(const MixedDenoising& expected, const MixedDenoising& found) {
  ASSERT_EQ(found.result.layers.size(), expected.result.layers.size());
  for (size_t k = 0; k < found.result.layers.size(); ++k)
    EXPECT_TRUE(agree(expected.result.layers[k].data, found.result.layers[k].data)) << k;
}

/// Without auxiliary images there are two candidates; with them four, and one more that consists of these.
TEST(GpuLayers, AreThoseOfTheProcessor) {
  LayeredPicture p(48, 40, 8);
  for (const bool has_features : {true, false})
    for (const bool add_up : {true, false}) {
      SCOPED_TRACE(has_features);
      const Features features = has_features ? p.features() : Features{};
      for (Layer& layer : p.layers)
        if (!add_up) layer.sum = Layer::kNoSum;
      std::vector<CandidateMaker> makers = {filtered_candidates(features, CandidateBase::kMean, FilterKinds::kAll)};
      add_weighing_maker(features, makers);
      DenoisingParts parts = covary::parts_of_mean(p.all.view());
      parts.features = features;
      const MixedDenoising expected = denoise_by_mixture(std::move(parts), makers, DenoiseMode::kAuto, false, p.layers);
      const MixedDenoising found = on_device(p, features);
      ASSERT_EQ(found.names, expected.names);
      EXPECT_TRUE(agree(expected.result.estimate.data, found.result.estimate.data));
      expect_layers(expected, found);
    }
}

TEST(GpuLayers, AddUpToThePicture) {
  const LayeredPicture p(48, 40, 8);
  const MixedDenoising found = on_device(p, p.features());
  const std::vector<float>& picture = found.result.estimate.data;
  for (size_t i = 0; i < picture.size(); ++i) {
    const float sum = found.result.layers[0].data[i] + found.result.layers[1].data[i];
    ASSERT_NEAR(sum, picture[i], 1e-5f * std::max(1.0f, std::abs(picture[i]))) << i;
  }
}

Image dimmed(const Image& image) {
  Image result = image;
  for (float& v : result.data) v = 0.7f * v / (0.1f + std::abs(v)) * v + 0.1f;
  return result;
}

/// A network's images of the layers go up and are mixed; once each, in bands, too.
TEST(GpuLayers, TakeThoseOfANetwork) {
  const LayeredPicture p(12, 470, 6);
  const Features features = p.features();
  const auto network = [](const std::array<Image, 3>& noisy) {
    return NetworkImages{{dimmed(noisy[0]), dimmed(noisy[1]), dimmed(noisy[2])}, 3};
  };
  MeanMixture request{p.all.view(), features, FilterKinds::kNlMeans, {1, 1, false}, network, false, true, p.layers};
  int calls = 0;
  request.network_of_layers = [&](std::vector<Image> layers) {
    for (Image& layer : layers) layer = dimmed(layer);
    return NetworkLayers{std::move(layers), 6 + calls++};
  };
  DenoisingParts parts = covary::parts_of_mean(p.all.view());
  const auto made = std::make_shared<const NetworkImages>(
      network({parts.whole.limited->estimate, parts.halves[0].limited->estimate, parts.halves[1].limited->estimate}));
  std::vector<CandidateMaker> makers = {neural_candidates({}, {}, CandidateBase::kMean, made),
                                        filtered_candidates(features, CandidateBase::kMean, FilterKinds::kNlMeans)};
  makers[0].make_layers = [](const CandidateInput&, std::span<const Image> layers) {
    std::vector<Image> images;
    for (const Image& layer : layers) images.push_back(dimmed(layer));
    return std::vector(3, images);
  };
  parts.features = features;
  const MixedDenoising expected = denoise_by_mixture(std::move(parts), makers, DenoiseMode::kAuto, false, p.layers);
  const MixedDenoising found = mix_mean(test_device(), request);
  expect_layers(expected, found);
  EXPECT_EQ(found.result.network_runs, 6);
  calls = 0;
  expect_layers(expected, mix_mean(test_device(), request, {"", 340, {}}));
  EXPECT_EQ(calls, 1);
}

TEST(GpuLayers, WorkInBands) {
  const LayeredPicture p(12, 470, 6);
  expect_layers(on_device(p, p.features()), on_device(p, p.features(), {"", 440, {}}));
}

/// The kernel of weights beside those of the candidate that consists of the others.
TEST(GpuLayers, NoticeWrongShares) {
  const std::vector<std::string> names = {"regression", "sharp", "smooth", "demodulated"};
  const Weighing weighing(test_device(), *WeighingNetwork::find(names));
  const Image mean(20, 14, 3);
  std::vector<float> candidates(5 * mean.data.size()), weights(5 * mean.data.size() / 3, 0.2f);
  for (size_t i = 0; i < candidates.size(); ++i) candidates[i] = 1 + 0.1f * std::sin(0.37f * static_cast<float>(i));
  const Buffer<float> images = test_device().upload(std::span(std::as_const(candidates))),
                      zero = test_device().upload(std::span(mean.data)),
                      uploaded = test_device().upload(std::span(std::as_const(weights)));
  WeighingBuffers in{20, 14, &zero, &images, &zero, {}};
  const WeighingCells cells = weighing.add_weighed(in);
  const std::vector<float> right = test_device().download(weighing.share_weight(cells, in, uploaded));
  in.planted_bug = true;
  EXPECT_FALSE(agree(right, test_device().download(weighing.share_weight(cells, in, uploaded))));
}

}  // namespace
}  // namespace covary::gpu
