// SPDX-License-Identifier: Apache-2.0
#include "risk/image_risk.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

/// Pixels of a row segment whose errors are summed.
constexpr int kPart = 16;
/// Albedos or normals of one surface differ by no more, as sums over channels.
constexpr float kSameSurface = 0.05f;

/// A pixel's sums over its channels.
struct PixelRisk {
  double error = 0, covariance = 0, variance = 0, noise = 0;
};

PixelRisk risk_at(const ImageRiskInput& in, int x, int y) {
  PixelRisk pixel;
  for (int c = 0; c < 3; ++c) {
    const double h = in.independent->mean.row(c, y)[x], v = in.independent->variance_of_mean.row(c, y)[x];
    pixel.noise += v;
    const double square_of_residual = square(in.image->pixel(x, y)[c] - h);
    if (in.covariance) {
      const double twice_covariance = 2 * in.covariance->pixel(x, y)[c];
      pixel.error += square_of_residual - v + twice_covariance;
      pixel.covariance += twice_covariance;
      pixel.variance += square(in.std_error->pixel(x, y)[c]);
      continue;
    }
    if (!in.halves[0]) {  // M is h: its error is its variance, and no correction is needed
      pixel.error += v, pixel.variance += v;
      continue;
    }
    double m[2], g[2];
    for (int half : {0, 1}) {
      m[half] = in.halves[half]->pixel(x, y)[c];
      g[half] = in.independents[half]->mean.row(c, y)[x];
    }
    const double twice_covariance = 0.5 * (m[0] - m[1]) * (g[0] - g[1]);
    pixel.error += square_of_residual - v + twice_covariance;
    pixel.covariance += twice_covariance;
    pixel.variance += 0.25 * square(m[0] - m[1]);
  }
  return pixel;
}

/// Whether the pixel shows a mirror or glass: the surface behind differs from the first one.
bool is_specular(const Features& surfaces, int x, int y) {
  const auto differ = [&](const Image* first, const Image* behind) {
    if (!first || !behind) return false;
    const float *a = first->pixel(x, y), *b = behind->pixel(x, y);
    return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]) > kSameSurface;
  };
  return differ(surfaces.normal, surfaces.denoising_normal) || differ(surfaces.albedo, surfaces.denoising_albedo);
}

/// The fraction of light in the largest of a pixel's groups, and the variation between groups.
void add_groups(const ImageRiskInput& in, int x, int y, double weight, RiskRow& row) {
  const GroupedImage& image = *in.groups;
  const int T = image.groups;
  const float* g = image.pixel(x, y);
  const double part = 1.0 / T;
  double light = 0, largest = 0;
  std::array<double, 3> mean{}, second{}, fourth{};
  for (int t = 0; t < T; ++t) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += std::max(0.0f, g[3 * t + c]), mean[c] += part * g[3 * t + c];
    light += sum, largest = std::max(largest, sum);
  }
  for (int c = 0; c < 3; ++c) {
    for (int t = 0; t < T; ++t) {
      const double d = square(g[3 * t + c] - mean[c]);
      second[c] += part * d, fourth[c] += part * d * d;
    }
    row.squared_deviations += square(weight * second[c]), row.fourth_powers += square(weight) * fourth[c];
  }
  const double brightness = std::sqrt(weight);  // approximately 1 / (G' + 0.1)
  row.light += brightness * light, row.light_of_largest += brightness * largest;
}

