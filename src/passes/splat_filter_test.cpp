// SPDX-License-Identifier: Apache-2.0
// Each splat goes to one pixel, and on average each pixel gets what the filter prescribes.
#include "passes/splat_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "passes/render_pass.h"

namespace covary {
namespace {

constexpr FilterSettings kBox{FilterKind::kBox, 0.5f, 0}, kTent{FilterKind::kTent, 1, 0},
    kGaussian{FilterKind::kGaussian, 2, 0.5f}, kWideTent{FilterKind::kTent, 2.5f, 0},
    kWideGaussian{FilterKind::kGaussian, 3.7f, 0.925f}, kWideBox{FilterKind::kBox, 1.25f, 0};
const FilterSettings kMitchell = lobed(LobedFilter::mitchell(1.0f / 3, 1.0f / 3)),
                     kLanczos = lobed(LobedFilter::lanczos(3));
const FilterSettings kAll[] = {kBox, kTent, kGaussian, kWideTent, kWideGaussian, kWideBox, kMitchell, kLanczos};

PathRandom random_of(uint64_t i) { return {Sampling::kIndependent, 3, 0, 0, i}; }

TEST(SplatFilter, ABoxIsThePixelItself) {
  const SplatFilter box(kBox);
  for (uint64_t i = 0; i < 10000; ++i) {
    const Vec2 u = random_of(i).get_2d(0, Event::kPixel), p{u.x * 70 - 10, u.y * 40 - 10};
    const SplatPixel pixel = box.pixel(p, random_of(i).get_2d(1, Event::kPixel));
    ASSERT_EQ(pixel.x, std::floor(p.x));
    ASSERT_EQ(pixel.y, std::floor(p.y));
    ASSERT_EQ(pixel.weight, 1);
  }
  EXPECT_EQ(box.pixel({3, 4}, {0.5f, 0.5f}).x, 3);  // a corner belongs to the pixel to its lower right
  EXPECT_EQ(box.pixel({3, 4}, {0.5f, 0.5f}).y, 4);
}

TEST(SplatFilter, WeightsSumToOneOverTheFilm) {
  for (const FilterSettings& filter : kAll) {
    if (filter.kind == FilterKind::kLobed) continue;  // their weights have signs that differ from pixel to pixel
    const SplatFilter splat(filter);
    double sum = 0;
    constexpr int kSteps = 200;  // per pixel
    for (int i = 0; i < kSteps; ++i)
      for (int k = 0; k < kSteps; ++k)
        sum += splat.pixel({3 + (i + 0.5f) / kSteps, 7 + (k + 0.5f) / kSteps}, {0.3f, 0.8f}).weight;
    EXPECT_NEAR(sum / (kSteps * kSteps), 1, 1e-3) << static_cast<int>(filter.kind) << " " << filter.radius;
  }
  // A tent that reaches to its neighbours' centres sums to 1 everywhere.
  for (uint64_t i = 0; i < 1000; ++i)
    ASSERT_NEAR(SplatFilter(kTent).pixel(random_of(i).get_2d(0, Event::kPixel), {0.1f, 0.9f}).weight, 1, 1e-6);
}

// Relative to a pixel's centre, its splats from uniform positions are distributed like its camera samples.
TEST(SplatFilter, APixelGetsSplatsWhereItsCameraSamplesLie) {
  constexpr int kN = 400000, kBins = 24;
  for (const FilterSettings& filter : kAll) {
    const float reach = filter.radius, width = 2 * reach / kBins;
    std::vector<double> splats(kBins), squares(kBins), samples(kBins), sample_squares(kBins);
    const SplatFilter splat(filter);
    const auto bin = [&](float x) { return std::clamp(static_cast<int>((x - 5.5f + reach) / width), 0, kBins - 1); };
    const double area = (2 * reach + 2) * (2 * reach + 2);
    for (uint64_t i = 0; i < kN; ++i) {
      const Vec2 u = random_of(i).get_2d(0, Event::kPixel);
      const Vec2 p{5.5f + (u.x - 0.5f) * (2 * reach + 2), 6.5f + (u.y - 0.5f) * (2 * reach + 2)};
      const SplatPixel pixel = splat.pixel(p, random_of(i).get_2d(1, Event::kPixel));
      if (pixel.x == 5 && pixel.y == 6) {
        const double value = pixel.weight * area;
        splats[bin(p.x)] += value / kN, squares[bin(p.x)] += value * value / kN;
      }
      const float weight = film_weight(filter, random_of(i + kN));
      samples[bin(film_position(filter, 5, 6, random_of(i + kN)).x)] += weight / kN;
      sample_squares[bin(film_position(filter, 5, 6, random_of(i + kN)).x)] += weight * weight / kN;
    }
    for (int b = 0; b < kBins; ++b) {
      if (sample_squares[b] * kN < 100) continue;  // too few in the tails of a Gaussian to measure a spread
      const double variance = (squares[b] + sample_squares[b]) / kN;
      EXPECT_LT(std::abs(splats[b] - samples[b]), 5 * std::sqrt(variance)) << static_cast<int>(filter.kind) << " " << b;
    }
  }
}

TEST(SplatFilter, BesideTheFrameAndFarAway) {
  const SplatFilter gaussian(kGaussian);
  bool inside = false;
  for (uint64_t i = 0; i < 100; ++i) inside |= gaussian.pixel({-0.4f, 3}, random_of(i).get_2d(0, Event::kPixel)).x >= 0;
  EXPECT_TRUE(inside) << "within the radius of a pixel of the frame";
  for (const float far : {1e9f, -1e30f, std::numeric_limits<float>::infinity(), std::nanf("")})
    EXPECT_EQ(gaussian.pixel({far, 3}, {0.5f, 0.5f}).weight, 0);
  const SplatFilter narrow({FilterKind::kTent, 0.25f, 0});
  EXPECT_EQ(narrow.pixel({3.5f, 4}, {0.5f, 0.5f}).weight, 0) << "between the pixels' centres";
  EXPECT_GT(narrow.pixel({3.5f, 4.4f}, {0.5f, 0.5f}).weight, 0);
}

}  // namespace
}  // namespace covary
