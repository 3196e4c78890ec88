// SPDX-License-Identifier: Apache-2.0
// IICV against the double-precision reference; identities; degenerate inputs; determinism.
#include "estimators/iicv.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <limits>
#include <tuple>

#include "core/error.h"
#include "estimators/compare_with_reference.h"
#include "estimators/control_variates.h"
#include "estimators/reference_control_variates.h"
#include "estimators/reference_residual_correction.h"
#include "estimators/test_images.h"
#include "support/files.h"

namespace covary {
namespace {

using reference::compare, reference::Difference, reference::neighbours, reference::pilot_of;
using reference::Rgb, reference::RgbImage;
using test_support::message_of;

/// Both forms of the system (k below and above the number of rows), shared and per-channel coefficients, symmetric or
/// not, several numbers of groups.
TEST(Iicv, AgreesWithTheReference) {
  struct Case {
    int k, window, groups;
    bool shared, symmetric;
  };
  for (const Case& c : {Case{25, 11, 12, true, true}, Case{25, 11, 12, false, true}, Case{25, 11, 12, true, false},
                        Case{6, 7, 12, false, false}, Case{40, 11, 12, true, true}, Case{50, 21, 4, true, true},
                        Case{25, 11, 24, false, true}, Case{10, 5, 3, true, true}}) {
    const test::Grouped crn = test::crn_image(41, 27, c.groups, 1),
                        independent = test::independent_image(41, 27, c.groups, 2);
    IicvOptions options = IicvOptions::paper();
    options.k = c.k;
    options.window = c.window;
    options.shared_coefficients = c.shared;
    if (!c.symmetric) options.penalty = Penalty::kAsymmetric;
    options.std_error = true;
    const EstimatorResult fast = iicv(crn.view(), independent.view(), options);
    const RgbImage error = pilot_of(crn.view(), independent.view(), 11);
    const Difference d = compare(fast, crn.view(), independent.view(), error, c.k, c.window,
                                 {c.shared, c.symmetric, 0, kSmallestPenalty});
    EXPECT_LT(d.estimate, 2e-3) << "k " << c.k << " shared " << c.shared << " groups " << c.groups;
    EXPECT_LT(d.std_error, 2e-3) << "k " << c.k << " shared " << c.shared << " groups " << c.groups;
  }
}

TEST(Iicv, SampleVariancesAsPenaltiesAgreeWithTheReference) {
  const test::Grouped crn = test::crn_image(41, 27, 12, 1), independent = test::independent_image(41, 27, 12, 2);
  const GroupedImage independent_view = independent.view();
  IicvOptions options = IicvOptions::paper();
  reference::Settings settings{true, true, 0, kSmallestPenalty};

  options.penalty = Penalty::kSample;
  const RgbImage variance = reference::map_pixels(
      independent_view, [&](int x, int y) { return reference::variance_of_mean(independent_view, x, y); });
  EXPECT_LT(
      compare(iicv(crn.view(), independent.view(), options), crn.view(), independent.view(), variance, 25, 11, settings)
          .estimate,
      2e-3);
}

/// The mean constraint and the mixed penalty.
TEST(Iicv, ConservationAgreesWithTheReference) {
  const test::Grouped crn = test::crn_image(41, 27, 12, 1), independent = test::independent_image(41, 27, 12, 2);
  const RgbImage error = pilot_of(crn.view(), independent.view(), 11);
  for (const auto& [k, shared] : {std::pair{25, true}, {25, false}, {50, true}, {8, false}}) {
    IicvOptions options = IicvOptions::paper();
    options.mean_constraint = 10;
    options.sample_fraction = 0.25f;
    options.k = k;
    options.shared_coefficients = shared;
    options.std_error = true;
    const Difference d = compare(iicv(crn.view(), independent.view(), options), crn.view(), independent.view(), error,
                                 k, 11, {shared, true, 0, kSmallestPenalty, 10, 0.25});
    EXPECT_LT(d.estimate, 3e-3) << "k " << k << " shared " << shared;
    EXPECT_LT(d.std_error, 3e-3) << "k " << k << " shared " << shared;
  }
}

/// Rare light: a CRN image that misses it in whole regions, entirely or except for a trace.
struct RareLight {
  static constexpr int width = 41, height = 27;
  test::Grouped crn, independent;
  /// `trace`: light from another source in the black regions, relative to all light. One in `rarity` groups of the
  /// independent image has found the light.
  explicit RareLight(uint64_t seed, float trace = 0, float rarity = 3)
      : crn(test::crn_image(width, height, 12, seed)),
        independent(test::independent_image(width, height, 12, seed + 1)) {
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (int t = 0; t < 12; ++t) {
          const bool found = test::noise(seed + 9, static_cast<uint64_t>(y) * width + x, t) + 0.5f < 1 / rarity;
          for (int c = 0; c < 3; ++c) {
            if (is_black(x)) crn.pixel(x, y)[3 * t + c] *= trace;
            if (is_dim(x)) crn.pixel(x, y)[3 * t + c] *= 0.02f;
            if (is_black(x) || is_dim(x)) independent.pixel(x, y)[3 * t + c] *= found ? rarity : trace;
          }
        }
  }
  static bool is_black(int x) { return x < 15; }
  static bool is_dim(int x) { return x >= 26; }
};

TEST(Iicv, MissingLightAgreesWithTheReference) {
  const RareLight in(1);
  const RgbImage error = pilot_of(in.crn.view(), in.independent.view(), 11);
  for (const auto& [k, shared, mean_constraint] :
       {std::tuple{25, true, 30.0f}, {25, false, 30.0f}, {50, true, 10.0f}, {8, false, 10.0f}, {25, true, 0.0f}}) {
    IicvOptions options = IicvOptions::paper();
    options.mean_constraint = mean_constraint;
    options.sample_fraction = 0.5f;
    options.k = k;
    options.shared_coefficients = shared;
    options.std_error = true;
    const Difference d =
        compare(iicv(in.crn.view(), in.independent.view(), options), in.crn.view(), in.independent.view(), error, k, 11,
                {shared, true, 0, kSmallestPenalty, mean_constraint, 0.5});
    EXPECT_LT(d.estimate, 3e-3) << "k " << k << " shared " << shared << " mean_constraint " << mean_constraint;
    EXPECT_LT(d.std_error, 3e-3) << "k " << k << " shared " << shared << " mean_constraint " << mean_constraint;
  }
}

/// Where the CRN image is black it has no variance either, but it is not certain.
TEST(Iicv, FindsTheLightThatTheCrnImageMisses) {
  double error = 0, of_independent = 0, predicted = 0;
  for (const uint64_t seed : {1, 5, 9}) {
    const RareLight in(seed);
    IicvOptions options;
    options.std_error = true;
    const EstimatorResult result = iicv(in.crn.view(), in.independent.view(), options);
    for (int y = 0; y < 27; ++y)
      for (int x = 0; x < 41; ++x)
        for (int c = 0; c < 3; ++c) {
          ASSERT_GT(result.std_error.pixel(x, y)[c], 0) << x << ", " << y;
          if (!RareLight::is_black(x) && !RareLight::is_dim(x)) continue;
          const double truth = test::expected(x, y, c), h = reference::mean(in.independent.view(), x, y)[c];
          error += std::pow(result.estimate.pixel(x, y)[c] - truth, 2);
          of_independent += std::pow(h - truth, 2);
          predicted += std::pow(result.std_error.pixel(x, y)[c], 2);
        }
  }
  EXPECT_LT(error, 0.25 * of_independent);
  EXPECT_GT(predicted, 0.5 * error);
  EXPECT_LT(predicted, 4 * error);
}

/// A trace of light from another lamp leaves an equally small variance, and no certainty either.
TEST(Iicv, FindsTheLightThatTheCrnImageMissesButForATrace) {
  for (const float trace : {0.0f, 1e-5f, 1e-3f, 1e-2f}) {
    int dark = 0, certain = 0, all = 0;
    for (const uint64_t seed : {1, 5, 9}) {
      const RareLight in(seed, trace, 50);
      IicvOptions options;
      options.std_error = true;
      const EstimatorResult result = iicv(in.crn.view(), in.independent.view(), options);
      for (int y = 0; y < RareLight::height; ++y)
        for (int x = 0; RareLight::is_black(x + 3); ++x, ++all) {
          const double truth = test::expected(x, y, 1), value = result.estimate.pixel(x, y)[1];
          dark += value < truth / 5;
          certain += 10 * result.std_error.pixel(x, y)[1] < std::abs(value - truth);
        }
    }
    EXPECT_LT(dark, all / 20) << trace;
    EXPECT_LT(certain, all / 50) << trace;
  }
}

/// The published estimate is unchanged; its standard error reveals the problem.
TEST(Iicv, AsPublishedItIsBlackThereButSaysHowUncertain) {
  const RareLight in(1);
  IicvOptions options = IicvOptions::paper();
  const EstimatorResult plain = iicv(in.crn.view(), in.independent.view(), options);
  options.std_error = true;
  const EstimatorResult result = iicv(in.crn.view(), in.independent.view(), options);
  EXPECT_EQ(result.estimate.data, plain.estimate.data);
  EXPECT_EQ(result.estimate.pixel(5, 13)[0], 0);
  EXPECT_NEAR(result.std_error.pixel(5, 13)[0], test::expected(5, 13, 0), 0.4 * test::expected(5, 13, 0));
}

/// Directly visible light sources and a black background are certain.
TEST(Iicv, WhatIsTheSameInBothImagesIsCertain) {
  test::Grouped crn = test::crn_image(41, 27, 12, 1), independent = test::independent_image(41, 27, 12, 2);
  for (test::Grouped* image : {&crn, &independent})
    for (int y = 0; y < 27; ++y)
      for (int x = 0; x < 20; ++x) std::fill_n(image->pixel(x, y), 36, x < 10 ? 0.0f : 2.5f);
  IicvOptions options;
  options.std_error = true;
  const EstimatorResult result = iicv(crn.view(), independent.view(), options);
  for (int y = 0; y < 27; ++y)
    for (int x = 0; x < 20; ++x) {
      ASSERT_EQ(result.std_error.pixel(x, y)[0], 0) << x << ", " << y;
      ASSERT_EQ(result.estimate.pixel(x, y)[0], x < 10 ? 0.0f : 2.5f) << x << ", " << y;
    }
}

/// Everything the defaults add: mixed penalty, mean constraint, residual correction.
TEST(Iicv, DefaultsAgreeWithTheReference) {
  for (const auto& [width, height] : {std::pair{41, 27}, {60, 6}, {1, 1}, {5, 40}}) {
    const test::Grouped crn = test::crn_image(width, height, 12, 1),
                        independent = test::independent_image(width, height, 12, 2);
    const GroupedImage crn_view = crn.view(), independent_view = independent.view();
    const EstimatorResult fast = iicv(crn_view, independent_view);
    const RgbImage h =
        reference::map_pixels(independent_view, [&](int x, int y) { return reference::mean(independent_view, x, y); });
    const RgbImage variance = reference::map_pixels(
        independent_view, [&](int x, int y) { return reference::variance_of_mean(independent_view, x, y); });
    const RgbImage error = pilot_of(crn_view, independent_view, 11);
    const RgbImage missing = reference::missing_light(crn_view, independent_view);
    const auto all = neighbours(crn_view, 25, 11);
    RgbImage estimate, std_error;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const reference::Result r =
            reference::control_variates(crn_view, h, error, variance, {x, y}, all[y * width + x],
                                        {true, true, 0, kSmallestPenalty, 30, 0.5}, missing);
        estimate.push_back(r.estimate);
        std_error.push_back(r.std_error);
      }
    estimate = reference::residual_correction(estimate, std_error, h, variance, width, height, 41, 1.25);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const Rgb noise = reference::variance_of_mean(crn_view, x, y);
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(fast.estimate.pixel(x, y)[c], estimate[y * width + x][c], 3e-3 * std::sqrt(noise[c]))
              << x << ", " << y << " of " << width << " x " << height;
      }
  }
}

