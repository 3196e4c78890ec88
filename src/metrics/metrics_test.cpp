// SPDX-License-Identifier: Apache-2.0
// Error measures: values worked out by hand, and the product form with two references.
#include "metrics/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of;

Image image_of(std::vector<float> values) {
  Image image(static_cast<int>(values.size() / 3), 1, 3);
  image.data = std::move(values);
  return image;
}

double value(Metric metric, const Image& image, std::vector<Image> references) {
  return compute_metric(metric, image, references).value;
}

/// 1 + x/64 plus uniform noise of standard deviation `sigma`.
Image noisy(int size, double offset, double sigma, uint64_t seed) {
  Image image(size, size, 3);
  for (size_t i = 0; i < image.data.size(); ++i) {
    const float u = PathRandom(Sampling::kIndependent, seed, 0, i, 0).get_1d(0, Event::kPixel);
    const double clean = 1 + static_cast<double>(i / 3 % size) / 64;
    image.data[i] = static_cast<float>(clean + offset + sigma * std::sqrt(12.0) * (u - 0.5));
  }
  return image;
}

TEST(Metrics, WorkedOutByHand) {
  // Differences (1, 0, -1) at a pixel with mean 2, and (0.3, 0, 0) at a black one.
  const Image f = image_of({2, 2, 2, 0.3f, 0, 0}), r = image_of({1, 2, 3, 0, 0, 0});
  EXPECT_NEAR(value(Metric::kRelMse, f, {r}), (2 / 4.01 + 0.09 / 0.01) / 6, 1e-6);
  EXPECT_NEAR(value(Metric::kMse, f, {r}), 2.09 / 6, 1e-7);
  EXPECT_NEAR(value(Metric::kMae, f, {r}), 2.3 / 6, 1e-7);
  EXPECT_NEAR(value(Metric::kMape, f, {r}), (1 / 1.01 + 1 / 3.01 + 0.3 / 0.01) / 6, 1e-6);
  const MetricResult result = compute_metric(Metric::kMse, f, std::vector{r});
  EXPECT_NEAR(result.map.data[0], 2.0 / 3, 1e-6);
  EXPECT_NEAR(result.map.data[1], 0.03, 1e-6);
  EXPECT_EQ(result.n_pixels, 2u);
}

TEST(Metrics, CountsPixelsAboveFivePercent) {
  // Relative differences of sums: 0.04 and 0.06 of 1; 0 / 0; positive / 0; 0.25 of 5, split over channels.
  const Image r = image_of({0.5f, 0.5f, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 2, 2, 1});
  const Image f = image_of({0.52f, 0.48f, 0, 1, 0.06f, 0, 0, 0, 0, 0, 1e-6f, 0, 2.2f, 1.9f, 1});
  const MetricResult result = compute_metric(Metric::kAbove5, f, std::vector{r});
  EXPECT_EQ(result.map.data, (std::vector<float>{0, 1, 0, 1, 1}));
  EXPECT_NEAR(result.value, 3.0 / 5, 1e-12);
  const Image above = image_of({1.2f, 1, 1}), low = image_of({1, 1, 1}), high = image_of({1.2f, 1, 1});
  EXPECT_EQ(value(Metric::kAbove5, above, {low}), 1);
  EXPECT_EQ(value(Metric::kAbove5, above, {low, high}), 0) << "0.1 of 3.1";
}

// 1,000 pixels: 3 of the 3,000 values are dropped, regardless of their pixels.
TEST(Metrics, TrimmedRelMseLeavesOutTheLargestValues) {
  std::vector<float> values(3000, 1.0f), reference(3000, 1.0f);
  for (size_t i = 0; i < values.size(); i += 10) values[i] = 1.1f;
  const Image r = image_of(reference);
  values[5] = 100, values[1001] = 50, values[1002] = -50;
  EXPECT_NEAR(value(Metric::kRelMseTrimmed, image_of(values), {r}), 300 * 0.01 / 1.01 / 2997, 1e-8);
  values[2222] = 3;
  EXPECT_NEAR(value(Metric::kRelMseTrimmed, image_of(values), {r}), (300 * 0.01 + 4) / 1.01 / 2997, 1e-8);
  const MetricResult result = compute_metric(Metric::kRelMseTrimmed, image_of(values), std::vector{r});
  EXPECT_EQ(result.map.data[1], 0) << "the pixel with 100";
  EXPECT_GT(result.map.data[740], 0) << "the pixel with 3";
  // Relative to each value's own reference, not to the pixel's mean.
  EXPECT_NEAR(value(Metric::kRelMseTrimmed, image_of({2, 2, 2}), {image_of({1, 2, 4})}), (1 / 1.01 + 4 / 16.01) / 3,
              1e-7);
  EXPECT_NEAR(value(Metric::kRelMseTrimmed, image_of({2, 2, 2}), {image_of({1, 2, 4}), image_of({1.5f, 3, 3})}),
              (0.5 / (1.25 * 1.25 + 0.01) + 2 / (3.5 * 3.5 + 0.01)) / 3, 1e-7);
}

