// SPDX-License-Identifier: Apache-2.0
// Mixtures whose best weights are known, and the held-out error estimate on data with known error.
#include "denoising/mixture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "estimators/test_images.h"
#include "risk/held_out_error.h"
#include "risk/relative_weight.h"

namespace covary::mixture_test {
namespace {

constexpr int kSize = 48;
constexpr float kTruth = 0.5f;

/// A flat picture plus an offset and uniform noise of this variance in every value.
Image flat(float offset, double variance, uint64_t seed) {
  Image image(kSize, kSize, 3);
  const auto width = static_cast<float>(std::sqrt(12 * variance));
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = kTruth + offset + width * test::noise(seed, i, 0);
  return image;
}

Moments moments_of(const Image& image, float variance) {
  Moments m{Planes(kSize, kSize, 3, 0, 0), Planes(kSize, kSize, 3, 0, variance), {}};
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      for (int c = 0; c < 3; ++c) m.mean.row(c, y)[x] = image.pixel(x, y)[c];
  return m;
}

Image average(const Image& a, const Image& b) {
  Image mean = a;
  for (size_t i = 0; i < mean.data.size(); ++i) mean.data[i] = 0.5f * (a.data[i] + b.data[i]);
  return mean;
}

/// Independent images of two halves with this variance, which determine the weights of mixtures.
struct Experiment {
  static constexpr double kVariance = 0.04;  // of a half's independent image
  Moments independent[2];
  std::vector<unsigned char> valid = std::vector<unsigned char>(size_t{kSize} * kSize, 1);
  Image guide = flat(0, 0, 0);
  explicit Experiment(uint64_t seed)
      : independent{moments_of(flat(0, kVariance, 100 * seed + 1), kVariance),
                    moments_of(flat(0, kVariance, 100 * seed + 2), kVariance)} {}

