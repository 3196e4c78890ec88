// SPDX-License-Identifier: Apache-2.0
// Filters of dependent tests: weights against their definitions, the error bound, the limits of many and of no samples,
// and the whole estimator.
#include "dependent_tests/dependent_tests.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "estimators/test_images.h"
#include "film/groups.h"
#include "support/files.h"

namespace covary::dependent_tests_test {
namespace {

using test_support::contains, test_support::message_of;

constexpr int kWidth = 19, kHeight = 13;

/// Colours of the CRN image with differences of about `contrast`; a sample has standard deviation 1 in the norm.
FilterInput random_input(uint64_t seed, float contrast, float count, int border = 16) {
  FilterInput input;
  input.dependent = Planes(kWidth, kHeight, 3, border, kFar);
  input.independent = Planes(kWidth, kHeight, 3, border, 0);
  input.variance = Planes(kWidth, kHeight, 1, border, 0);
  input.count = Planes(kWidth, kHeight, 1, border, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto pixel = static_cast<uint64_t>(y * kWidth + x);
      for (int c = 0; c < 3; ++c) {
        input.dependent.row(c, y)[x] = 1 + contrast * test::noise(seed, pixel, static_cast<uint64_t>(c));
        input.independent.row(c, y)[x] = 1 + test::noise(seed + 1, pixel, static_cast<uint64_t>(c));
      }
      input.variance.row(0, y)[x] = 1;
      input.count.row(0, y)[x] = count;
    }
  return input;
}

/// A pixel of a window, relative to its centre.
struct Partner {
  int x, y;
  double difference, variance;  // Delta_q and v_q
};

double difference(const FilterInput& input, int x, int y, int qx, int qy) {
  double sum = 0, squares = 0;
  for (int c = 0; c < 3; ++c) {
    const double d = double{input.dependent.row(c, qy)[qx]} - input.dependent.row(c, y)[x];
    sum += std::abs(d), squares += d * d;
  }
  return input.norm == Norm::kEuclidean ? std::sqrt(squares) : sum;
}

std::vector<Partner> partners(const FilterInput& input, int x, int y, int low, int high) {
  std::vector<Partner> all;
  for (int qy = std::max(0, y + low); qy <= std::min(kHeight - 1, y + high); ++qy)
    for (int qx = std::max(0, x + low); qx <= std::min(kWidth - 1, x + high); ++qx)
      if (const double count = input.count.row(0, qy)[qx]; count > 0)
        all.push_back({qx, qy, difference(input, x, y, qx, qy), input.variance.row(0, qy)[qx] / count});
  return all;
}

double bound_of(const std::vector<Partner>& window, const std::vector<double>& weights) {
  double squares = 0, distortion = 0;
  for (size_t i = 0; i < window.size(); ++i) {
    squares += weights[i] * weights[i] * window[i].variance;
    distortion += weights[i] * window[i].difference;
  }
  return 3 * std::sqrt(squares) + distortion;
}

/// d of a pixel at this distance in a region of side m with M pixels.
double by_distance(Falloff falloff, double distance, int m, double M) {
  const double end = m / std::sqrt(2.0), t = distance / end;
  switch (falloff) {
    case Falloff::kPyramid:
      return std::max(0.0, end - distance);
    case Falloff::kCount:
      return std::max(0.0, M / std::sqrt(2.0) - distance);
    case Falloff::kGaussian:
      return std::exp(-std::pow(2 * distance / m, 2));
    case Falloff::kSpline:
      break;
  }
  // The cubic B-spline on [-1, 1], as a sum of truncated powers.
  double sum = 0;
  const double factors[] = {1, -4, 6, -4, 1};
  for (int i = 0; i < 5; ++i) sum += factors[i] * std::pow(std::max(0.0, 2 * t + 2 - i), 3) / 6;
  return std::max(0.0, sum);
}

/// The published weights, recomputed for a given side.
std::vector<double> published_weights(const FilterInput& input, int x, int y, int m, Falloff falloff) {
  const std::vector<Partner> window = partners(input, x, y, -((m - 1) / 2), m / 2);
  const auto M = static_cast<double>(window.size());
  const double N = input.count.row(0, y)[x], sigma = std::sqrt(input.variance.row(0, y)[x]);
  double mean = 0, sum = 0;
  for (const Partner& q : window) mean += q.difference / M;
  std::vector<double> weights;
  for (const Partner& q : window) {
    const double f = 1 / M + std::sqrt(N) / (3 * sigma * std::sqrt(M)) * (mean - q.difference);
    weights.push_back(std::max(0.0, f) * by_distance(falloff, std::hypot(q.x - x, q.y - y), m, M));
    sum += weights.back();
  }
  for (double& w : weights) w /= sum;
  return weights;
}

/// Minimises the bound over weights >= 0 with sum 1 without using the known solution: moves weight between pairs of
/// pixels in ever smaller steps.
std::vector<double> minimise(const std::vector<Partner>& window) {
  std::vector<double> weights(window.size(), 1.0 / static_cast<double>(window.size()));
  double squares = 0, distortion = 0;
  for (size_t i = 0; i < window.size(); ++i) {
    squares += weights[i] * weights[i] * window[i].variance;
    distortion += weights[i] * window[i].difference;
  }
  for (double step = 0.25; step > 1e-7; step *= 0.7)
    for (bool moved = true; moved;) {
      moved = false;
      for (size_t i = 0; i < window.size(); ++i)
        for (size_t k = 0; k < window.size(); ++k) {
          const double part = std::min(step, weights[i]);
          if (i == k || part <= 0) continue;
          const double new_squares = squares + window[i].variance * part * (part - 2 * weights[i]) +
                                     window[k].variance * part * (part + 2 * weights[k]);
          const double new_distortion = distortion + part * (window[k].difference - window[i].difference);
          if (3 * std::sqrt(new_squares) + new_distortion >= 3 * std::sqrt(squares) + distortion - 1e-13) continue;
          weights[i] -= part, weights[k] += part;
          squares = new_squares, distortion = new_distortion;
          moved = true;
        }
    }
  return weights;
}

TEST(BoundFilter, FindsTheMinimumOfTheBound) {
  for (const float count : {1.0f, 30.0f, 2000.0f}) {
    FilterInput input = random_input(3, 0.3f, count);
    input.count.row(0, 5)[6] = 4 * count;  // partners differ
    input.variance.row(0, 4)[7] = 0.2f;
    const FilteredImage result = bound_filter(input, 5);
    for (const auto& [x, y] : {std::pair{6, 5}, {0, 0}, {18, 12}, {8, 0}, {7, 4}}) {
      std::vector<Partner> window = partners(input, x, y, -2, 2);
      for (Partner& q : window) q.variance = input.variance.row(0, y)[x] / input.count.row(0, q.y)[q.x];
      const std::vector<double> weights = minimise(window);
      const double bound = bound_of(window, weights);
      EXPECT_NEAR(result.bound.pixel(x, y)[0], bound, 1e-4 * bound) << x << " " << y << " " << count;
      double colour = 0, own = 0;
      for (size_t i = 0; i < window.size(); ++i) {
        colour += weights[i] * input.independent.row(0, window[i].y)[window[i].x];
        if (window[i].x == x && window[i].y == y) own = weights[i];
      }
      EXPECT_NEAR(result.colour.pixel(x, y)[0], colour, 2e-3);
      EXPECT_NEAR(result.centre_weight.pixel(x, y)[0], own, 2e-3);
    }
  }
}

TEST(BoundFilter, IsNeverAboveThePublishedBound) {
  for (const float contrast : {0.01f, 0.2f, 2.0f})
    for (const float count : {1.0f, 50.0f, 5000.0f}) {
      const FilterInput input = random_input(4, contrast, count);
      const FilteredImage exact = bound_filter(input, 5);
      const FilteredImage published = region_filter(input, {.max_region = 5, .min_centre_drop = 0});
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
          EXPECT_LE(exact.bound.pixel(x, y)[0], published.bound.pixel(x, y)[0] * 1.0001f);
    }
}

/// Both filters preserve a constant image, borders included: weights sum to 1.
TEST(Filters, WeightsAddUpToOne) {
  FilterInput input = random_input(5, 0.4f, 20);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) input.independent.row(c, y)[x] = 0.7f;
  for (const FilteredImage& result :
       {bound_filter(input, 9), region_filter(input, {.max_region = 7, .min_centre_drop = 0})})
    for (const float value : result.colour.data) EXPECT_NEAR(value, 0.7f, 1e-5f);
}

TEST(Filters, ManySamplesMakeTheExactOneVanishAndNotThePublishedOne) {
  double exact_centre[2], published_centre[2];
  for (const int i : {0, 1}) {
    const FilterInput input = random_input(6, 0.2f, i == 0 ? 10.0f : 1e9f);
    exact_centre[i] = bound_filter(input, 5).centre_weight.pixel(9, 6)[0];
    published_centre[i] = region_filter(input, {.max_region = 4, .min_centre_drop = 0}).centre_weight.pixel(9, 6)[0];
  }
  EXPECT_LT(exact_centre[0], 0.2);
  EXPECT_NEAR(exact_centre[1], 1, 1e-3);
  EXPECT_LT(published_centre[1], 0.6);
  // In the limit, the weights are (mean Delta - Delta_q)^+ d_q.
  const FilterInput input = random_input(6, 0.2f, 1e9f);
  const std::vector<Partner> window = partners(input, 9, 6, -1, 2);
  double mean = 0, sum = 0;
  for (const Partner& q : window) mean += q.difference / 16;
  for (const Partner& q : window)
    sum += std::max(0.0, mean - q.difference) * std::max(0.0, 4 / std::sqrt(2.0) - std::hypot(q.x - 9, q.y - 6));
  const FilteredImage limit = region_filter(input, {.max_region = 4, .min_centre_drop = -1});
  EXPECT_NEAR(limit.centre_weight.pixel(9, 6)[0], mean * 4 / std::sqrt(2.0) / sum, 1e-3);
}

TEST(RegionFilter, IncrementalSumsEqualDirectOnes) {
  FilterInput input = random_input(7, 0.3f, 12);
  for (const Falloff falloff : {Falloff::kPyramid, Falloff::kCount, Falloff::kSpline, Falloff::kGaussian})
    for (const int m : {2, 3, 4, 5, 8}) {
      input.norm = m == 5 ? Norm::kEuclidean : Norm::kSum;
      const FilteredImage result = region_filter(input, {m, -1, falloff});  // always grows
      for (const auto& [x, y] : {std::pair{9, 6}, {0, 0}, {18, 12}, {0, 7}}) {
        const std::vector<Partner> window = partners(input, x, y, -((m - 1) / 2), m / 2);
        const std::vector<double> weights = published_weights(input, x, y, m, falloff);
        double colour = 0;
        for (size_t i = 0; i < window.size(); ++i)
          colour += weights[i] * input.independent.row(1, window[i].y)[window[i].x];
        EXPECT_EQ(result.region.pixel(x, y)[0], static_cast<float>(window.size()));
        EXPECT_NEAR(result.colour.pixel(x, y)[1], colour, 1e-4);
        EXPECT_NEAR(result.bound.pixel(x, y)[0], bound_of(window, weights), 1e-3);
      }
    }
}

TEST(RegionFilter, GrowsWhileTheCentreLosesWeight) {
  // Constant colour: f = 1/M, so that f*[0] is 1, 0.631, 0.225 …
  const FilterInput input = random_input(8, 0, 10);
  const auto region = [&](float drop, int most) {
    return region_filter(input, {.max_region = most, .min_centre_drop = drop}).region.pixel(9, 6)[0];
  };
  EXPECT_EQ(region(0.5f, 4), 1) << "1 to 0.63 falls by less";
  EXPECT_EQ(region(0.1f, 4), 9) << "0.63 to 0.22 falls by more, to 0.14 by less";
  EXPECT_EQ(region(0.05f, 4), 16);
  EXPECT_EQ(region(0.01f, 1), 1);
  EXPECT_NEAR(region_filter(input, {.max_region = 2}).centre_weight.pixel(9, 6)[0], 0.631, 1e-3);
  EXPECT_NEAR(region_filter(input, {.max_region = 3}).centre_weight.pixel(9, 6)[0], 0.225, 1e-3);
}

TEST(RegionFilter, StopsAtOtherClasses) {
  FilterInput input = random_input(9, 0, 10);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 10; x < kWidth; ++x) input.count.row(0, y)[x] = 20;
  const FilteredImage result = region_filter(input, {.max_region = 4, .min_centre_drop = 0});
  EXPECT_EQ(result.region.pixel(9, 6)[0], 1) << "side 2 reaches to the right";
  EXPECT_EQ(result.region.pixel(8, 6)[0], 9);
  EXPECT_EQ(result.region.pixel(7, 6)[0], 16);
  EXPECT_EQ(result.region.pixel(10, 6)[0], 4) << "side 3 reaches to the left";
}

