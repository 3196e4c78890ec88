// SPDX-License-Identifier: Apache-2.0
// Frames with a history on a device, as a whole, against denoising/frame_history.h.
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"
#include "estimators/test_images.h"
#include "filters/residual_correction.h"
#include "gpu/comparison.h"
#include "gpu/mixed_denoising.h"
#include "gpu/target.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;

constexpr int kWidth = 60, kHeight = 44;

/// Samples of a frame, a pair as well, its features, and the history of the frame before.
struct Frame {
  test::Grouped mean = test::noisy_image(kWidth, kHeight, 6, 61, 1), crn = test::crn_image(kWidth, kHeight, 8, 62),
                independent = test::independent_image(kWidth, kHeight, 8, 63);
  Image albedo = Image(kWidth, kHeight, 3), normal = albedo;
  std::shared_ptr<History> before = std::make_shared<History>();
  MethodSettings settings;

  Frame() {
    History& h = *before;
    h.image = h.samples[0] = h.samples[1] = Image(kWidth, kHeight, 3);
    h.squared_error = Image(kWidth, kHeight, 1);
    h.features = Image(kWidth, kHeight, kHistoryFeatures), h.slopes = Image(kWidth, kHeight, 3 * kHistoryFeatures);
    h.known.assign(size_t{kWidth} * kHeight, 1);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto pixel = static_cast<uint64_t>(y * kWidth + x);
        h.known[pixel] = pixel % 13 != 0;
        *h.squared_error.pixel(x, y) = pixel % 5 == 0 ? 0.02f : 0.001f;
        for (int c = 0; c < 3; ++c) {
          albedo.pixel(x, y)[c] = 0.4f + 0.3f * test::noise(4, static_cast<uint64_t>(x / 8 + y / 8 * 100), c);
          normal.pixel(x, y)[c] = x + y > 45 ? 0.3f : -0.6f;
          const float light = static_cast<float>(test::expected(x, y, c)) * (x > 40 ? 1.5f : 0.9f);
          h.image.pixel(x, y)[c] = light * (1 + 0.02f * test::noise(64, pixel, c));
          for (const size_t half : {0, 1})
            h.samples[half].pixel(x, y)[c] = light * (1 + 0.4f * test::noise(65 + half, pixel, c));
          h.features.pixel(x, y)[c] = albedo.pixel(x, y)[c] + 0.02f,
                              h.features.pixel(x, y)[3 + c] = normal.pixel(x, y)[c];
          h.slopes.pixel(x, y)[c] = 0.5f;
        }
      }
    settings.std_error = true;
    settings.crn_samples = 64;
    settings.features = {&albedo, &normal};
  }
};

/// Images, or both empty.
testing::AssertionResult same(const Image& expected, const Image& found) {
  if (expected.data.empty() && found.data.empty()) return testing::AssertionSuccess();
  return agree(expected.data, found.data);
}

void expect_same(const MethodImage& expected, const MethodImage& found) {
  EXPECT_TRUE(same(expected.estimate, found.estimate));
  EXPECT_TRUE(same(expected.std_error, found.std_error));
  EXPECT_TRUE(same(expected.bias, found.bias));
  EXPECT_EQ(found.risk_rows.size(), expected.risk_rows.size());
  ASSERT_EQ(found.kept_samples.size(), expected.kept_samples.size());
  for (size_t i = 0; i < found.kept_samples.size(); ++i)
    EXPECT_TRUE(same(expected.kept_samples[i], found.kept_samples[i])) << i;
}

MethodImage picture_of(const Frame& frame, bool of_pair, const MixingHistory& history, bool on_device) {
  MixedDenoisingOptions options;
  options.mode = DenoiseMode::kAuto;
  options.use_oidn = false;
  options.history = history;
  if (on_device) {
    options.mix_mean = [](const MeanMixture& request, const auto&) { return mix_mean(test_device(), request); };
    options.mix_pair = [](const PairMixture& request, const auto&) { return mix_pair(test_device(), request); };
  }
  const Method method = with_denoising(make_estimator(of_pair ? kIicv : kMixture), options);
  return of_pair ? method.image({frame.crn.view(), frame.independent.view()}, frame.settings)
                 : method.image({{}, frame.mean.view()}, frame.settings);
}

