// SPDX-License-Identifier: Apache-2.0
// Histories with known error: which are used, and how much harm a wrong one can do.
#include "denoising/history.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "denoising/denoising_parts.h"
#include "estimators/test_images.h"

namespace covary {
namespace {

constexpr int kSize = 64;
constexpr float kTruth = 0.5f;
constexpr double kFrameVariance = 0.0025;  // of a half's mixture; the whole has half of it
constexpr double kNoise = 0.04;            // variance of a half's independent image

Image flat(float offset, double variance, uint64_t seed) {
  Image image(kSize, kSize, 3);
  const auto width = static_cast<float>(std::sqrt(12 * variance));
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = kTruth + offset + width * test::noise(seed, i, 0);
  return image;
}

Moments moments_of(const Image& image) {
  Moments m{Planes(kSize, kSize, 3, 0, 0), Planes(kSize, kSize, 3, 0, static_cast<float>(kNoise)), {}};
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      for (int c = 0; c < 3; ++c) m.mean.row(c, y)[x] = image.pixel(x, y)[c];
  return m;
}

struct Frame {
  std::array<Moments, 2> independent;
  Mixture mixture;
  Image std_error, guide = flat(0, 0, 0), common_counts;
  std::vector<unsigned char> valid = std::vector<unsigned char>(size_t{kSize} * kSize, 1);