/// Powers of two scale floats exactly, and the estimator is homogeneous.
TEST(Iicv, ScalingTheInputsScalesTheResultExactly) {
  test::Grouped crn = test::crn_image(40, 23, 12, 3), independent = test::independent_image(40, 23, 12, 4);
  IicvOptions options;
  options.std_error = true;
  const EstimatorResult once = iicv(crn.view(), independent.view(), options);
  for (float& v : crn.data) v *= 4;
  for (float& v : independent.data) v *= 4;
  const EstimatorResult scaled = iicv(crn.view(), independent.view(), options);
  for (size_t i = 0; i < once.estimate.data.size(); ++i) {
    ASSERT_EQ(4 * once.estimate.data[i], scaled.estimate.data[i]);
    ASSERT_EQ(4 * once.std_error.data[i], scaled.std_error.data[i]);
  }
}

/// A visible lamp: bright and nearly noise-free. Single precision must suffice.
TEST(Iicv, BrightPixelsWithLittleNoiseAreKept) {
  test::Grouped crn = test::crn_image(40, 30, 12, 3), independent = test::independent_image(40, 30, 12, 4);
  const auto paint = [](test::Grouped& image, float noise) {
    for (int y = 8; y < 20; ++y)
      for (int x = 10; x < 30; ++x)
        for (int i = 0; i < 36; ++i) {
          const float base = (i % 3 == 0 ? 60.0f : i % 3 == 1 ? 18.0f : 5.0f) * (1 + 0.001f * static_cast<float>(x));
          image.pixel(x, y)[i] = base * (1 + noise * test::noise(7, i, x));
        }
  };
  for (float noise : {0.0f, 1e-7f, 1e-5f, 1e-3f}) {
    paint(crn, noise);
    paint(independent, noise);
    const EstimatorResult result = iicv(crn.view(), independent.view());
    for (int y = 8; y < 20; ++y)
      for (int x = 10; x < 30; ++x)
        EXPECT_NEAR(result.estimate.pixel(x, y)[0], 60.0f * (1 + 0.001f * static_cast<float>(x)), 60 * (noise + 2e-6f));
  }
}