TEST(Filters, PixelsWithoutSamplesOrNoise) {
  FilterInput input = random_input(10, 0.2f, 10);
  input.count.row(0, 6)[9] = 0;
  input.variance.row(0, 3)[3] = 0;
  const FilteredImage published = region_filter(input, {});
  EXPECT_EQ(published.region.pixel(9, 6)[0], 1);
  EXPECT_EQ(published.effective_samples.pixel(9, 6)[0], 0);
  EXPECT_TRUE(std::isinf(published.bound.pixel(9, 6)[0]));
  EXPECT_EQ(published.region.pixel(3, 3)[0], 1);
  EXPECT_EQ(published.centre_weight.pixel(3, 3)[0], 1);
  const FilteredImage exact = bound_filter(input, 5);
  EXPECT_EQ(exact.centre_weight.pixel(9, 6)[0], 0) << "it takes its neighbours'";
  EXPECT_GT(exact.effective_samples.pixel(9, 6)[0], 10);
  EXPECT_NEAR(exact.centre_weight.pixel(3, 3)[0], 1, 1e-3);
  for (const float value : exact.colour.data) EXPECT_TRUE(std::isfinite(value));
  const FilterInput empty = random_input(10, 0.2f, 0);
  const FilteredImage none = bound_filter(empty, 5);
  for (const float value : none.colour.data) EXPECT_EQ(value, 0);
  for (const float value : none.effective_samples.data) EXPECT_EQ(value, 0);
  FilterInput silent = random_input(10, 0, 10);  // no noise and no differences
  for (int y = 0; y < kHeight; ++y) std::fill_n(silent.variance.row(0, y), kWidth, 0.0f);
  for (const float value : bound_filter(silent, 5).colour.data) EXPECT_TRUE(std::isfinite(value));
}

