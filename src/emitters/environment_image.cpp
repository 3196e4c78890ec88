// SPDX-License-Identifier: Apache-2.0
#include "emitters/environment_image.h"

#include "core/error.h"
#include "core/warp.h"

namespace covary {
namespace {

/// Integrals over one row step d, in units of that step, of the tent (1 - t) on the side of row `theta` where the angle
/// grows with `direction` (+1 or -1), times sin(theta + direction t d).
double tent_times_sine(double theta, double d, double direction) {
  const double end = theta + direction * d;
  // By parts; the difference loses digits for tiny d, where double precision still leaves plenty.
  return direction * std::cos(theta) / d - (std::sin(end) - std::sin(theta)) / (d * d);
}

}  // namespace

EnvironmentImage::EnvironmentImage(const TexelImage& image, float scale, bool mis_compensation)
    : width_(image.width), height_(std::max(image.height, 3)) {
  COVARY_CHECK(image.channels == 3 && image.floats.size() == image.n_pixels() * 3 && image.n_pixels() > 0,
               "an environment needs a linear RGB image");
  const size_t stride = static_cast<size_t>(width_) + 1;
  texels_.resize(stride * height_);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x <= width_; ++x) {
      const size_t source = (static_cast<size_t>(std::min(y, image.height - 1)) * width_ + x % width_) * 3;
      const float* rgb = image.floats.data() + source;
      texels_[y * stride + x].value = Spectrum(rgb[0], rgb[1], rgb[2]) * scale;
    }

  const double step = static_cast<double>(M_PI) / (height_ - 1);
  sines_.resize(height_);
  for (int y = 0; y < height_; ++y) sines_[y] = static_cast<float>(std::sin(y * step));
  sines_.back() = 0;
  // Integral over the sphere: each row's tent against the sine.
  double integral[3] = {0, 0, 0}, luminance_integral = 0;
  for (int y = 0; y < height_; ++y) {
    double row_weight = 0;
    if (y > 0) row_weight += tent_times_sine(y * step, step, -1);
    if (y + 1 < height_) row_weight += tent_times_sine(y * step, step, 1);
    const double per_texel = row_weight * step * 2 * M_PI / width_;
    for (int x = 0; x < width_; ++x) {
      const Spectrum& value = texels_[y * stride + x].value;
      for (int c = 0; c < 3; ++c) integral[c] += per_texel * value[c];
      luminance_integral += per_texel * luminance(value);
    }
  }
  for (int c = 0; c < 3; ++c) integral_[c] = static_cast<float>(integral[c]);

  // [Karlik2019] Sec. 4: the mean over the sphere is subtracted; a constant map keeps its weights.
  float offset = mis_compensation ? static_cast<float>(luminance_integral / (4 * M_PI)) : 0.0f;
  float largest = 0;
  for (const Texel& texel : texels_) largest = std::max(largest, luminance(texel.value));
  if (largest <= 1.01f * offset) offset = 0;
  black_ = !(largest > 0);
  if (black_) return;

  std::vector<float> row_sums(height_), row(width_);
  const std::vector<float> ones(width_, 1.0f);
  double z = 0;
  columns_.reserve(height_);
  for (int y = 0; y < height_; ++y) {
    double sum = 0;
    for (int x = 0; x <= width_; ++x) {
      Texel& texel = texels_[y * stride + x];
      texel.weight = std::max(0.0f, luminance(texel.value) - offset);
      if (x < width_) sum += row[x] = texel.weight;
    }
    // Integral over the row's tent of the interpolated sine: 1/3 of its own, 1/6 of the neighbour's, on each side.
    double tent = 0;
    if (y > 0) tent += sines_[y] / 3.0 + sines_[y - 1] / 6.0;
    if (y + 1 < height_) tent += sines_[y] / 3.0 + sines_[y + 1] / 6.0;
    row_sums[y] = static_cast<float>(sum * tent);
    z += sum * tent;
    columns_.emplace_back(sum > 0 ? row : ones);
  }
  rows_ = Discrete(row_sums);
  inverse_z_ = static_cast<float>(static_cast<double>(width_) * (height_ - 1) / z);
}