/// Values whose squares overflow: results are finite, here those of the independent image.
TEST(Iicv, AbsurdlyLargeValuesGiveFiniteResults) {
  test::Grouped crn = test::crn_image(40, 30, 12, 3), independent = test::independent_image(40, 30, 12, 4);
  for (int i = 0; i < 36; ++i)
    crn.pixel(20, 10)[i] = independent.pixel(20, 10)[i] = 1e25f * (1.0f + 0.1f * static_cast<float>(i));
  IicvOptions options;
  options.std_error = true;
  const EstimatorResult result = iicv(crn.view(), independent.view(), options);
  for (float v : result.estimate.data) ASSERT_TRUE(std::isfinite(v));
}

/// No variance in the CRN image: nothing to regress on, and the result is the CRN mean.
TEST(Iicv, WithoutCrnVarianceIsTheCrnMean) {
  test::Grouped crn = test::constant_image(30, 20, 12, 0.25f);
  const test::Grouped independent = test::independent_image(30, 20, 12, 4);
  for (bool shared : {true, false}) {
    IicvOptions options = IicvOptions::paper();
    options.shared_coefficients = shared;
    const EstimatorResult result = iicv(crn.view(), independent.view(), options);
    for (float v : result.estimate.data) EXPECT_NEAR(v, 0.25f, 1e-6f);
  }
}