  explicit Frame(uint64_t seed)
      : independent{moments_of(flat(0, kNoise, 10 * seed + 1)), moments_of(flat(0, kNoise, 10 * seed + 2))},
        std_error(kSize, kSize, 3) {
    mixture.halves = {flat(0, kFrameVariance, 10 * seed + 3), flat(0, kFrameVariance, 10 * seed + 4)};
    mixture.image = mixture.halves[0];
    for (size_t i = 0; i < mixture.image.data.size(); ++i)
      mixture.image.data[i] = 0.5f * (mixture.halves[0].data[i] + mixture.halves[1].data[i]);
    mixture.weights = {Image(kSize, kSize, 1)};
    std::fill(mixture.weights[0].data.begin(), mixture.weights[0].data.end(), 0.6f);
    std::fill(std_error.data.begin(), std_error.data.end(), std_deviation());
  }
  static float std_deviation() { return static_cast<float>(std::sqrt(kFrameVariance / 2)); }
  HistoryInput input(const History& history) {
    common_counts = counts_of(history, guide);
    return {{&independent[0], &independent[1]}, &std_error, &guide, &valid, {}, &common_counts};
  }
  Image add(const History& history, const Mixture* accumulated = nullptr) {
    return add_history(history, input(history), accumulated, mixture);
  }
};

History history(Image image) {
  return {std::move(image), Image(kSize, kSize, 1), std::vector<unsigned char>(size_t{kSize} * kSize, 1), {}};
}

double mean_of(const Image& image) {
  double sum = 0;
  for (const float v : image.data) sum += v;
  return sum / static_cast<double>(image.data.size());
}

double mean_squared_error(const Image& image) {
  double sum = 0;
  for (const float v : image.data) sum += (v - kTruth) * (v - kTruth);
  return sum / static_cast<double>(image.data.size());
}

TEST(History, TakesNoiseAwayWhereItIsRight) {
  Frame frame(1);
  const double alone = mean_squared_error(frame.mixture.image);
  const Image weights = frame.add(history(flat(0, 0, 0)));
  EXPECT_LT(mean_squared_error(frame.mixture.image), 0.25 * alone);
  for (const float w : weights.data) EXPECT_GT(w, 0.6f);
  EXPECT_NEAR(frame.mixture.weights[0].data[7], 0.6f * (1 - weights.data[7]), 1e-6f);
}

TEST(History, DarkensNothingWhereDarkPixelsSeemCertain) {
  Frame frame(7);
  for (size_t i = 0; i < frame.std_error.data.size(); ++i)
    frame.std_error.data[i] *= std::exp(1.5f * (frame.mixture.image.data[i] - kTruth) / Frame::std_deviation());
  frame.add(history(flat(0, 0, 0)));
  EXPECT_NEAR(mean_of(frame.mixture.image), kTruth, 0.03f * Frame::std_deviation());
}

TEST(History, LeadsNowhereWhereItIsWrong) {
  for (const float offset : {0.05f, 0.2f, -0.4f}) {
    Frame frame(2);
    const double alone = mean_squared_error(frame.mixture.image);
    frame.add(history(flat(offset, 0, 0)));
    EXPECT_LT(mean_squared_error(frame.mixture.image), 1.05 * alone) << offset;
  }
}

TEST(History, StaysWithinTheIntervalOfTheFrame) {
  Frame frame(3);
  Image wrong_in_one_place = flat(0, 0, 0);
  std::fill_n(wrong_in_one_place.pixel(30, 30), 3, 100.0f);
  const Image before = frame.mixture.image;
  frame.add(history(std::move(wrong_in_one_place)));
  EXPECT_LE(frame.mixture.image.pixel(30, 30)[1] - before.pixel(30, 30)[1], 3.01f * Frame::std_deviation());
}

TEST(History, HasNoPartWhereItIsUnknownOrUncertain) {
  Frame frame(4);
  History some = history(flat(0, 0, 0));
  for (int x = 0; x < kSize; ++x) {
    some.known[size_t{10} * kSize + x] = 0;
    *some.squared_error.pixel(x, 12) = 1e9f;
  }
  const Image before = frame.mixture.image;
  frame.add(some);
  for (int x = 0; x < kSize; ++x)
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(frame.mixture.image.pixel(x, 10)[c], before.pixel(x, 10)[c]);
      EXPECT_NEAR(frame.mixture.image.pixel(x, 12)[c], before.pixel(x, 12)[c], 1e-6f);
    }
  EXPECT_NE(frame.mixture.image.data, before.data);
}

struct Samples {
  std::array<Image, 2> halves;
  Image mean;
  explicit Samples(Frame& frame, const std::array<Image, 2>& before) : mean(kSize, kSize, 3) {
    for (const int half : {0, 1}) halves[half] = mean_image(frame.independent[half]);
    for (size_t i = 0; i < mean.data.size(); ++i) mean.data[i] = 0.5f * (halves[0].data[i] + halves[1].data[i]);
    History all = history(flat(0, 0, 0));
    all.samples = before;
    add_samples(all, frame.input(all), mean, halves);
  }
};

TEST(History, AddsSamplesByTheirVariance) {
  Frame frame(6);
  const Samples added(frame, {flat(0, kNoise / 4, 71), flat(0, kNoise / 4, 72)});
  // The best weight of the history is 0.8, which leaves a fifth of the variance.
  EXPECT_NEAR(mean_squared_error(added.halves[0]) / kNoise, 0.2, 0.02);
  EXPECT_NEAR(mean_squared_error(added.mean) / kNoise, 0.1, 0.01);
  double covariance = 0;
  for (size_t i = 0; i < added.mean.data.size(); ++i)
    covariance += (added.halves[0].data[i] - kTruth) * (added.halves[1].data[i] - kTruth);
  EXPECT_LT(std::abs(covariance / static_cast<double>(added.mean.data.size())), 0.01 * kNoise) << "still independent";
  EXPECT_GT(mean_squared_error(Samples(frame, {flat(0, 0, 0), flat(0, 0, 0)}).halves[0]), 0.005 * kNoise)
      << "new samples always count";
}

TEST(History, CountsErrorsOfSamplesAlikeWhereTheyAreBrightByChance) {
  Frame frame(9);
  std::array<Image, 2> counts = {Image(kSize, kSize, 1), Image(kSize, kSize, 1)};
  History same = history(flat(0, 0, 0));
  HistoryInput input = frame.input(same);
  for (const int half : {0, 1}) {  // weights from pictures that still have the half's noise
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)
        *counts[half].pixel(x, y) = 1 / (0.01f + std::pow(frame.independent[half].mean.row(0, y)[x], 2.0f));
    input.counts[half] = &counts[half];
  }
  same.samples = {flat(0, kNoise, 171), flat(0, kNoise, 172)};
  std::array<Image, 2> halves = {mean_image(frame.independent[0]), mean_image(frame.independent[1])};
  Image mean = halves[0];
  add_samples(same, input, mean, halves);
  EXPECT_NEAR(mean_squared_error(halves[0]) / kNoise, 0.5, 0.03);  // 0.64 with those weights
}

