// SPDX-License-Identifier: Apache-2.0
// Histories on a device, against denoising/history.h.
#include "gpu/history.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "denoising/denoising_parts.h"
#include "estimators/test_images.h"
#include "gpu/comparison.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;
using test_support::values_of;

constexpr int kWidth = 61, kHeight = 43;

/// The picture times `factor`, with noise.
Image picture(float factor, float noise, uint64_t seed) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] = static_cast<float>(test::expected(x, y, c)) *
                               (factor + noise * test::noise(seed, static_cast<uint64_t>(y * kWidth + x), c));
  return image;
}

/// A frame's mixture, and a history that is darker, wrong on the right, unknown in places and resampled in others.
struct Scene {
  test::Grouped samples = test::noisy_image(kWidth, kHeight, 8, 51, 1);
  DenoisingParts parts = covary::parts_of_mean(samples.view());
  Image guide = picture(1, 0.05f, 1), counts = Image(kWidth, kHeight, 1), std_error = picture(0.05f, 0.04f, 2);
  Mixture mixture{picture(1, 0.1f, 3), {picture(1, 0.15f, 4), picture(1, 0.15f, 5)}, {}};
  Mixture accumulated{picture(1, 0.3f, 6), {picture(1, 0.4f, 7), picture(1, 0.4f, 8)}, {}};  // beyond the interval
  History history{picture(0.8f, 0.02f, 9),
                  Image(kWidth, kHeight, 1),
                  std::vector<unsigned char>(size_t{kWidth} * kHeight, 1),
                  {picture(0.8f, 0.3f, 10), picture(0.8f, 0.3f, 11)}};

  Scene() {
    parts.valid[7 * kWidth + 30] = 0;
    for (int i = 0; i < kWidth * kHeight; ++i) {
      counts.data[i] = 0.5f + test::noise(12, static_cast<uint64_t>(i), 0) * 0.4f;
      history.squared_error.data[i] = i % 7 == 0 ? 0.01f : 0.0f;
      history.known[i] = i % 11 != 0;
      if (i % kWidth < 45) continue;
      for (int c = 0; c < 3; ++c) history.image.data[3 * i + c] *= 2;
    }
    mixture.weights = {picture(0.3f, 0, 0), picture(0.3f, 0, 0)};
    for (Image& weights : mixture.weights) {
      weights = Image(kWidth, kHeight, 1);
      for (float& w : weights.data) w = 0.4f;
    }
  }
  HistoryInput input(const Image& common, bool is_mean) const {
    HistoryInput in{
        {&parts.halves[0].independent, &parts.halves[1].independent}, &std_error, &guide, &parts.valid, {}, &common};
    if (is_mean) in.counts = {&counts, &counts};
    return in;
  }
};

Buffer<float> up(const std::vector<float>& values) { return test_device().upload(std::span(values)); }

/// The scene on the device.
struct Uploaded {
  const Scene& scene;
  std::array<Buffer<float>, 2> independent;
  Buffer<float> guide, counts;
  Buffer<unsigned char> valid;
  FrameHistory history;

  explicit Uploaded(const Scene& s, bool is_mean = true, const std::string& planted_bug = "")
      : scene(s),
        independent{up(values_of(s.parts.halves[0].independent.mean)),
                    up(values_of(s.parts.halves[1].independent.mean))},
        guide(up(s.guide.data)),
        counts(up(s.counts.data)),
        valid(test_device().upload(std::span(s.parts.valid))),
        history(test_device(), s.history, s.std_error, frame(is_mean, planted_bug)) {}

