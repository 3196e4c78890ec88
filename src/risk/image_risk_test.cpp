// SPDX-License-Identifier: Apache-2.0
// The squared error of an image estimated from its own samples, against the truth of synthetic images.
#include "risk/image_risk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "estimators/mean.h"
#include "risk/halves.h"

namespace covary {
namespace {

constexpr int kWidth = 64, kHeight = 48, kGroups = 12, kRuns = 24;

double truth_at(int x, int y) { return 1 + 0.5 * std::sin(0.15 * x) * std::cos(0.2 * y) + (x > 40 ? 0.7 : 0); }

/// Groups around the truth, with skewed errors of mean zero: 0.8 times a centred exponential variable.
struct Samples {
  std::vector<float> data;
  GroupedImage image{kWidth, kHeight, kGroups};
  explicit Samples(uint32_t seed) : data(static_cast<size_t>(kWidth) * kHeight * kGroups * 3) {
    uint64_t state = seed * 0x9e3779b97f4a7c15ull + 1;
    size_t i = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int k = 0; k < 3 * kGroups; ++k) {
          state = state * 6364136223846793005ull + 1442695040888963407ull;
          const double u = static_cast<double>(state >> 11) * 0x1p-53;
          data[i++] = static_cast<float>(truth_at(x, y) + 0.8 * (-std::log1p(-u) - 1));
        }
    image.data = data.data();
  }
};

/// A filter with strong bias: the mean of 5 x 5 pixels, times 0.9.
Image filtered(const GroupedImage& groups) {
  const Image mean = mean_of_groups(groups).estimate;
  Image result(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) {
        float sum = 0, n = 0;
        for (int j = std::max(0, y - 2); j <= std::min(kHeight - 1, y + 2); ++j)
          for (int i = std::max(0, x - 2); i <= std::min(kWidth - 1, x + 2); ++i) sum += mean.pixel(i, j)[c], n += 1;
        result.pixel(x, y)[c] = 0.9f * sum / n;
      }
  return result;
}

Image white() {
  Image image(kWidth, kHeight, 3);
  std::fill(image.data.begin(), image.data.end(), 1.0f);
  return image;
}

RiskRow sums_of(const Samples& samples, double& true_error) {
  const Image guide = white(), image = filtered(samples.image);
  const std::vector<unsigned char> valid(static_cast<size_t>(kWidth) * kHeight, 1);
  const HalfImage a(samples.image, 0), b(samples.image, 1);
  const std::array<Image, 2> halves = {filtered(a.view()), filtered(b.view())};
  const Moments mean = moments(samples.image, valid, 0, 0.0f), mean_a = moments(a.view(), valid, 0, 0.0f),
                mean_b = moments(b.view(), valid, 0, 0.0f);
  true_error = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) true_error += std::pow(image.pixel(x, y)[c] - truth_at(x, y), 2) / 1.01;
  return sum_of(
      image_risk({&image, {&halves[0], &halves[1]}, &mean, {&mean_a, &mean_b}, &samples.image, &guide, &valid}));
}

// 24 images; the mean of estimate - truth over its standard error is Student's t with 23 degrees of freedom: |t| > 5.6
// has probability 1e-5. Without the covariance, the estimate is too small by 2 v / 25 per value, which gives t = -20.
TEST(ImageRisk, IsTheSquaredErrorOfAFilteredImageWithItsBias) {
  double sum = 0, squares = 0, truth = 0;
  for (uint32_t run = 0; run < kRuns; ++run) {
    double true_error = 0;
    const double difference = sums_of(Samples(run), true_error).error - true_error;
    sum += difference, squares += difference * difference, truth += true_error;
  }
  const double mean = sum / kRuns, error = std::sqrt((squares / kRuns - mean * mean) / (kRuns - 1));
  EXPECT_LT(std::abs(mean / error), 5.6) << mean << " ± " << error;
  EXPECT_LT(error, 0.03 * truth / kRuns) << "sees a tenth of the error";
}

// A flat picture of 0.5 whose image has 100 at one pixel, where the samples have 0.5.
TEST(ImageRisk, SeesLightThatTheSamplesDoNotHave) {
  std::vector<float> data(static_cast<size_t>(kWidth) * kHeight * 6, 0.5f);
  const GroupedImage groups{kWidth, kHeight, 2, data.data()};
  Image image(kWidth, kHeight, 3);
  std::fill(image.data.begin(), image.data.end(), 0.5f);
  const std::vector<unsigned char> valid(static_cast<size_t>(kWidth) * kHeight, 1);
  const Moments mean = moments(groups, valid, 0, 0.0f);
  const auto spread = [&] {
    const Image guide = white();
    return sum_of(image_risk({&image, {&image, &image}, &mean, {&mean, &mean}, &groups, &guide, &valid})).spread;
  };
  EXPECT_EQ(spread(), 0);
  std::fill_n(image.pixel(10, 20), 3, 4.9f);
  EXPECT_EQ(spread(), 0) << "less than ten times as bright";
  std::fill_n(image.pixel(10, 20), 3, 100.0f);
  EXPECT_NEAR(spread() / (3 * 99.5 * 99.5 / 0.26), 1, 1e-6);
}