/// The result, and its parts combined by hand.
TEST(DependentTests, CombinesByCountsOrByWorth) {
  const test::Grouped crn = test::crn_image(24, 18, 6, 1);
  test::Grouped independent = test::independent_image(24, 18, 4, 1);
  independent.counts.assign(24 * 18, 8);
  independent.counts[5] = 4;
  for (const bool paper : {false, true}) {
    DependentTestsOptions options = paper ? DependentTestsOptions::paper() : DependentTestsOptions();
    options.weights = paper ? CombinationWeights::kCounts : CombinationWeights::kEffective;
    DependentTestsStages stages;
    const EstimatorResult result = dependent_tests(crn.view(), independent.view(), options, &stages);
    EXPECT_EQ(result.estimate.data, stages.at("combined").data);
    EXPECT_EQ(stages.at("samples").data[5], 4);
    for (const int p : {5, 40, 431}) {
      const double d = stages.at("dependent").data[3 * p], f = stages.at("filtered").data[3 * p];
      const double value = result.estimate.data[3 * p];
      const double n = 6, N = independent.counts[p];
      if (paper)
        EXPECT_NEAR(value, (n * d + N * f) / (n + N), 1e-5);
      else
        EXPECT_TRUE(std::abs(value - f) <= n / (n + N) * std::abs(d - f) + 1e-6) << "worth N or more";
    }
  }
}