EnvironmentImage::UvLookup EnvironmentImage::lookup_uv(float u, float v) const {
  const float x = u * static_cast<float>(width_) - 0.5f, y = v * static_cast<float>(height_ - 1);
  int column = static_cast<int>(std::floor(x));
  const int row = std::clamp(static_cast<int>(y), 0, height_ - 2);
  const float fx = x - static_cast<float>(column), fy = y - static_cast<float>(row);
  if (column < 0) column += width_;
  column = std::clamp(column, 0, width_ - 1);
  const Texel* top = texels_.data() + static_cast<size_t>(row) * (width_ + 1) + column;
  const Texel* bottom = top + width_ + 1;
  const float w00 = (1 - fx) * (1 - fy), w10 = fx * (1 - fy), w01 = (1 - fx) * fy, w11 = fx * fy;
  const float weight = top[0].weight * w00 + top[1].weight * w10 + bottom[0].weight * w01 + bottom[1].weight * w11;
  return {top[0].value * w00 + top[1].value * w10 + bottom[0].value * w01 + bottom[1].value * w11,
          weight * lerp(fy, sines_[row], sines_[row + 1]) * inverse_z_};
}

EnvironmentImage::Lookup EnvironmentImage::lookup(const Vec3& d) const {
  float u = std::atan2(d.x, -d.z) * (0.5f * kInvPi);
  if (u < 0) u += 1;
  const float sine = std::sqrt(d.x * d.x + d.z * d.z);
  const float v = std::atan2(sine, d.y) * kInvPi;
  const UvLookup found = lookup_uv(u, v);
  // d(omega) = sin(theta) d(theta) d(phi) = 2 pi^2 sin(theta) du dv.
  return {found.value, sine > 0 ? found.pdf_uv / (2 * kPi * kPi * sine) : 0};
}

/// Distance from `row` in rows, in (-1, 1), with density proportional to the tent times the interpolated sine.
float EnvironmentImage::sample_row_offset(int row, float u) const {
  const float s = sines_[row];
  const float above = row > 0 ? s / 3 + sines_[row - 1] / 6 : 0;
  const float below = row + 1 < height_ ? s / 3 + sines_[row + 1] / 6 : 0;
  const float split = above / (above + below);
  const bool upwards = u < split;
  u = upwards ? 1 - u / split : (u - split) / (1 - split);  // continuous across the row
  u = clamp01(u);
  const float slope = (upwards ? sines_[row - 1] : sines_[row + 1]) - s;
  // Density (1 - t)(s + slope t); its integral s t + (slope - s) t^2/2 - slope t^3/3 = u (s/2 + slope/6), by Newton's
  // method inside a bracket, from the solution for slope 0.
  const float target = u * (s / 2 + slope / 6);
  float lower = 0, upper = 1, t = 1 - safe_sqrt(1 - u);
  for (int i = 0; i < 12; ++i) {
    const float excess = t * (s + t * ((slope - s) * 0.5f - t * slope * (1.0f / 3))) - target;
    (excess > 0 ? upper : lower) = t;
    const float density = (1 - t) * (s + slope * t);
    float next = density > 0 ? t - excess / density : 0.5f * (lower + upper);
    if (!(next >= lower && next <= upper)) next = 0.5f * (lower + upper);
    const float change = std::abs(next - t);
    t = next;
    if (change < 1e-6f) break;
  }
  return upwards ? -t : t;
}

EnvironmentImage::Sample EnvironmentImage::sample(Vec2 u) const {
  if (black_) return {{0, 1, 0}, Spectrum(), 0};
  const Discrete::Result row = rows_.sample(u.y);
  const Discrete::Result column = columns_[row.index].sample(u.x);
  const float y = static_cast<float>(row.index) + sample_row_offset(static_cast<int>(row.index), row.remapped);
  const float v = clamp01(y / static_cast<float>(height_ - 1));
  float s = (static_cast<float>(column.index) + 0.5f + warp::interval_to_tent(column.remapped, 1)) /
            static_cast<float>(width_);
  s = clamp01(s < 0 ? s + 1 : (s >= 1 ? s - 1 : s));

  const float theta = v * kPi, phi = s * kTwoPi;
  const float sine = std::sin(theta);
  const UvLookup found = lookup_uv(s, v);
  Sample sample;
  sample.d = {std::sin(phi) * sine, std::cos(theta), -std::cos(phi) * sine};
  sample.value = found.value;
  sample.pdf_solid_angle = sine > 1e-8f ? found.pdf_uv / (2 * kPi * kPi * sine) : 0;
  return sample;
}

}  // namespace covary