TEST(ImageRisk, KnowsItsOwnScatter) {
  double sum = 0, squares = 0, told = 0;
  for (uint32_t run = 0; run < kRuns; ++run) {
    double truth = 0;
    const RiskRow sums = sums_of(Samples(run + 100), truth);
    sum += sums.error, squares += sums.error * sums.error;
    told += sums.squares - sums.error * sums.error / sums.parts;
  }
  const double variance = (squares - sum * sum / kRuns) / (kRuns - 1);
  // Bias differs between segments, so that the estimate is too large; a chi-square with 23 degrees of freedom adds ±
  // 0.3.
  EXPECT_GT(told / kRuns, 0.5 * variance);
  EXPECT_LT(told / kRuns, 5 * variance);
}

/// A wall whose left quarter is a mirror and whose next quarter is glass: the mirror shows other normals, the glass
/// other albedos. Without images of what is behind them, nothing is known.
TEST(ImageRisk, TellsTheNoiseInMirrorsAndBehindGlass) {
  const Samples samples(7);
  const Image guide = white(), albedo = white();
  Image normal = white(), behind_mirror = white(), behind_glass = white();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth / 4; ++x) *behind_mirror.pixel(x, y) = -1, *behind_glass.pixel(x + kWidth / 4, y) = 0.9f;
  const std::vector<unsigned char> valid(static_cast<size_t>(kWidth) * kHeight, 1);
  const Moments mean = moments(samples.image, valid, 0, 0.0f);
  const auto specular = [&](const Features& surfaces) {
    const RiskRow sums = sum_of(image_risk({&guide, {}, &mean, {}, &samples.image, &guide, &valid, surfaces}));
    return sums.specular_noise / sums.noise;
  };
  EXPECT_NEAR(specular({&albedo, &normal, &behind_glass, &behind_mirror}), 0.5, 0.05);
  EXPECT_NEAR(specular({&albedo, nullptr, &behind_glass, nullptr}), 0.25, 0.05);
  EXPECT_EQ(specular({&albedo, &normal, nullptr, nullptr}), 0);
  EXPECT_EQ(specular({}), 0);
}

/// For the mean itself.
std::vector<RiskRow> risk_of_mean(const GroupedImage& groups) {
  MethodImage mean = mean_of_groups(groups);
  add_risk_of_mean(groups, mean);
  return mean.risk_rows;
}

TEST(ImageRisk, OfAMeanIsItsVariance) {
  const Samples samples(7);
  const RiskRow sums = sum_of(risk_of_mean(samples.image));
  EXPECT_GT(sums.noise, 0);
  EXPECT_NEAR(sums.error / sums.noise, 1, 1e-9);
  EXPECT_NEAR(sums.variance / sums.noise, 1, 1e-9);
  EXPECT_EQ(sums.values, 3.0 * kWidth * kHeight);
}

/// Relative to the pixels around it, not to itself.
TEST(ImageRisk, OfAMeanKnowsFireflies) {
  Samples samples(7);
  std::fill(samples.data.begin(), samples.data.end(), 0.0f);
  const size_t pixel = static_cast<size_t>(20) * kWidth + 30;
  for (size_t c = 0; c < 3; ++c) samples.data[pixel * kGroups * 3 + c] = 12;
  const double v = 12.0 * 12 / kGroups / kGroups;  // of the mean, 1
  EXPECT_NEAR(sum_of(risk_of_mean(samples.image)).error, 3 * v / 0.01, 1e-3 * v / 0.01);
}

/// Every fourth pixel has found a light of brightness 1/4: most are black, but none of them is as dark as that.
TEST(ImageRisk, OfAMeanKnowsTheBrightnessOfRareLight) {
  Samples samples(7);
  std::fill(samples.data.begin(), samples.data.end(), 0.0f);
  for (size_t y = 0; y < kHeight; ++y)
    for (size_t x = 0; x < kWidth; ++x)
      for (size_t c = 0; (x + y) % 4 == 0 && c < 3; ++c) samples.data[(y * kWidth + x) * kGroups * 3 + c] = kGroups;
  const double wanted = 3.0 * kWidth * kHeight / 4 / (0.25 * 0.25 + 0.01);
  EXPECT_NEAR(sum_of(risk_of_mean(samples.image)).error / wanted, 1, 0.1);
}

TEST(ImageRisk, OfAMeanOfOneGroupIsNotKnown) {
  Samples samples(7);
  samples.image.groups = 1;
  EXPECT_TRUE(risk_of_mean(samples.image).empty());
}

TEST(ImageRisk, TellsWhatTheLargestGroupsHold) {
  Samples samples(8);
  std::fill(samples.data.begin(), samples.data.end(), 0.0f);
  for (size_t i = 0; i < samples.data.size(); i += 3 * kGroups) samples.data[i] = 1;  // one group of each pixel
  const RiskRow sums = sum_of(risk_of_mean(samples.image));
  EXPECT_NEAR(sums.light_of_largest / sums.light, 1, 1e-9);
  // Of a value that is 1 with probability p = 1 / 12: p q (p^3 + q^3) / (p q)^2.
  EXPECT_NEAR(sums.fourth_powers / sums.squared_deviations, 10.09, 0.01);
}

TEST(ImageRisk, HasRowsThatDoNotDependOnOthersFarAway) {
  const Samples samples(9);
  const std::vector<RiskRow> whole = risk_of_mean(samples.image), upper = risk_of_mean(rows_of(samples.image, 0, 24));
  for (size_t y = 0; y < 22; ++y) EXPECT_EQ(upper[y].error, whole[y].error);
}

}  // namespace
}  // namespace covary