/// A CRN image that is too bright in all pixels, since they share their numbers, is rejected.
TEST(DependentTests, MeasuresTheErrorOfTheCrnImage) {
  test::Grouped crn = test::crn_image(48, 40, 6, 1);
  const test::Grouped independent = test::independent_image(48, 40, 12, 1);
  for (float& value : crn.data) value *= 1.5f;
  const auto mean_of = [](const EstimatorResult& result) {
    return std::accumulate(result.estimate.data.begin(), result.estimate.data.end(), 0.0) /
           static_cast<double>(result.estimate.data.size());
  };
  DependentTestsOptions by_worth;
  by_worth.weights = CombinationWeights::kEffective;
  const double measured = mean_of(dependent_tests(crn.view(), independent.view()));
  const double worth = mean_of(dependent_tests(crn.view(), independent.view(), by_worth));
  DependentTestsStages stages;
  dependent_tests(crn.view(), independent.view(), {}, &stages);
  double truth = 0;
  for (const float value : stages.at("independent").data) truth += value / static_cast<double>(48 * 40 * 3);
  EXPECT_LT(std::abs(measured - truth), 0.3 * std::abs(worth - truth));
}

/// A pixel without samples of its own is combined by the effective number of samples of the filtered image.
TEST(DependentTests, PixelsWithoutSamplesAreCombinedByWorth) {
  const test::Grouped crn = test::crn_image(24, 18, 6, 1);
  test::Grouped independent = test::independent_image(24, 18, 4, 1);
  independent.counts.assign(24 * 18, 8);
  independent.counts[100] = 0;
  for (int i = 0; i < 12; ++i) independent.data[100 * 12 + i] = 0;
  DependentTestsOptions by_worth;
  by_worth.weights = CombinationWeights::kEffective;
  const EstimatorResult measured = dependent_tests(crn.view(), independent.view());
  const EstimatorResult worth = dependent_tests(crn.view(), independent.view(), by_worth);
  EXPECT_EQ(measured.estimate.data[300], worth.estimate.data[300]);
  EXPECT_NE(measured.estimate.data[303], worth.estimate.data[303]);
}