/// Processing an image in bands of rows gives the bits of the whole.
TEST(Iicv, BandsGiveTheSameBits) {
  const test::Grouped crn = test::crn_image(50, 140, 6, 3), independent = test::independent_image(50, 140, 6, 4);
  IicvOptions options;
  options.std_error = true;
  const EstimatorResult whole = iicv(crn.view(), independent.view(), options);
  const int halo = iicv_halo(options);
  for (int y0 = 0; y0 < 140; y0 += 34) {
    const int first = std::max(0, (y0 - halo) / kResidualCell * kResidualCell), last = std::min(140, y0 + 34 + halo);
    const auto band = [&](const GroupedImage& image) {
      return GroupedImage{50, last - first, 6, image.pixel(0, first)};
    };
    const EstimatorResult part = iicv(band(crn.view()), band(independent.view()), options);
    for (int y = y0; y < std::min(140, y0 + 34); ++y)
      for (int i = 0; i < 150; ++i) {
        ASSERT_EQ(part.estimate.pixel(0, y - first)[i], whole.estimate.pixel(0, y)[i]) << y;
        ASSERT_EQ(part.std_error.pixel(0, y - first)[i], whole.std_error.pixel(0, y)[i]) << y;
      }
  }
}

TEST(Iicv, BlackIsBlack) {
  const test::Grouped black = test::constant_image(30, 20, 12, 0.0f);
  IicvOptions options;
  options.std_error = true;
  for (const Penalty penalty : {Penalty::kPilot, Penalty::kSample}) {
    options.penalty = penalty;
    const EstimatorResult result = iicv(black.view(), black.view(), options);
    for (float v : result.estimate.data) ASSERT_EQ(v, 0.0f);
    for (float v : result.std_error.data) ASSERT_EQ(v, 0.0f);
  }
}