TEST(Metrics, TwoReferencesWorkedOutByHand) {
  const Image f = image_of({2, 2, 2}), r1 = image_of({1, 2, 4}), r2 = image_of({1.5f, 3, 3});
  const double products = 1 * 0.5 + 0 * -1 + -2 * -1, grey = (1.25 + 2.5 + 3.5) / 3;
  EXPECT_NEAR(value(Metric::kRelMse, f, {r1, r2}), products / (3 * (grey * grey + 0.01)), 1e-7);
  EXPECT_NEAR(value(Metric::kMse, f, {r1, r2}), products / 3, 1e-7);
  EXPECT_NEAR(value(Metric::kMae, f, {r1, r2}), (0.75 + 0.5 + 1.5) / 3, 1e-7);
  EXPECT_EQ(value(Metric::kRelMse, f, {r1, r1}), value(Metric::kRelMse, f, {r1}));
}

// F differs from the truth by 0.1 everywhere; the references have noise of 0.2. The mean product over N = 3 * 64^2
// values has standard deviation s = sqrt(2 * 0.1^2 * 0.2^2 + 0.2^4) / sqrt(N) = 4.4e-4. alpha = 1e-5: |z| < 4.42; an
// error of (4.42 + 2.33) s = 3.0e-3 is detected with power 0.99. The bias of the squares, 0.2^2 = 0.04, is 91 s.
TEST(Metrics, ProductFormIsFreeOfTheReferencesNoise) {
  const Image f = noisy(64, 0.1, 0, 1), r1 = noisy(64, 0, 0.2, 2), r2 = noisy(64, 0, 0.2, 3);
  const double s = std::sqrt(2 * 0.01 * 0.04 + 0.0016) / std::sqrt(3.0 * 64 * 64);
  EXPECT_LT(std::abs(value(Metric::kMse, f, {r1, r2}) - 0.01), 4.42 * s);
  // Planted bugs: the same noise in both references, and only one reference.
  EXPECT_GT(std::abs(value(Metric::kMse, f, {r1, r1}) - 0.01), 4.42 * s);
  EXPECT_GT(std::abs(value(Metric::kMse, f, {r1}) - 0.01), 4.42 * s);
}

TEST(Metrics, NonFinitePixelsAreLeftOutAndCounted) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const Image f = image_of({2, 2, 2, 1, nan, 1, 1, 1, 1, 5, 5, 5}),
              r = image_of({1, 1, 1, 1, 1, 1, 1, inf, 1, 5, 5, 5});
  for (const MetricInfo& info : metrics()) {
    const MetricResult result = compute_metric(info.metric, f, std::vector{r});
    EXPECT_EQ(result.n_pixels, 2u) << info.name;
    EXPECT_EQ(result.n_non_finite, 2u) << info.name;
    EXPECT_TRUE(std::isfinite(result.value)) << info.name;
    EXPECT_TRUE(std::isnan(result.map.data[1]) && std::isnan(result.map.data[2])) << info.name;
  }
  EXPECT_NEAR(value(Metric::kMse, f, {r}), 0.5, 1e-7);
  EXPECT_TRUE(contains(message_of([&] {
                         value(Metric::kMse, image_of({nan, 0, 0}), {image_of({1, 1, 1})});
                       }),
                       "none of the 1 pixels is finite"));
}

// Their squares overflow floats but not doubles.
TEST(Metrics, LargestFloats) {
  const float largest = std::numeric_limits<float>::max();
  const double square = static_cast<double>(largest) * largest;
  const Image black = image_of({0, 0, 0, 0, 0, 0}), f = image_of({largest, largest, largest, 0, 0, 0});
  EXPECT_NEAR(value(Metric::kMse, f, {black}) / (square / 2), 1, 1e-6);
  EXPECT_NEAR(value(Metric::kRelMse, f, {black}) / (square / 0.02), 1, 1e-6);
  EXPECT_NEAR(value(Metric::kRelMseTrimmed, f, {black}) / (square / 0.02), 1, 1e-6);
  EXPECT_NEAR(value(Metric::kMape, f, {black}) / (largest / 0.02), 1, 1e-6);
  for (const MetricInfo& info : metrics()) {
    EXPECT_EQ(value(info.metric, f, {f, f}), 0) << info.name;
    const MetricResult result = compute_metric(info.metric, f, std::vector{black});
    EXPECT_GT(result.value, 0) << info.name;
    for (const float v : result.map.data) EXPECT_TRUE(std::isfinite(v)) << info.name;
  }
}

TEST(Metrics, NamesAndSizes) {
  for (const MetricInfo& info : metrics()) EXPECT_EQ(find_metric(info.name).metric, info.metric);
  EXPECT_TRUE(contains(message_of([] { find_metric("relmsee"); }),
                       "unknown metric 'relmsee'; did you mean 'relmse'? Expected one of relmse, relmse-trimmed, mse, "
                       "mae, mape, flip"));
  EXPECT_TRUE(contains(message_of([] { value(Metric::kMse, Image(4, 3, 3), {Image(3, 4, 3)}); }),
                       "the image has 4 x 3 pixels, the reference 3 x 4"));
}

}  // namespace
}  // namespace covary
