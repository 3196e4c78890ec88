// SPDX-License-Identifier: Apache-2.0
// A planted bias is found with its sign and size; without one, none is found. 8 images of 600 cells with 3 values each,
// 15 times as many as are independent for wide windows, give a false-alarm rate of 0.3 %. Without requiring 20 cells,
// and with only the noise of the cells, it was 1.1 %.
#include "risk/held_out_bias.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"
#include "estimators/test_images.h"
#include "risk/halves.h"
#include "risk/held_out_error.h"

namespace covary {
namespace {

constexpr int kWidth = 120, kHeight = 80;

/// Added to the image at a pixel.
using Bias = std::function<float(int x, int y)>;

Image picture(uint64_t seed, float noise, const Bias& bias) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] = static_cast<float>(test::expected(x, y, c)) + bias(x, y) +
                               noise * test::noise(seed, static_cast<uint64_t>(y) * kWidth + x, c);
  return image;
}

Moments moments_of(const Image& image) {
  Moments m{Planes(kWidth, kHeight, 3, 0, 0), Planes(kWidth, kHeight, 3, 0, 0), {}};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) m.mean.row(c, y)[x] = image.pixel(x, y)[c];
  return m;
}

/// Bias found in images with this bias and noise of a fifth of that of the independent images.
Image found(uint64_t seed, const Bias& bias) {
  const auto none = [](int, int) { return 0.0f; };
  const Image m[2] = {picture(10 * seed, 0.1f, bias), picture(10 * seed + 1, 0.1f, bias)};
  const Moments h[2] = {moments_of(picture(10 * seed + 2, 0.5f, none)), moments_of(picture(10 * seed + 3, 0.5f, none))};
  const std::vector<unsigned char> valid(size_t{kWidth} * kHeight, 1);
  return held_out_bias({{&m[0], &m[1]}, {&m[0], &m[1]}, {&h[0], &h[1]}, &valid});
}

double mean_in(const Image& image, int x0, int x1, int y0, int y1) {
  double sum = 0;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x)
      for (int c = 0; c < 3; ++c) sum += image.pixel(x, y)[c];
  return sum / (3.0 * (x1 - x0) * (y1 - y0));
}

TEST(HeldOutBias, IsZeroWithoutBias) {
  double n = 0, total = 0;
  for (uint64_t seed = 1; seed <= 8; ++seed)
    for (float value : found(seed, [](int, int) { return 0.0f; }).data) n += value != 0, total += 1;
  EXPECT_LT(n / total, 0.005);
}

TEST(HeldOutBias, HasSignAndSizeOfAPlantedOne) {
  // Too bright in the bright corner, too dark on the right.
  const auto planted = [](int x, int y) { return x + y <= 45 ? 0.2f : x >= 72 ? -0.15f : 0.0f; };
  double bright = 0, dark = 0, none = 0;
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    const Image bias = found(seed, planted);
    bright += mean_in(bias, 4, 20, 4, 20) / 4;
    dark += mean_in(bias, 92, 112, 20, 60) / 4;
    none += std::abs(mean_in(bias, 40, 50, 40, 70)) / 4;
  }
  EXPECT_NEAR(bright, 0.2, 0.05);
  EXPECT_NEAR(dark, -0.15, 0.04);
  EXPECT_LT(none, 0.03);
}

TEST(HeldOutBias, LeavesOutWhatIsNotValid) {
  const auto planted = [](int x, int) { return x < 60 ? 1e6f : 0.0f; };
  const auto none = [](int, int) { return 0.0f; };
  const Image m[2] = {picture(1, 0.1f, planted), picture(2, 0.1f, planted)};
  const Moments h[2] = {moments_of(picture(3, 0.5f, none)), moments_of(picture(4, 0.5f, none))};
  std::vector<unsigned char> valid(size_t{kWidth} * kHeight, 1);
  for (int y = 0; y < kHeight; ++y) std::fill_n(valid.begin() + y * kWidth, 60, 0);
  const Image bias = held_out_bias({{&m[0], &m[1]}, {&m[0], &m[1]}, {&h[0], &h[1]}, &valid});
  for (float value : bias.data) ASSERT_LT(std::abs(value), 0.5f);
  EXPECT_EQ(mean_in(bias, 0, 60, 0, kHeight), 0);
}

TEST(HeldOutBias, IsToldOfDenoisedImagesAndDoesNotDependOnThreads) {
  const test::Grouped crn = test::crn_image(kWidth, kHeight, 8, 1),
                      independent = test::independent_image(kWidth, kHeight, 8, 1);
  MethodSettings settings;
  settings.std_error = true;
  MixedDenoisingOptions options;
  options.mode = DenoiseMode::kError;
  options.use_oidn = false;
  const Method estimator = with_denoising(make_estimator("iicv"), options);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const EstimatorResult alone = estimator.image({crn.view(), independent.view()}, settings);
  const tbb::global_control four(tbb::global_control::max_allowed_parallelism, 4);
  const EstimatorResult together = estimator.image({crn.view(), independent.view()}, settings);
  ASSERT_EQ(alone.bias.data.size(), alone.estimate.data.size());
  EXPECT_EQ(alone.bias.data, together.bias.data);
  settings.std_error = false;
  EXPECT_TRUE(estimator.image({crn.view(), independent.view()}, settings).bias.data.empty());
}

/// `iicv` with a modified image.
Method damaged(const std::function<Image(const Image&)>& damage) {
  Method estimator = make_estimator("iicv");
  PassPair& pair = std::get<PassPair>(estimator.passes);
  pair.image = [image = pair.image, damage](const GroupedImage& g, const GroupedImage& h,
                                            const MethodSettings& settings) {
    EstimatorResult result = image(g, h, settings);
    result.estimate = damage(result.estimate);
    result.covariance = {};  // of the undamaged image
    return result;
  };
  return with_held_out_rows(estimator);
}

Image bias_of(const Method& estimator) {
  const test::Grouped crn = test::noisy_image(kWidth, kHeight, 12, 5, 0.2f, 0);
  const test::Grouped independent = test::noisy_image(kWidth, kHeight, 12, 1005, 1.0f, 0);
  MethodSettings settings;
  settings.std_error = true;
  return estimator.image({crn.view(), independent.view()}, settings).bias;
}

TEST(HeldOutBias, ShowsAShiftedAndABlurredImage) {
  // Up to x + y = 45 the image is bright, and beyond 0.3 times as bright.
  const Image shifted = bias_of(damaged([](const Image& image) {
    Image result = image;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) std::copy_n(image.pixel(std::min(x + 30, kWidth - 1), y), 3, result.pixel(x, y));
    return result;
  }));
  EXPECT_LT(mean_in(shifted, 10, 30, 2, 14), -0.2);
  const Image blurred = bias_of(damaged([](const Image& image) {
    Image result = image;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) {
          float sum = 0;
          for (int dx = -20; dx <= 20; ++dx) sum += image.pixel(std::clamp(x + dx, 0, kWidth - 1), y)[c];
          result.pixel(x, y)[c] = sum / 41;
        }
    return result;
  }));
  // Too dark before the edge, too bright behind it.
  EXPECT_LT(mean_in(blurred, 28, 34, 2, 8), -0.05);
  EXPECT_GT(mean_in(blurred, 44, 52, 2, 8), 0.05);
}

}  // namespace
}  // namespace covary