/// An error-free independent image: the coefficient of the target tends to 1 and the result to that image.
TEST(Iicv, WithAnExactIndependentImageIsTheIndependentImage) {
  const test::Grouped crn = test::crn_image(30, 20, 12, 3);
  test::Grouped exact = test::constant_image(30, 20, 12, 0);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 30; ++x)
      for (int i = 0; i < 36; ++i) exact.pixel(x, y)[i] = static_cast<float>(test::expected(x, y, i % 3));
  IicvOptions options = IicvOptions::paper();
  options.penalty = Penalty::kSample;
  const EstimatorResult result = iicv(crn.view(), exact.view(), options);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 30; ++x)
      for (int c = 0; c < 3; ++c) {
        const double noise = std::sqrt(reference::variance_of_mean(crn.view(), x, y)[c]);
        EXPECT_NEAR(result.estimate.pixel(x, y)[c], test::expected(x, y, c), 0.05 * noise);
      }
}

/// A single sample of a small bright light, found by the independent image only, stays near its pixel: a wide mean of
/// residuals must exceed its own noise to be given back.
TEST(Iicv, ABrightSampleIsNotSpreadOverTheDarkAround) {
  test::Grouped crn = test::crn_image(64, 48, 12, 3), independent = test::independent_image(64, 48, 12, 4);
  for (test::Grouped* image : {&crn, &independent})
    for (float& value : image->data) value *= 1e-3f;
  const EstimatorResult plain = iicv(crn.view(), independent.view());
  for (int c = 0; c < 3; ++c) independent.pixel(22, 21)[c] = 1000;
  const EstimatorResult bright = iicv(crn.view(), independent.view());
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      if (std::max(std::abs(x - 22), std::abs(y - 21)) <= 10) continue;  // the regression window around it
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(bright.estimate.pixel(x, y)[c], plain.estimate.pixel(x, y)[c], 2e-4) << x << ", " << y;
    }
}

/// Bits depend neither on the number of threads nor on a pixel's place in a tile or vector: inside a crop, farther from
/// its border than the windows reach, they are those of the whole image.
TEST(Iicv, BitsDoNotDependOnThreadsTilesOrCrops) {
  const test::Grouped crn = test::crn_image(150, 120, 6, 3), independent = test::independent_image(150, 120, 6, 4);
  IicvOptions options;
  options.std_error = true;
  options.residual_options.window = 17;
  const auto with_threads = [&](int n) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, n);
    return iicv(crn.view(), independent.view(), options);
  };
  const EstimatorResult one = with_threads(1);
  for (int n : {2, 5}) {
    const EstimatorResult more = with_threads(n);
    EXPECT_EQ(one.estimate.data, more.estimate.data);
    EXPECT_EQ(one.std_error.data, more.std_error.data);
  }

  const int x0 = 12, y0 = 8, width = 101, height = 90;  // multiples of kResidualCell
  const auto crop = [&](const test::Grouped& image) {
    test::Grouped part = test::constant_image(width, height, image.groups, 0);
    for (int y = 0; y < height; ++y)
      std::copy_n(image.view().pixel(x0, y0 + y), static_cast<size_t>(width) * image.groups * 3, part.pixel(0, y));
    return part;
  };
  const int halo = iicv_halo(options);
  ASSERT_LT(2 * halo, height);
  const EstimatorResult part = iicv(crop(crn).view(), crop(independent).view(), options);
  for (int y = halo; y < height - halo; ++y)
    for (int x = halo; x < width - halo; ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_EQ(part.estimate.pixel(x, y)[c], one.estimate.pixel(x0 + x, y0 + y)[c]) << x << ", " << y;
}

