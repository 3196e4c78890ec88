// SPDX-License-Identifier: Apache-2.0
// Errors of images whose relMSE is known, against two simulated references of few samples. The samples of a pixel of
// brightness b are b / 0.1 with probability 0.1 and otherwise 0, so that references of 8 samples are black in 18 % of
// the pixels (0.43 of each). N = 64 x 48 pixels, 12 pairs of references with fixed seeds. A correct mean deviates by 4
// standard errors of its own with a probability below 1e-4.
#include "denoising/denoised_references.h"

#include <gtest/gtest.h>

#include <cmath>

#include "estimators/test_images.h"
#include "metrics/metrics.h"

namespace covary::denoised_references_test {
namespace {

constexpr int kWidth = 64, kHeight = 48, kPairs = 12;
constexpr float kLit = 0.1f;  // part of the samples that find light

Image truth() {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] = (x < 20 ? 0.05f : 1.0f) * static_cast<float>(test::expected(x, y, c));
  return image;
}

Image reference(int samples, uint64_t seed) {
  Image image = truth();
  for (size_t p = 0; p < image.data.size() / 3; ++p) {
    int lit = 0;
    for (int s = 0; s < samples; ++s) lit += test::noise(seed, p, s) + 0.5f < kLit;
    for (size_t c = 0; c < 3; ++c) image.data[3 * p + c] *= static_cast<float>(lit) / (kLit * samples);
  }
  return image;
}

/// The truth times 1 + strength * noise of [-1, 1).
Image image_with_error(float strength) {
  Image image = truth();
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] *= 1 + 2 * strength * test::noise(99, i, 0);
  return image;
}

struct Measured {
  double mean = 0, standard_error = 0, largest = 0, expected_error = 0;
};

Measured measure(const Image& image, int samples, bool denoised) {
  Measured m;
  double squares = 0;
  for (uint64_t pair = 0; pair < kPairs; ++pair) {
    const std::vector<Image> references = {reference(samples, 2 * pair), reference(samples, 2 * pair + 1)};
    const std::vector<Image> denominators = denoised ? denoised_references(references) : std::vector<Image>();
    const MetricResult result = compute_metric(Metric::kRelMse, image, references, false, denominators);
    m.mean += result.value / kPairs, squares += result.value * result.value / kPairs;
    m.expected_error += result.reference_error * result.reference_error / kPairs;
  }
  m.standard_error = std::sqrt((squares - m.mean * m.mean) / (kPairs - 1));
  m.expected_error = std::sqrt(m.expected_error / kPairs);
  return m;
}

double true_error(const Image& image) { return compute_metric(Metric::kRelMse, image, std::vector{truth()}).value; }

TEST(DenoisedReferences, ErrorsAgainstNoisyReferencesAreUnbiased) {
  for (const float strength : {0.005f, 0.1f}) {
    const Image image = image_with_error(strength);
    const double expected = true_error(image);
    for (const int samples : {8, 48, 512}) {
      const Measured m = measure(image, samples, true);
      EXPECT_NEAR(m.mean, expected, 4 * m.standard_error) << strength << " against " << samples << " samples";
      EXPECT_LT(m.expected_error, 2 * m.standard_error) << samples;
      EXPECT_GT(m.expected_error, 0.5 * m.standard_error) << samples;
    }
  }
}

TEST(DenoisedReferences, TheirOwnNoiseWouldCountAsError) {
  const Image image = image_with_error(0.005f);
  const Measured own = measure(image, 8, false);
  EXPECT_GT(own.mean, 100 * true_error(image)) << "the test sees the bias";
  EXPECT_GT(own.mean, 10 * own.standard_error);
}

TEST(DenoisedReferences, TheOrderOfTwoMethodsIsKept) {
  const Image better = image_with_error(0.1f), worse = image_with_error(0.13f);
  for (const int samples : {48, 512}) {
    const double ratio = measure(worse, samples, true).mean / measure(better, samples, true).mean;
    EXPECT_NEAR(ratio, true_error(worse) / true_error(better), 0.25) << samples;
  }
}

TEST(DenoisedReferences, NothingIsMadeOfOne) { EXPECT_TRUE(denoised_references(std::vector{truth()}).empty()); }

TEST(DenoisedReferences, EachIsMadeOfItsOwnValues) {
  const std::vector<Image> references = {reference(48, 1), reference(48, 2)};
  const std::vector<Image> denoised = denoised_references(references);
  ASSERT_EQ(denoised.size(), 2u);
  const std::vector<Image> swapped = denoised_references(std::vector{references[1], references[0]});
  EXPECT_EQ(denoised[0].data, swapped[1].data);
  // Less noise than the reference, and noise of its own: the differences to the truth do not agree.
  double noise = 0, left = 0, common = 0;
  const Image clean = truth();
  for (size_t i = 0; i < clean.data.size(); ++i) {
    const double weight = 1 / (clean.data[i] * clean.data[i] + 0.01);
    noise += weight * std::pow(references[0].data[i] - clean.data[i], 2);
    left += weight * std::pow(denoised[0].data[i] - clean.data[i], 2);
    common += weight * (references[0].data[i] - clean.data[i]) * (denoised[1].data[i] - clean.data[i]);
  }
  EXPECT_LT(left, 0.5 * noise);
  EXPECT_LT(std::abs(common), 0.05 * noise);
}

TEST(DenoisedReferences, BandsMeetWithoutASeam) {
  // Taller than one band: the same rows at another place, up to rounding.
  const int tall = 300;
  std::vector<Image> references(2, Image(16, tall, 3)), lower(2, Image(16, tall - 40, 3));
  for (int r = 0; r < 2; ++r) {
    for (size_t i = 0; i < references[r].data.size(); ++i)
      references[r].data[i] = 1 + 0.5f * test::noise(7 + static_cast<uint64_t>(r), i, 0);
    std::copy(references[r].pixel(0, 40), references[r].pixel(0, 40) + lower[r].data.size(), lower[r].data.begin());
  }
  const std::vector<Image> whole = denoised_references(references), part = denoised_references(lower);
  for (int y = 60; y < tall; ++y)  // beyond the reach of the cut
    for (int i = 0; i < 48; ++i) ASSERT_NEAR(whole[0].pixel(0, y)[i], part[0].pixel(0, y - 40)[i], 1e-4f) << y;
}

}  // namespace
}  // namespace covary::denoised_references_test
