// SPDX-License-Identifier: Apache-2.0
#include "risk/image_risk.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

/// Pixels of a part of a row, whose errors are taken together.
constexpr int kPart = 16;
/// Pixels around one, in each direction, whose noise is taken together; and the least noise.
constexpr int kAround = 3;
constexpr double kLeastNoise = 1e-6;

/// A pixel's sums over its channels.
struct PixelRisk {
  double error = 0, variance = 0, noise = 0;
};

PixelRisk risk_at(const ImageRiskInput& in, int x, int y) {
  PixelRisk pixel;
  for (int c = 0; c < 3; ++c) {
    const double h = in.independent->mean.row(c, y)[x], v = in.independent->variance_of_mean.row(c, y)[x];
    pixel.noise += v;
    if (!in.halves[0]) {  // M is h: its error is its variance
      pixel.error += v, pixel.variance += v;
      continue;
    }
    double m[2], g[2];
    for (int half : {0, 1}) {
      m[half] = in.halves[half]->pixel(x, y)[c];
      g[half] = in.independents[half]->mean.row(c, y)[x];
    }
    pixel.error += square(in.image->pixel(x, y)[c] - h) - v + 0.5 * (m[0] - m[1]) * (g[0] - g[1]);
    pixel.variance += 0.25 * square(m[0] - m[1]);
  }
  return pixel;
}

/// What the groups of a pixel hold and how much they differ.
void add_groups(const ImageRiskInput& in, int x, int y, double weight, RiskRow& row) {
  const GroupedImage& image = *in.groups;
  const int T = image.groups;
  const float* g = image.pixel(x, y);
  double light = 0, largest = 0;
  std::array<double, 3> mean{}, second{}, fourth{};
  for (int t = 0; t < T; ++t) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += std::max(0.0f, g[3 * t + c]), mean[c] += g[3 * t + c] / static_cast<double>(T);
    light += sum, largest = std::max(largest, sum);
  }
  for (int c = 0; c < 3; ++c) {
    for (int t = 0; t < T; ++t) {
      const double d = square(g[3 * t + c] - mean[c]);
      second[c] += d / T, fourth[c] += d * d / T;
    }
    row.squared_deviations += square(weight * second[c]), row.fourth_powers += square(weight) * fourth[c];
  }
  const double brightness = std::sqrt(weight);  // 1 / (G' + 0.1), about
  row.light += brightness * light, row.light_of_largest += brightness * largest;
}

/// Relative noise of the pixels around each one of a row.
std::vector<double> noise_around(const ImageRiskInput& in, int y) {
  const int width = in.image->width, height = in.image->height;
  std::vector<double> sums(static_cast<size_t>(width)), counts(sums);
  for (int j = std::max(0, y - kAround); j <= std::min(height - 1, y + kAround); ++j)
    for (int x = 0; x < width; ++x) {
      if (!(*in.valid)[static_cast<size_t>(j) * width + x]) continue;
      const double weight = relative_weight(in.guide->pixel(x, j));
      for (int c = 0; c < 3; ++c) sums[x] += weight * in.independent->variance_of_mean.row(c, j)[x];
      counts[x] += 3;
    }
  std::vector<double> around(sums.size());
  for (int x = 0; x < width; ++x) {
    double sum = 0, n = 0;
    for (int i = std::max(0, x - kAround); i <= std::min(width - 1, x + kAround); ++i) sum += sums[i], n += counts[i];
    around[x] = (n > 0 ? sum / n : 0) + kLeastNoise;
  }
  return around;
}

RiskRow risk_of_row(const ImageRiskInput& in, int y) {
  const int width = in.image->width;
  const std::vector<double> around = noise_around(in, y);
  RiskRow row;
  row.groups = in.groups->groups;
  double part = 0, scaled = 0;
  for (int x = 0; x < width; ++x) {
    if ((*in.valid)[static_cast<size_t>(y) * width + x]) {
      const double w = relative_weight(in.guide->pixel(x, y));
      const PixelRisk pixel = risk_at(in, x, y);
      part += w * pixel.error, scaled += w * pixel.error / around[x];
      row.variance += w * pixel.variance, row.scaled_variance += w * pixel.variance / around[x];
      row.noise += w * pixel.noise, row.noise_squares += square(w * pixel.noise);
      row.values += 3;
      add_groups(in, x, y, w, row);
    }
    if (x % kPart != kPart - 1 && x != width - 1) continue;
    row.error += part, row.squares += square(part), row.parts += 1;
    row.scaled_error += scaled, row.scaled_squares += square(scaled);
    part = scaled = 0;
  }
  return row;
}

}  // namespace

std::vector<RiskRow> image_risk(const ImageRiskInput& input) {
  std::vector<RiskRow> rows(static_cast<size_t>(input.image->height));
  parallel_for(input.image->height, 4, [&](int y) { rows[static_cast<size_t>(y)] = risk_of_row(input, y); });
  return rows;
}

RiskRow sum_of(const std::vector<RiskRow>& rows) {
  RiskRow all;
  for (const RiskRow& row : rows) {
    for (const auto& [name, sum] : kRiskSums) all.*sum += row.*sum;
    all.groups = row.groups;
  }
  return all;
}

}  // namespace covary