TEST(DependentTests, WithoutIndependentSamplesItIsTheCrnImage) {
  const test::Grouped crn = test::crn_image(12, 9, 3, 2);
  test::Grouped independent = test::constant_image(12, 9, 1, 0);
  independent.counts.assign(12 * 9, 0);
  for (const DependentTestsOptions& options : {DependentTestsOptions(), DependentTestsOptions::paper()}) {
    DependentTestsStages stages;
    const EstimatorResult result = dependent_tests(crn.view(), independent.view(), options, &stages);
    EXPECT_EQ(result.estimate.data, stages.at("dependent").data);
  }
}

/// An all-black CRN image claims that all pixels are alike.
TEST(DependentTests, TheGuardKeepsWhatTheCrnImageDoesNotSee) {
  const test::Grouped black = test::constant_image(30, 30, 2, 0);
  const test::Grouped independent = test::independent_image(30, 30, 4, 3);
  DependentTestsStages guarded, trusting;
  DependentTestsOptions options;
  dependent_tests(black.view(), independent.view(), options, &guarded);
  options.guard = 0;
  dependent_tests(black.view(), independent.view(), options, &trusting);
  test::Grouped dim = test::crn_image(30, 30, 4, 3);
  for (float& value : dim.data) value *= 0.1f;
  DependentTestsStages with, without;
  dependent_tests(dim.view(), independent.view(), {}, &with);
  dependent_tests(dim.view(), independent.view(), options, &without);
  EXPECT_GT(with.at("centre_weight").pixel(10, 10)[0], without.at("centre_weight").pixel(10, 10)[0]);
}

TEST(DependentTests, IsUnbiasedForEqualPixels) {
  test::Grouped crn = test::constant_image(20, 20, 2, 1), independent = test::constant_image(20, 20, 2, 0);
  for (size_t i = 0; i < crn.data.size(); ++i) crn.data[i] = i / 3 % 2 ? 0.5f : 1.5f;
  for (size_t i = 0; i < independent.data.size(); ++i) independent.data[i] = 1 + test::noise(3, i, 0);
  const EstimatorResult result = dependent_tests(crn.view(), independent.view());
  double sum = 0;
  for (const float value : result.estimate.data) sum += value;
  EXPECT_NEAR(sum / static_cast<double>(result.estimate.data.size()), 1, 0.02);
}