/// A non-finite value spoils its own pixel at most, and is counted.
TEST(Iicv, NonFiniteValuesStayWhereTheyAre) {
  const test::Grouped crn = test::crn_image(100, 30, 6, 3), independent = test::independent_image(100, 30, 6, 4);
  const EstimatorResult good = iicv(crn.view(), independent.view());
  test::Grouped bad_crn = crn, bad_independent = independent;
  bad_crn.pixel(10, 12)[4] = std::numeric_limits<float>::quiet_NaN();
  bad_independent.pixel(30, 5)[0] = std::numeric_limits<float>::infinity();
  for (int i = 0; i < 18; ++i)
    bad_crn.pixel(39, 29)[i] = bad_independent.pixel(39, 29)[i] = std::numeric_limits<float>::quiet_NaN();
  const EstimatorResult result = iicv(bad_crn.view(), bad_independent.view());
  EXPECT_EQ(result.nonfinite_pixels, 3);
  EXPECT_EQ(good.nonfinite_pixels, 0);
  for (float v : result.estimate.data) ASSERT_TRUE(std::isfinite(v));
  // Far from all three, nothing changes.
  EXPECT_EQ(result.estimate.pixel(95, 25)[0], good.estimate.pixel(95, 25)[0]);
  // The pixel itself: the mean of its finite groups in both images, or if there are none, of the image around.
  double sum = 0;
  for (int t = 0; t < 6; ++t)
    sum += (t == 1 ? 0 : crn.view().pixel(10, 12)[3 * t + 1]) + independent.view().pixel(10, 12)[3 * t + 1];
  EXPECT_NEAR(result.estimate.pixel(10, 12)[1], sum / 11, 1e-5);
  double around = 0;
  for (int y = 27; y < 30; ++y)
    for (int x = 37; x < 42; ++x) around += x == 39 && y == 29 ? 0 : result.estimate.pixel(x, y)[2];
  EXPECT_NEAR(result.estimate.pixel(39, 29)[2], around / 14, 1e-5);
}

TEST(Iicv, ImagesSmallerThanTheWindowWork) {
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 2}, {1, 9}, {7, 1}}) {
    const test::Grouped crn = test::crn_image(width, height, 5, 3),
                        independent = test::independent_image(width, height, 5, 4);
    const EstimatorResult fast = iicv(crn.view(), independent.view(), IicvOptions::paper());
    const Difference d = compare(fast, crn.view(), independent.view(), pilot_of(crn.view(), independent.view(), 11), 25,
                                 11, {true, true, 0, kSmallestPenalty});
    EXPECT_LT(d.estimate, 2e-3) << width << " x " << height;
  }
}

TEST(Iicv, ReportsEveryProblemAtOnce) {
  const test::Grouped two = test::constant_image(8, 6, 2, 1), one = test::constant_image(8, 5, 1, 1);
  IicvOptions options = IicvOptions::paper();
  options.k = 200;
  options.penalty = Penalty::kSample;
  EXPECT_EQ(message_of([&] { iicv(two.view(), one.view(), options); }, ErrorCode::kUsage),
            "iicv: k is 200, expected 1 to 121, the number of pixels in a window of 11 x 11; "
            "the CRN image is 8 x 6 and the independent image 8 x 5; "
            "they must have the same size; the CRN image has 2 groups, at least 3 are needed (12 are recommended); the "
            "independent image has 1 group, at least 2 are needed with these settings");
}

TEST(Iicv, RefusesWindowsWithoutACentre) {
  const test::Grouped image = test::constant_image(8, 6, 4, 1);
  IicvOptions options;
  for (const int window : {10, 1, 65}) {
    options.window = window, options.k = 1;
    EXPECT_EQ(message_of([&] { iicv(image.view(), image.view(), options); }, ErrorCode::kUsage),
              fmt::format("iicv: window is {}, expected an odd number from 3 to 63", window));
  }
}

}  // namespace
}  // namespace covary
