// SPDX-License-Identifier: Apache-2.0
#include "risk/predicted_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include "core/error.h"
#include "risk/error_interval.h"

namespace covary {
namespace {

constexpr int kBlock = 16;
constexpr double kShareOfBlocks = 0.95;

/// Limits of doubt_of(). In an image with fewer than kMinPixels pixels, 1 % of them is too few to judge.
constexpr double kFewPixels = 0.01, kMaxInFewPixels = 0.4;
constexpr size_t kMinPixels = 400;

constexpr double kDarkest = 0.1;  // the root of relMSE's 0.01

double square_of(double x) { return x * x; }

/// Sum over the pixels of a part of the image, and their number.
struct PartSum {
  double total = 0;
  size_t n_pixels = 0;
  double mean() const { return n_pixels ? total / static_cast<double>(n_pixels) : 0.0; }
};

/// Predicted relative squared error of a pixel.
double predicted_at(const EstimatorResult& result, int x, int y) {
  double sum = 0, squares = 0;
  for (int c = 0; c < 3; ++c) {
    sum += result.estimate.pixel(x, y)[c];
    squares += static_cast<double>(result.std_error.pixel(x, y)[c]) * result.std_error.pixel(x, y)[c];
  }
  return squares / 3 / (sum * sum / 9 + 0.01);
}

PartSum sum_over(const EstimatorResult& result, int x0, int y0, int x1, int y1) {
  if (result.std_error.data.empty())
    throw Error(ErrorCode::kUsage, "predicted_relmse: the result has no standard error; set std_error in the options");
  PartSum part;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const double relative = predicted_at(result, x, y);
      if (!std::isfinite(relative)) continue;
      part.total += relative;
      ++part.n_pixels;
    }
  return part;
}

/// Fraction of the predicted error in the fraction kFewPixels of all pixels that has the most.
double share_of_few(const EstimatorResult& result) {
  std::vector<double> errors;
  for (int y = 0; y < result.estimate.height; ++y)
    for (int x = 0; x < result.estimate.width; ++x)
      if (const double error = predicted_at(result, x, y); std::isfinite(error)) errors.push_back(error);
  if (errors.size() < kMinPixels) return 0;
  const auto few = errors.begin() + static_cast<ptrdiff_t>(kFewPixels * static_cast<double>(errors.size()));
  std::nth_element(errors.begin(), few, errors.end(), std::greater<>());
  const double all = std::accumulate(errors.begin(), errors.end(), 0.0);
  return all > 0 ? std::accumulate(errors.begin(), few, 0.0) / all : 0;
}

double grey_of(const Image& image, int x, int y) {
  const float* p = image.pixel(x, y);
  return (static_cast<double>(p[0]) + p[1] + p[2]) / 3;
}

/// Mean squared standard error over the channels.
double squared_error_of(const EstimatorResult& result, int x, int y) {
  const float* s = result.std_error.pixel(x, y);
  return (square_of(s[0]) + square_of(s[1]) + square_of(s[2])) / 3;
}

bool is_known(const EstimatorResult& result, int x, int y) {
  return square_of(kKnownBrightness) * squared_error_of(result, x, y) <= square_of(grey_of(result.estimate, x, y));
}

/// See fireflies_in().
double brightness_around(const EstimatorResult& result, int x, int y) {
  const Image& image = result.estimate;
  std::vector<double> values;
  double least = kDarkest;
  for (int j = std::max(0, y - 2); j <= std::min(image.height - 1, y + 2); ++j)
    for (int i = std::max(0, x - 2); i <= std::min(image.width - 1, x + 2); ++i) {
      const double value = grey_of(image, i, j);
      if ((i == x && j == y) || !std::isfinite(value)) continue;
      values.push_back(value);
      if (is_known(result, i, j)) least = std::max(least, value);
    }
  if (values.empty()) return least;
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return std::max(least, *middle);
}

std::optional<PredictedBounds> bounds_around(const EstimatorResult& result, double predicted) {
  if (!result.interval || !result.interval->unknown.empty()) return std::nullopt;
  return PredictedBounds{predicted * result.interval->below, predicted * result.interval->above};
}

std::string doubt_of(const EstimatorResult& result, double samples, uint32_t reliable_samples) {
  if (result.interval) {
    const auto& [middle, below, above, unknown] = *result.interval;
    if (!unknown.empty()) return "no interval can be given: " + unknown;
    const double factor = std::max(above, 1 / below);
    return factor > kReliableFactor ? fmt::format("known to a factor of {:.2g}", factor) : "";
  }
  if (samples < reliable_samples) return fmt::format("fewer than {} samples per pixel", reliable_samples);
  if (const double share = share_of_few(result); share > kMaxInFewPixels)
    return fmt::format("{:.0f} % of it lies in {:.0f} % of the pixels", 100 * share, 100 * kFewPixels);
  return "";
}

}  // namespace

double predicted_relmse(const EstimatorResult& result) {
  return sum_over(result, 0, 0, result.estimate.width, result.estimate.height).mean();
}

double predicted_blocks(const EstimatorResult& result) {
  const int width = result.estimate.width, height = result.estimate.height;
  std::vector<double> blocks;
  for (int y = 0; y < height; y += kBlock)
    for (int x = 0; x < width; x += kBlock)
      blocks.push_back(sum_over(result, x, y, std::min(width, x + kBlock), std::min(height, y + kBlock)).mean());
  if (blocks.empty()) return 0;
  const auto rank = static_cast<ptrdiff_t>(std::ceil(kShareOfBlocks * static_cast<double>(blocks.size()))) - 1;
  std::nth_element(blocks.begin(), blocks.begin() + rank, blocks.end());
  return blocks[static_cast<size_t>(rank)];
}

Fireflies fireflies_in(const EstimatorResult& result) {
  sum_over(result, 0, 0, 0, 0);  // throws if there is no standard error
  const Image& image = result.estimate;
  Fireflies fireflies;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double own = grey_of(image, x, y), square = squared_error_of(result, x, y);
      if (!std::isfinite(own + square) || own < kFireflyFactor * kDarkest || is_known(result, x, y)) continue;
      const double around = brightness_around(result, x, y);
      if (own < kFireflyFactor * around) continue;
      ++fireflies.pixels;
      fireflies.relmse += square / (around * around + 0.01);
    }
  fireflies.relmse /= static_cast<double>(image.width) * image.height;
  return fireflies;
}

std::optional<PredictedError> predicted_error(const EstimatorResult& result, double samples,
                                              uint32_t reliable_samples) {
  if (result.std_error.data.empty()) return std::nullopt;
  const double relmse = predicted_relmse(result) * (result.interval ? result.interval->middle : 1);
  return PredictedError{relmse, bounds_around(result, relmse), doubt_of(result, samples, reliable_samples)};
}

}  // namespace covary
