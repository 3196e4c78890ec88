// SPDX-License-Identifier: Apache-2.0
// The split of errors for renders of known bias and variance: values, coverage of intervals, planted mistakes.
#include "lab/error_split.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random.h"
#include "metrics/metrics.h"
#include "support/files.h"

namespace covary::lab {
namespace {

using test_support::contains, test_support::message_of;

/// A synthetic scene: brightness 0.5 to 1.5 across the image; noise grows with brightness and differs per pixel.
struct Synthetic {
  int size = 24;
  double bias = 0;     ///< added to every value
  double sigma = 0.2;  ///< standard deviation of one render, times brightness
  double clamp = 1e9;  ///< values are clamped to this

  double clean(size_t i) const { return 0.5 + static_cast<double>(i / 3 % size) / size; }
  /// Uniform noise of the given stream; equal streams have equal noise.
  static double noise(uint64_t stream, size_t i) {
    return std::sqrt(12.0) * (PathRandom(Sampling::kIndependent, stream, 0, i, 0).get_1d(0, Event::kPixel) - 0.5);
  }
  Image render(uint64_t stream) const {
    Image image(size, size, 3);
    for (size_t i = 0; i < image.data.size(); ++i)
      image.data[i] = static_cast<float>(std::min(clamp, clean(i) * (1 + sigma * noise(stream, i))) + bias);
    return image;
  }
  std::vector<Image> references(uint64_t stream, double reference_sigma = 0.1) const {
    Synthetic exact{size, 0, reference_sigma};
    return {exact.render(stream), exact.render(stream + 1)};
  }
  /// Mean over pixels of (sigma clean)^2.
  double variance() const {
    double total = 0;
    for (int x = 0; x < size; ++x) total += std::pow(sigma * clean(static_cast<size_t>(x) * 3), 2) / size;
    return total;
  }
};

ErrorSplit split_of(const std::vector<Image>& renders, const std::vector<Image>& references) {
  return split_error(renders, references);
}

std::vector<Image> renders_of(const Synthetic& scene, int n, uint64_t first_stream) {
  std::vector<Image> renders;
  for (int s = 0; s < n; ++s) renders.push_back(scene.render(first_stream + s));
  return renders;
}

TEST(ErrorSplit, WorkedOutByHand) {
  // One pixel, two renders: F1 = 2, F2 = 4, R1 = 1, R2 = 3 in all channels; weights 1 and 1/4.01.
  const auto pixel = [](float v) {
    Image image(1, 1, 3);
    image.data = {v, v, v};
    return image;
  };
  const ErrorSplit split = split_of({pixel(2), pixel(4)}, {pixel(1), pixel(3)});
  // (1)(-1) = -1 and (3)(1) = 3; their mean 1; variance 2; pairs (F1 - R1)(F2 - R2) = 1, (F2 - R1)(F1 - R2) = -3.
  EXPECT_EQ(split.absolute.of_render, (std::vector<double>{-1, 3}));
  EXPECT_DOUBLE_EQ(split.absolute.error.value, 1);
  EXPECT_DOUBLE_EQ(split.absolute.variance.value, 2);
  EXPECT_DOUBLE_EQ(split.absolute.squared_bias.value, -1);
  EXPECT_NEAR(split.relative.variance.value, 2 / 4.01, 1e-9);
  EXPECT_DOUBLE_EQ(split.mean_ratio.value, 1.5);
  EXPECT_NEAR(split.reference_error, 1 / 4.01, 1e-9);
  EXPECT_TRUE(std::isnan(split.absolute.variance.low));  // an interval needs three renders
}

TEST(ErrorSplit, AgreesWithTheMetrics) {
  const Synthetic scene;
  const std::vector<Image> references = scene.references(1);
  const ErrorSplit split = split_of({scene.render(7)}, references);
  EXPECT_NEAR(split.relative.error.value, compute_metric(Metric::kRelMse, scene.render(7), references).value, 1e-12);
  EXPECT_NEAR(split.absolute.error.value, compute_metric(Metric::kMse, scene.render(7), references).value, 1e-12);
  EXPECT_TRUE(std::isnan(split.relative.squared_bias.value));
  EXPECT_TRUE(std::isnan(split.relative.error.low));
}

// The split of MSE; for relMSE the weights contain the references' noise, too, which only matters if references are
// bad. N = 300 experiments of K = 8 renders. Each interval must contain the true value in 95 % of them: binomial
// standard deviation 1.26 %. alpha = 1e-5 in total (six comparisons, |z| < 4.8): within 6 %; a true coverage of 87 % or
// less is detected with power 0.84. Means over the experiments: relative standard deviation of the variance 0.9 /
// sqrt(7 * 1728 * 300) = 0.05 %; of the squared bias with v = 0.043 and r = 0.011: sqrt(2 (v/K + r)^2 + 4 b^2 (v/K +
// r)) / sqrt(1728 * 300) < 3.7e-5.
TEST(ErrorSplit, IntervalsHoldTheTruth) {
  constexpr int kExperiments = 300, kRenders = 8;
  for (const double bias : {0.0, 0.05}) {
    Synthetic scene;
    scene.bias = bias;
    int error_held = 0, bias_held = 0, variance_held = 0;
    double mean_bias = 0, mean_variance = 0;
    const auto holds = [](const Estimate& e, double truth) { return e.low <= truth && truth <= e.high; };
    for (uint64_t i = 0; i < kExperiments; ++i) {
      const ErrorSplit split = split_of(renders_of(scene, kRenders, 1000 * i), scene.references(1000 * i + 500));
      error_held += holds(split.absolute.error, scene.variance() + bias * bias);
      bias_held += holds(split.absolute.squared_bias, bias * bias);
      variance_held += holds(split.absolute.variance, scene.variance());
      mean_bias += split.absolute.squared_bias.value / kExperiments;
      mean_variance += split.absolute.variance.value / kExperiments;
    }
    EXPECT_NEAR(error_held / double{kExperiments}, 0.95, 0.06) << bias;
    EXPECT_NEAR(bias_held / double{kExperiments}, 0.95, 0.06) << bias;
    EXPECT_NEAR(variance_held / double{kExperiments}, 0.95, 0.06) << bias;
    EXPECT_NEAR(mean_variance, scene.variance(), 0.003 * scene.variance()) << bias;
    EXPECT_NEAR(mean_bias, bias * bias, 1.7e-4) << bias;
  }
}

TEST(ErrorSplit, NothingIsSuspiciousWhereAllIsRight) {
  const Synthetic scene;
  for (uint64_t i = 0; i < 50; ++i)
    EXPECT_TRUE(suspicions(split_of(renders_of(scene, 4, 1000 * i), scene.references(1000 * i + 500)), true).empty());
}

/// The suspicions for K = 4 renders, some of which the test replaces.
std::string sentences(const std::vector<Image>& renders, const std::vector<Image>& references) {
  std::string all;
  for (const std::string& text : suspicions(split_of(renders, references), true)) all += text + "\n";
  return all;
}

TEST(ErrorSplit, FindsASeedOfARenderInAReference) {
  const Synthetic scene;
  const std::vector<Image> references = scene.references(500);
  std::vector<Image> renders = renders_of(scene, 4, 0);
  renders[2] = scene.render(501);  // the noise of the second reference
  EXPECT_TRUE(contains(sentences(renders, references), "render 3 leans to the second reference"));
}

TEST(ErrorSplit, FindsReferencesOfTheRendersSeeds) {
  const Synthetic scene;
  // The references are means of the renders themselves.
  const std::vector<Image> renders = renders_of(scene, 4, 0);
  std::vector<Image> references{renders[0], renders[2]};
  for (size_t r = 0; r < 2; ++r)
    for (size_t i = 0; i < references[r].data.size(); ++i)
      references[r].data[i] = 0.5f * (references[r].data[i] + renders[2 * r + 1].data[i]);
  EXPECT_TRUE(contains(sentences(renders, references), "leans to the"));
  // One common seed: nothing leans, but the error becomes negative.
  EXPECT_TRUE(contains(sentences(renders_of(Synthetic{24, 0, 0.05}, 3, 500), scene.references(500)), "leans to the"));
}

TEST(ErrorSplit, FindsEqualReferences) {
  const Synthetic scene;
  const Image reference = scene.references(500)[0];
  EXPECT_TRUE(
      contains(sentences(renders_of(scene, 4, 0), {reference, reference}), "both references are the same image"));
}

TEST(ErrorSplit, FindsTheReferenceOfAnotherScene) {
  const Synthetic scene;
  std::vector<Image> references = scene.references(500);
  for (Image& image : references) std::reverse(image.data.begin(), image.data.end());
  EXPECT_TRUE(contains(sentences(renders_of(scene, 4, 0), references), "of the error is the same in all renders"));
}

// Clamping at 1.6 loses 0.9 % of the light of this scene.
TEST(ErrorSplit, FindsAOneSidedClamp) {
  Synthetic scene;
  const std::vector<Image> references = scene.references(500);
  EXPECT_EQ(sentences(renders_of(scene, 4, 0), references), "");
  scene.clamp = 1.4;
  EXPECT_TRUE(contains(sentences(renders_of(scene, 4, 0), references), "something is lost"));
}

// Three renders of one pixel whose brightness varies by 2 %, 2000 times: chance alone accuses 1 in 1000. Five standard
// errors would be exceeded in 3.8 % of them (Student's distribution with two degrees of freedom).
TEST(ErrorSplit, FewRendersAccuseNobody) {
  Image reference(1, 1, 3);
  reference.data = {1, 1, 1};
  int accused = 0;
  for (uint64_t i = 0; i < 2000; ++i) {
    std::vector<Image> renders(3, reference);
    for (size_t s = 0; s < 3; ++s)
      for (float& value : renders[s].data) value += 0.02f * static_cast<float>(Synthetic::noise(3 * i + s, 0));
    accused += contains(sentences(renders, {reference}), "the image mean is");
  }
  EXPECT_LE(accused, 10) << "binomial, mean 2: probability 1e-5";
}

TEST(ErrorSplit, LeavesOutNonFinitePixelsOfAnyRender) {
  const Synthetic scene;
  std::vector<Image> renders = renders_of(scene, 3, 0);
  renders[1].data[5] = std::numeric_limits<float>::quiet_NaN();
  renders[2].data[0] = std::numeric_limits<float>::infinity();
  const ErrorSplit split = split_of(renders, scene.references(500));
  EXPECT_EQ(split.n_non_finite, 2u);
  EXPECT_EQ(split.n_pixels, 24u * 24 - 2);
  EXPECT_TRUE(std::isfinite(split.relative.squared_bias.value));
  EXPECT_TRUE(contains(message_of([&] { split_of({Image(3, 4, 3)}, {Image(4, 3, 3)}); }),
                       "the image has 3 x 4 pixels, the reference 4 x 3"));
}

}  // namespace
}  // namespace covary::lab