/// RiskRow::spread: light that the image has from elsewhere, such as a firefly's, where the samples show none.
double spread_at(const ImageRiskInput& in, int x, int y) {
  constexpr double kBrighter = 10, kDarkest = 0.1;
  constexpr int kRadius = 2;
  const int width = in.image->width, height = in.image->height;
  const auto grey = [&](int i, int j) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += in.independent->mean.row(c, j)[i] / 3;
    return sum;
  };
  const float* m = in.image->pixel(x, y);
  const double own = (double{m[0]} + m[1] + m[2]) / 3;
  double around = std::max(kDarkest, grey(x, y));
  if (own <= kBrighter * around) return 0;
  std::vector<double> values;
  for (int j = std::max(0, y - kRadius); j <= std::min(height - 1, y + kRadius); ++j)
    for (int i = std::max(0, x - kRadius); i <= std::min(width - 1, x + kRadius); ++i)
      if ((*in.valid)[static_cast<size_t>(j) * width + i]) values.push_back(grey(i, j));
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  around = std::max(around, *middle);
  if (own <= kBrighter * around) return 0;
  double error = 0;
  for (int c = 0; c < 3; ++c)
    error += square(m[c] - in.independent->mean.row(c, y)[x]) - in.independent->variance_of_mean.row(c, y)[x];
  return error / (around * around + 0.01);
}

RiskRow risk_of_row(const ImageRiskInput& in, int y) {
  const int width = in.image->width;
  RiskRow row;
  row.groups = in.groups->groups;
  double part = 0;
  for (int x = 0; x < width; ++x) {
    if ((*in.valid)[static_cast<size_t>(y) * width + x]) {
      const double w = relative_weight(in.guide->pixel(x, y));
      const PixelRisk pixel = risk_at(in, x, y);
      part += w * pixel.error;
      row.covariance += w * pixel.covariance, row.variance += w * pixel.variance;
      row.noise += w * pixel.noise, row.noise_squares += square(w * pixel.noise);
      if (is_specular(in.surfaces, x, y)) row.specular_noise += w * pixel.noise;
      row.values += 3;
      if (in.halves[0] || in.covariance) row.spread += spread_at(in, x, y);
      add_groups(in, x, y, w, row);
    }
    if (x % kPart != kPart - 1 && x != width - 1) continue;
    row.error += part, row.squares += square(part), row.parts += 1;
    part = 0;
  }
  return row;
}

/// The mean brightness of the surrounding 5 x 5 pixels without the pixel itself: a pixel that is bright by chance would
/// hide its own error, and a median is too dark where light is found rarely.
Image brightness_around(const Image& image) {
  constexpr int kRadius = 2;
  Image guide(image.width, image.height, 3);
  parallel_for(image.height, 8, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      double sum = 0;
      int n = 0;
      for (int j = std::max(0, y - kRadius); j <= std::min(image.height - 1, y + kRadius); ++j)
        for (int i = std::max(0, x - kRadius); i <= std::min(image.width - 1, x + kRadius); ++i) {
          if (i == x && j == y) continue;
          const float* p = image.pixel(i, j);
          sum += p[0] + p[1] + p[2], n += 3;
        }
      const float* own = image.pixel(x, y);
      std::fill_n(guide.pixel(x, y), 3, n ? static_cast<float>(sum / n) : (own[0] + own[1] + own[2]) / 3);
    }
  });
  return guide;
}

}  // namespace

std::vector<RiskRow> image_risk(const ImageRiskInput& input) {
  std::vector<RiskRow> rows(static_cast<size_t>(input.image->height));
  parallel_for(input.image->height, 4, [&](int y) { rows[static_cast<size_t>(y)] = risk_of_row(input, y); });
  return rows;
}

void add_risk_of_mean(const GroupedImage& groups, MethodImage& mean) {
  if (groups.groups < 2) return;
  long ignored = 0;  // counted where the image is shown
  const std::vector<unsigned char> valid = finite_pixels(groups, groups, ignored);
  const Moments independent = moments(groups, valid, 0, 0.0f);
  Image finite = mean.estimate;
  fill_invalid(groups, groups, valid, finite);
  const Image guide = brightness_around(finite);
  mean.risk_rows = image_risk({&mean.estimate, {}, &independent, {}, &groups, &guide, &valid});
  mean.risk_kind = ErrorKind::kMean;
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