TEST(DependentTests, HasTheSameBitsForAnyNumberOfThreads) {
  const test::Grouped crn = test::crn_image(45, 31, 4, 4), independent = test::independent_image(45, 31, 4, 4);
  for (const DependentTestsOptions& options : {DependentTestsOptions(), DependentTestsOptions::paper()}) {
    std::vector<float> first;
    for (const int threads : {1, 2, 7}) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      const std::vector<float> data = dependent_tests(crn.view(), independent.view(), options).estimate.data;
      if (first.empty()) first = data;
      EXPECT_EQ(data, first);
    }
  }
}

/// Rows beyond the halo change nothing.
TEST(DependentTests, LooksNoFartherThanItsReach) {
  const test::Grouped crn = test::crn_image(20, 90, 3, 5);
  const test::Grouped independent = test::independent_image(20, 90, 3, 5);
  for (const DependentTestsOptions& options : {DependentTestsOptions(), DependentTestsOptions::paper()}) {
    const EstimatorResult whole = dependent_tests(crn.view(), independent.view(), options);
    const int first = 45 - dependent_tests_halo(options), rows = 2 * dependent_tests_halo(options) + 1;
    const auto part = [&](const test::Grouped& image) {
      return GroupedImage{20, rows, image.groups, image.view().pixel(0, first)};
    };
    const EstimatorResult band = dependent_tests(part(crn), part(independent), options);
    for (int x = 0; x < 20; ++x) EXPECT_EQ(band.estimate.pixel(x, 45 - first)[0], whole.estimate.pixel(x, 45)[0]);
  }
}

/// With stages, images are processed as a whole.
TEST(DependentTests, LargeImagesAreTakenInBands) {
  constexpr int width = 2500, height = 150;
  ASSERT_GT(width * height * kDependentTestsBytesPerPixel, kDependentTestsBand);
  test::Grouped crn = test::crn_image(width, height, 2, 5);
  const test::Grouped independent = test::independent_image(width, height, 2, 5);
  crn.pixel(7, 70)[0] = std::numeric_limits<float>::quiet_NaN();
  for (const DependentTestsOptions& options : {DependentTestsOptions(), DependentTestsOptions::paper()}) {
    DependentTestsStages stages;
    const EstimatorResult whole = dependent_tests(crn.view(), independent.view(), options, &stages);
    const EstimatorResult in_bands = dependent_tests(crn.view(), independent.view(), options);
    EXPECT_EQ(in_bands.estimate.data, whole.estimate.data);
    EXPECT_EQ(in_bands.nonfinite_pixels, 1);
  }
}

TEST(DependentTests, PixelsThatAreNotFiniteAreLeftOut) {
  test::Grouped crn = test::crn_image(20, 20, 3, 6), independent = test::independent_image(20, 20, 3, 6);
  crn.pixel(4, 4)[0] = std::numeric_limits<float>::quiet_NaN();
  independent.pixel(9, 9)[1] = std::numeric_limits<float>::infinity();
  for (const DependentTestsOptions& options : {DependentTestsOptions(), DependentTestsOptions::paper()}) {
    const EstimatorResult result = dependent_tests(crn.view(), independent.view(), options);
    EXPECT_EQ(result.nonfinite_pixels, 2);
    for (const float value : result.estimate.data) EXPECT_TRUE(std::isfinite(value));
  }
}

TEST(DependentTests, SaysWhatIsWrong) {
  const test::Grouped crn = test::crn_image(8, 8, 2, 1), other = test::independent_image(9, 8, 2, 1);
  EXPECT_TRUE(contains(message_of([&] { dependent_tests(crn.view(), other.view()); }), "must have the same size"));
  const test::Grouped one = test::crn_image(8, 8, 1, 1);
  EXPECT_TRUE(contains(message_of([&] { dependent_tests(one.view(), crn.view()); }), "at least 2 are needed"));
  DependentTestsOptions options;
  options.regions.max_region = 0;
  EXPECT_THROW(dependent_tests(crn.view(), crn.view(), options), Error);
}

}  // namespace
}  // namespace covary::dependent_tests_test