TEST(GpuFrameHistory, IsThatOfTheProcessor) {
  Frame frame;
  for (const bool of_pair : {false, true})
    for (const bool is_first : {false, true}) {
      SCOPED_TRACE(of_pair);
      const MixingHistory history{is_first ? nullptr : frame.before, true};
      const MethodImage expected = picture_of(frame, of_pair, history, false),
                        found = picture_of(frame, of_pair, history, true);
      expect_same(expected, found);
      EXPECT_EQ(found.note, "");
      EXPECT_FALSE(found.kept_samples[2].data.empty());
      const MethodImage alone = picture_of(frame, of_pair, {}, true);
      EXPECT_EQ(static_cast<bool>(agree(alone.estimate.data, found.estimate.data)), is_first);
    }
  frame.settings.std_error = false;
  expect_same(picture_of(frame, false, {frame.before, false}, false),
              picture_of(frame, false, {frame.before, false}, true));
}

/// Layers are made with the weights that the history leaves.
TEST(GpuFrameHistory, TakesLayers) {
  Frame frame;
  test::Grouped half = frame.mean;
  for (float& v : half.data) v *= 0.5f;
  const std::vector<Layer> layers = {{"Direct", half.view(), Layer::kNoSum}};
  frame.settings.layers = layers;
  const MethodImage expected = picture_of(frame, false, {frame.before, false}, false),
                    found = picture_of(frame, false, {frame.before, false}, true);
  ASSERT_EQ(found.layers.size(), 1u);
  EXPECT_TRUE(agree(expected.layers[0].data, found.layers[0].data));
}

Image dimmed(const Image& image) {
  Image result = image;
  for (float& v : result.data) v = 0.5f * v + 0.4f;
  return result;
}

/// Makes what a network's candidates are, of any samples.
CandidateMaker planted_network() {
  CandidateMaker maker = neural_candidates({}, {}, CandidateBase::kMean, std::make_shared<const NetworkImages>());
  maker.make = one_by_one([](const CandidateInput& in) {
    std::vector<Image> images(3, dimmed(*in.estimate));
    for (const size_t i : {0, 1}) add_residual(*in.moments, kNetworkResiduals[i], *in.valid, images[i + 1]);
    return images;
  });
  return maker;
}

/// A network denoises the samples of frames before together with the new ones.
TEST(GpuFrameHistory, AccumulatesSamplesForANetwork) {
  const Frame frame;
  const Features& features = frame.settings.features;
  MeanMixture request{frame.mean.view(), features, FilterKinds::kNlMeans, {1, 1, false}, {}, true, true};
  int runs = 0;
  request.network = [&](const std::array<Image, 3>& noisy) {
    return NetworkImages{{dimmed(noisy[0]), dimmed(noisy[1]), dimmed(noisy[2])}, runs += 3};
  };
  request.history = {frame.before, true};
  DenoisingParts parts = covary::parts_of_mean(frame.mean.view());
  parts.features = features;
  const std::vector<CandidateMaker> makers = {
      planted_network(), filtered_candidates(features, CandidateBase::kMean, FilterKinds::kNlMeans)};
  const MixedDenoising expected =
      denoise_by_mixture(std::move(parts), makers, DenoiseMode::kAuto, true, {}, request.history);
  const MixedDenoising found = mix_mean(test_device(), request);
  expect_same(expected.result, found.result);
  EXPECT_FALSE(found.result.kept_samples[0].data.empty());
  for (size_t p = 0; p < expected.weights.size(); ++p)
    EXPECT_TRUE(agree(expected.weights[p].data, found.weights[p].data)) << p;
  EXPECT_EQ(found.result.network_runs, 6) << "of the frame alone, and of all samples";
}

/// It is not made in bands.
TEST(GpuFrameHistory, NeedsMemoryForTheWholeFrame) {
  const Frame frame;
  MeanMixture request{frame.mean.view(), {}, FilterKinds::kNlMeans, {1, 1, false}, {}, false, false};
  request.history.keep_samples = true;
  EXPECT_THROW(mix_mean(test_device(), request, {"", 40, {}}), device::Failure);
}

}  // namespace
}  // namespace covary::gpu