TEST(History, FollowsLightThatIsDimmed) {
  Frame frame(10);
  const Samples added(frame, {flat(0.1f, kNoise / 4, 71), flat(0.1f, kNoise / 4, 72)});
  EXPECT_NEAR(mean_of(added.mean), kTruth, 0.01) << "0.04 more without a factor for the history";
  EXPECT_LT(mean_squared_error(added.mean), 0.4 * kNoise / 2);
  const double alone = mean_squared_error(frame.mixture.image);
  frame.add(history(flat(0.1f, 0, 0)));
  EXPECT_LT(mean_squared_error(frame.mixture.image), 0.3 * alone);
}

TEST(History, AddsNoSamplesOfWhatHasChanged) {
  Frame frame(7);
  const Samples added(frame, {flat(0.8f, kNoise / 4, 71), flat(0.8f, kNoise / 4, 72)});
  EXPECT_LT(mean_squared_error(added.mean) / (kNoise / 2), 1.2);
}

TEST(History, TakesWhatWasMadeOfAllSamplesWhereItIsBetter) {
  for (const auto& [offset, most] : {std::pair{0.0f, 0.3}, std::pair{0.3f, 1.05}}) {
    Frame frame(8);
    const double alone = mean_squared_error(frame.mixture.image);
    const Mixture better{flat(offset, kFrameVariance / 20, 81),
                         {flat(offset, kFrameVariance / 10, 82), flat(offset, kFrameVariance / 10, 83)},
                         {}};
    const Image weights = frame.add(history(flat(1, 0, 0)), &better);
    EXPECT_LT(mean_squared_error(frame.mixture.image), most * alone);
    EXPECT_NEAR(frame.mixture.weights[0].data[7], 0.6f * (1 - weights.data[7]), 1e-6f);
  }
}

TEST(History, LeavesDarkPixelsAmongBrightOnes) {
  Frame frame(12);
  for (Image* image : {&frame.mixture.image, &frame.mixture.halves[0], &frame.mixture.halves[1]})
    std::fill_n(image->pixel(30, 30), 3, 0.0f);
  frame.add(history(flat(0, 0, 0)));
  EXPECT_LT(frame.mixture.image.pixel(30, 30)[1], 0.2f * Frame::std_deviation());
}

TEST(History, LetsNoFireflyOfAFrameStay) {
  Frame frame(11);
  Mixture firefly{flat(0, 0, 0), {flat(0, 0, 0), flat(0, 0, 0)}, {}};
  for (Image* image : {&firefly.image, &firefly.halves[0], &firefly.halves[1]})
    std::fill_n(image->pixel(30, 30), 3, 100.0f);
  const Image before = frame.mixture.image;
  frame.add(history(flat(0, 0, 0)), &firefly);
  EXPECT_LE(frame.mixture.image.pixel(30, 30)[1] - before.pixel(30, 30)[1], 3.01f * Frame::std_deviation());
}

TEST(History, ChangesLittleByFeatures) {
  for (const auto& [slope, change] : {std::pair{0.5f, 0.05f}, std::pair{50.0f, 0.2f * (kTruth + 0.02f)}}) {
    History all = history(flat(0, 0, 0));
    all.samples = {flat(0, 0, 0), flat(0, 0, 0)};
    all.features = Image(kSize, kSize, 6), all.slopes = Image(kSize, kSize, 18);
    all.slopes.pixel(7, 5)[3 * 4 + 1] = slope;  // of green over the normal's y
    Image normal(kSize, kSize, 3);
    for (int x = 0; x < kSize; ++x) normal.pixel(x, 5)[1] = 0.1f;
    follow_features(all, Image(kSize, kSize, 3), normal);
    EXPECT_NEAR(all.image.pixel(7, 5)[1], kTruth + change, 1e-5f);
    EXPECT_NEAR(all.samples[1].pixel(7, 5)[1], kTruth + change, 1e-5f);
    EXPECT_NEAR(*all.squared_error.pixel(7, 5), slope * slope * 0.01f / 3, 1e-4f * slope * slope);
    EXPECT_EQ(all.image.pixel(8, 5)[1], static_cast<float>(kTruth));
  }
}

TEST(History, OfAnotherSizeIsAnError) {
  Frame frame(5);
  EXPECT_THROW(frame.add({Image(3, 2, 3), Image(3, 2, 1), std::vector<unsigned char>(6), {}}), Error);
}

}  // namespace
}  // namespace covary