  FrameBuffers frame(bool is_mean, const std::string& planted_bug) const {
    FrameBuffers in{kWidth, kHeight, {&independent[0], &independent[1]}, {}, &guide, &valid, planted_bug};
    if (is_mean) in.counts = {&counts, &counts};
    return in;
  }
  /// R'_A and R'_B.
  std::array<std::vector<float>, 2> samples() const {
    const DenoisingParts& parts = scene.parts;
    const Buffer<float> mean = up(parts.whole.image.estimate.data), a = up(parts.halves[0].image.estimate.data),
                        b = up(parts.halves[1].image.estimate.data);
    const std::array<Buffer<float>, 2> made = history.add_samples(mean, {&a, &b});
    return {test_device().download(made[0]), test_device().download(made[1])};
  }
  /// The picture, its halves and the weights of the first candidate.
  std::array<std::vector<float>, 4> mixed(bool accumulates) const {
    MixedBuffers frame = uploaded(scene.mixture);
    std::vector<float> weights = scene.mixture.weights[0].data;
    weights.insert(weights.end(), scene.mixture.weights[1].data.begin(), scene.mixture.weights[1].data.end());
    frame.weights = up(weights);
    const MixedBuffers accumulated = uploaded(scene.accumulated);
    history.add_history(accumulates ? &accumulated : nullptr, 2, frame);
    device::Device& d = test_device();
    return {d.download(frame.image), d.download(frame.halves[0]), d.download(frame.halves[1]),
            d.download(frame.weights)};
  }
  static MixedBuffers uploaded(const Mixture& mixture) {
    return {up(mixture.image.data), {}, {up(mixture.halves[0].data), up(mixture.halves[1].data)}};
  }
};

TEST(GpuHistory, IsMixedInAsByTheProcessor) {
  const Scene s;
  for (const bool is_mean : {true, false})
    for (const bool accumulates : {true, false}) {
      SCOPED_TRACE(is_mean);
      const Image common = counts_of(s.history, s.guide);
      Mixture expected = s.mixture;
      add_history(s.history, s.input(common, is_mean), accumulates ? &s.accumulated : nullptr, expected);
      const std::array<std::vector<float>, 4> found = Uploaded(s, is_mean).mixed(accumulates);
      EXPECT_TRUE(agree(expected.image.data, found[0]));
      EXPECT_TRUE(agree(expected.halves[0].data, found[1]));
      EXPECT_TRUE(agree(expected.halves[1].data, found[2]));
      std::vector<float> weights = expected.weights[0].data;
      weights.insert(weights.end(), expected.weights[1].data.begin(), expected.weights[1].data.end());
      EXPECT_TRUE(agree(weights, found[3]));
    }
}

TEST(GpuHistory, AddsSamplesAsTheProcessorDoes) {
  const Scene s;
  const Image common = counts_of(s.history, s.guide);
  Image mean = s.parts.whole.image.estimate;
  std::array<Image, 2> halves = {s.parts.halves[0].image.estimate, s.parts.halves[1].image.estimate};
  add_samples(s.history, s.input(common, true), mean, halves);
  const std::array<std::vector<float>, 2> found = Uploaded(s).samples();
  EXPECT_TRUE(agree(halves[0].data, found[0]));
  EXPECT_TRUE(agree(halves[1].data, found[1]));
}

TEST(GpuHistory, IsTheSameEveryTime) {
  const Scene s;
  EXPECT_EQ(Uploaded(s).mixed(true), Uploaded(s).mixed(true));
}

TEST(GpuHistory, NoticesWrongKernels) {
  const Scene s;
  const auto right = Uploaded(s).mixed(true);
  const auto samples = Uploaded(s).samples();
  for (const char* kernel : {"history_weights", "light_cells", "light_factors", "multiply", "with_samples",
                             "steady_error", "history_candidate", "limited_candidate", "scale_weights"}) {
    const Uploaded wrong(s, true, kernel);
    const auto mixed = wrong.mixed(true);
    const bool same = agree(right[0], mixed[0]) && agree(right[3], mixed[3]) && agree(samples[0], wrong.samples()[0]);
    EXPECT_FALSE(same) << kernel;
  }
}

TEST(GpuHistory, OfAnotherSizeIsRefused) {
  Scene s;
  s.history.image = Image(3, 3, 3);
  EXPECT_THROW(Uploaded{s}, Error);
}

}  // namespace
}  // namespace covary::gpu