  /// `make(half)`: base and candidates of a half; the whole is the mean of both.
  Mixture run(const std::function<CandidateSet(int)>& make, float bias_share, float prior = 0,
              const std::vector<float>& usual = {}) const {
    const CandidateSet halves[2] = {make(0), make(1)};
    CandidateSet whole{average(halves[0].base, halves[1].base), {}};
    for (size_t p = 0; p < halves[0].candidates.size(); ++p)
      whole.candidates.push_back(average(halves[0].candidates[p], halves[1].candidates[p]));
    return mix({&whole,
                {&halves[0], &halves[1]},
                {&independent[0], &independent[1]},
                &guide,
                &valid,
                bias_share,
                prior,
                usual,
                usual.empty() ? 0.0f : 0.2f});
  }
};

double mean_weight(const Mixture& mixture, size_t candidate) {
  double sum = 0;
  for (float w : mixture.weights[candidate].data) sum += w;
  return sum / (kSize * kSize);
}

/// The base has no bias and a variance of v per half, the candidate a bias of b and no variance: a half's error
/// x^2 b^2 + (1 - x)^2 v is least at x = v / (b^2 + v).
TEST(Mixture, FindsTheWeightOfLeastError) {
  const Experiment experiment(1);
  const double v = 0.01;
  for (const float b : {0.03f, 0.0707f, 0.2f})
    for (const float bias_share : {1.0f, 2.0f, 4.0f}) {
      const Mixture mixture = experiment.run(
          [&](int half) {
            return CandidateSet{flat(0, v, 7 + half), {flat(b, 0, 0)}};
          },
          bias_share);
      const double weighted = bias_share * b * b, best = v / (weighted + v);
      // The noise of h leaves the weight uncertain by about 0.03.
      EXPECT_NEAR(mean_weight(mixture, 0), best, 0.1) << b << " " << bias_share;
    }
}

/// Means weighted by their own standard error, with a few fireflies. One half's fireflies, weighted like the other
/// half's pixels, must not pass for variance of the mean, which a larger bias_share would keep.
TEST(Mixture, LeavesNoFirefliesWhereBiasCountsMore) {
  const Image clean = flat(0.02f, 0, 0);
  CandidateSet halves[2] = {{flat(0, 0.04, 11), {clean}}, {flat(0, 0.04, 12), {clean}}};
  Image counts[2] = {Image(kSize, kSize, 1), Image(kSize, kSize, 1)};
  for (uint64_t i = 0; i < kSize * kSize; ++i)
    for (int half : {0, 1}) {
      const float firefly = test::noise(13, i, half) > 0.45f ? 10 : 0;
      for (int c = 0; c < 3; ++c) halves[half].base.data[3 * i + c] += firefly;
      counts[half].data[i] = 1 / (0.3f + 2 * (0.04f + firefly * firefly));
    }
  const Moments independent[2] = {moments_of(halves[0].base, 0.04f), moments_of(halves[1].base, 0.04f)};
  const CandidateSet whole{average(halves[0].base, halves[1].base), {clean}};
  const Image guide = flat(0, 0, 0);
  const std::vector<unsigned char> valid(size_t{kSize} * kSize, 1);
  for (const float bias_share : {1.0f, 2.0f, 4.0f}) {
    MixtureInput input{&whole, {&halves[0], &halves[1]}, {&independent[0], &independent[1]}, &guide, &valid};
    input.bias_share = bias_share;
    input.counts = {&counts[0], &counts[1]};
    EXPECT_GT(mean_weight(mix(input), 0), 0.9) << bias_share;
  }
}

TEST(Mixture, GivesAPerfectCandidateTheWholeAndBadOnesNothing) {
  const Experiment experiment(2);
  const auto perfect_and_bad = [&](int half) {
    return CandidateSet{flat(0, 0.01, 7 + half), {flat(0.5f, 0, 0), flat(0, 0, 0), flat(-0.3f, 0.02, 9 + half)}};
  };
  const Mixture mixture = experiment.run(perfect_and_bad, 1);
  EXPECT_LT(mean_weight(mixture, 0), 0.05);
  EXPECT_GT(mean_weight(mixture, 1), 0.9);
  EXPECT_LT(mean_weight(mixture, 2), 0.05);
  const auto bad = [&](int half) {
    return CandidateSet{flat(0, 0.001, 7 + half), {flat(0.5f, 0, 0), flat(0.3f, 0, 0)}};
  };
  const Mixture base = experiment.run(bad, 1);
  EXPECT_LT(mean_weight(base, 0), 0.02);
  EXPECT_LT(mean_weight(base, 1), 0.02);
}

/// The weight, on the right, of a candidate that is right in the left two thirds of the picture and wrong on the right;
/// the guide separates both.
float weight_where_wrong(double variance, float prior) {
  Experiment experiment(5);
  const auto is_right = [](int x) { return x >= 2 * kSize / 3; };
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      for (int c = 0; c < 3; ++c) experiment.guide.pixel(x, y)[c] = is_right(x) ? 9.0f : 0.5f;
  const auto make = [&](int half) {
    Image wrong = flat(0, 0, 0);
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)
        for (int c = 0; c < 3; ++c) wrong.pixel(x, y)[c] += is_right(x) ? 0.3f : 0.0f;
    return CandidateSet{flat(0, variance, 7 + half), {wrong}};
  };
  return experiment.run(make, 1, prior).weights[0].pixel(kSize - 1, 5)[0];
}

TEST(Mixture, TheWholeImagesWeightsCountOnlyWhereThereIsNoise) {
  // v / (b^2 + v) = 0.25 there, x0 = 0.5 with the whole image's mean b^2; (v + 10 v x0) / (b^2 + v + 10 v) = 0.43.
  EXPECT_NEAR(weight_where_wrong(0.03, 0), 0.25, 0.1);
  EXPECT_NEAR(weight_where_wrong(0.03, 10), 0.43, 0.08);
  EXPECT_LT(weight_where_wrong(1e-4, 10), 0.02);
}

TEST(Mixture, UsualWeightsCountOnlyWhereThereIsNoise) {
  const auto weight = [](double variance, const std::vector<float>& usual) {
    const Experiment experiment(5);
    const auto make = [&](int half) { return CandidateSet{flat(0, variance, 7 + half), {flat(0.3f, 0, 0)}}; };
    return mean_weight(experiment.run(make, 1, 1000, usual), 0);
  };
  // With b^2 = v = 0.09: v / (b^2 + v) = 0.5, and (v + 0.2 v x1) / (b^2 + v + 0.2 v) = 0.545 and 0.455.
  const double none = weight(0.09, {});
  EXPECT_NEAR(none, 0.5, 0.05);
  EXPECT_NEAR(weight(0.09, {1}) - none, 0.045, 0.02);
  EXPECT_NEAR(none - weight(0.09, {0}), 0.045, 0.02);
  EXPECT_LT(weight(1e-4, {1}), 0.02);
}

TEST(Mixture, WeightsAreSharesOfOne) {
  const Experiment experiment(3);
  const auto many = [&](int half) {
    CandidateSet set{flat(0, 0.01, 7 + half), {}};
    for (int p = 0; p < kMaxCandidates; ++p)
      set.candidates.push_back(flat(0.02f * static_cast<float>(p), 0.005, 20 + 2 * p + half));
    return set;
  };
  const Mixture mixture = experiment.run(many, 1);
  for (int i = 0; i < kSize * kSize; ++i) {
    float sum = 0;
    for (const Image& weights : mixture.weights) {
      ASSERT_GE(weights.data[i], -1e-6f);
      sum += weights.data[i];
    }
    ASSERT_LE(sum, 1 + 1e-5f);
  }
}

TEST(Mixture, KeepsTheBaseWhereNothingIsValid) {
  Experiment experiment(4);
  std::fill_n(experiment.valid.begin(), kSize, 0);
  const auto make = [&](int half) { return CandidateSet{flat(0, 0.01, 7 + half), {flat(0, 0, 0)}}; };
  const Mixture mixture = experiment.run(make, 1);
  const Image base = average(make(0).base, make(1).base);
  for (int x = 0; x < kSize; ++x) EXPECT_EQ(mixture.image.pixel(x, 0)[1], base.pixel(x, 0)[1]);
  EXPECT_NE(mixture.image.pixel(5, 1)[1], base.pixel(5, 1)[1]);
}

/// Student's t of the predicted minus the true squared error over 32 experiments: P(|t| > 5.5) = 5e-6. The standard
/// deviation of a difference is about 7 % of the error, so that a prediction 7 % too large or too small is detected.
double t_of_prediction(float bias, bool held_out) {
  constexpr int kRuns = 32;
  double sum = 0, squares = 0;
  for (uint64_t seed = 1; seed <= kRuns; ++seed) {
    const Experiment e(seed);
    const Image a = flat(bias, 0.002, 100 * seed + 11), b = flat(bias, 0.002, 100 * seed + 12);
    // Held out: the other half's samples. Otherwise, as a planted bug, each image is compared with its own samples.
    const Moments own[2] = {moments_of(a, 0.002f), moments_of(b, 0.002f)};
    const Image error =
        held_out_error(held_out_parts({{&a, &b},
                                       {held_out ? &e.independent[0] : &own[0], held_out ? &e.independent[1] : &own[1]},
                                       &e.guide,
                                       &e.valid}),
                       {});
    const Image whole = average(a, b);
    double difference = 0;
    for (size_t i = 0; i < whole.data.size(); ++i)
      difference += error.data[i] * error.data[i] - std::pow(whole.data[i] - kTruth, 2);
    sum += difference;
    squares += difference * difference;
  }
  const double mean = sum / kRuns, variance = (squares / kRuns - mean * mean) / (kRuns - 1);
  return mean / std::sqrt(variance);
}

TEST(HeldOutError, IsUnbiased) {
  EXPECT_LT(std::abs(t_of_prediction(0.05f, true)), 5.5);
  EXPECT_LT(std::abs(t_of_prediction(0.1f, true)), 5.5);
  // Compared with their own samples, images seem to have no bias.
  EXPECT_GT(std::abs(t_of_prediction(0.1f, false)), 5.5);
}

TEST(HeldOutError, IsTheUsualOneWhereHeldOutSamplesAreNoise) {
  Experiment e(5);
  for (int c = 0; c < 3; ++c) e.independent[0].mean.row(c, 20)[30] += 30;  // a firefly
  const Image a = flat(0, 0.002, 11), b = flat(0, 0.002, 12);
  const Image error =
      held_out_error(held_out_parts({{&a, &b}, {&e.independent[0], &e.independent[1]}, &e.guide, &e.valid}), {}, 0.65);
  double sum = 0;
  for (const float value : error.data) sum += value * value;
  const double over_variance = sum / static_cast<double>(error.data.size()) / 0.002;
  EXPECT_GT(over_variance, 0.6);
  EXPECT_LT(over_variance, 1.3) << "the light alone makes the squared error 30 times as large";
}

TEST(HeldOutError, IsWhereImagesDisagreeAndAsLargeInAll) {
  const Experiment e(6);
  const Image a = flat(0, 0.002, 13), b = flat(0, 0.002, 14);
  const HeldOutParts parts = held_out_parts({{&a, &b}, {&e.independent[0], &e.independent[1]}, &e.guide, &e.valid});
  const Image before = held_out_error(parts, {});
  Image image = flat(0, 0, 0), candidate = image;  // a disagreement of 0.1 on the left, of 0.4 on the right
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      for (int c = 0; c < 3; ++c) candidate.pixel(x, y)[c] += x < kSize / 2 ? 0.1f : 0.4f;
  const Image place = disagreement({{}, {candidate, candidate}}, e.guide, image, e.valid);
  const float of_left = 0.01f * relative_weight(e.guide.pixel(1, 1));
  EXPECT_NEAR(*place.pixel(1, 1), of_left, 1e-6f);
  const Image beside = disagreement({{}, {image, candidate}}, e.guide, image, e.valid);
  EXPECT_NEAR(*beside.pixel(1, 1), std::sqrt(of_left / 60 * of_left), 1e-6f) << "at least 1/30 of their mean";
  const Image after = held_out_error(parts, place);
  double sums[2] = {}, ends[2] = {};
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) sums[0] += sqr(before.pixel(x, y)[0]), sums[1] += sqr(after.pixel(x, y)[0]);
    ends[0] += sqr(after.pixel(0, y)[0] / before.pixel(0, y)[0]);
    ends[1] += sqr(after.pixel(kSize - 1, y)[0] / before.pixel(kSize - 1, y)[0]);
  }
  EXPECT_NEAR(sums[1] / sums[0], 1, 0.02) << "one channel of three";
  EXPECT_NEAR(ends[1] / ends[0], 16, 2);
}

TEST(SampledRows, AreFewBlocksWhereRowsAreLong) {
  EXPECT_EQ(sampled_rows(1280, 720).size(), 1u);  // all rows
  for (const auto& [width, n] : {std::pair{2048, 4}, {5120, 4}, {7680, 2}, {15360, 2}}) {
    const std::vector<SampledRows> blocks = sampled_rows(width, width * 9 / 16);
    ASSERT_EQ(blocks.size(), static_cast<size_t>(n)) << width;
    double pixels = 0;
    for (size_t i = 0; i < blocks.size(); ++i) {
      EXPECT_GT(blocks[i].first, i > 0 ? blocks[i - 1].end : 0);
      pixels += static_cast<double>(blocks[i].end - blocks[i].first) * width;
    }
    EXPECT_NEAR(pixels, kMaxSampledPixels, 2.0 * n * width);
    EXPECT_LT(blocks.back().end, width * 9 / 16);
  }
}

}  // namespace
}  // namespace covary::mixture_test
