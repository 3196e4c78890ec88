// SPDX-License-Identifier: Apache-2.0
#include "emitters/environment_image.h"

#include "core/error.h"
#include "core/warp.h"

namespace covary {
namespace {

/// Integral over t in [0, 1] of the tent (1 - t) times sin(theta + direction t d): half the tent of the row at angle
/// `theta`, with row spacing d; `direction` is +1 or -1.
double tent_times_sine(double theta, double d, double direction) {
  const double end = theta + direction * d;
  // Integrated by parts; the difference cancels for tiny d, but double precision leaves enough digits.
  return direction * std::cos(theta) / d - (std::sin(end) - std::sin(theta)) / (d * d);
}

struct CellChoice {
  int index;
  float remapped;  // uniform in [0, 1) again
};

/// Chooses one of four cells in proportion to their weights, at least one of which is positive.
CellChoice choose_cell(const float (&weights)[4], float u) {
  // Cell boundaries; comparisons instead of branches, half of which would be mispredicted.
  const float b1 = weights[0], b2 = b1 + weights[1], b3 = b2 + weights[2], sum = b3 + weights[3];
  const float x = u * sum;
  int index = (x >= b1) + (x >= b2) + (x >= b3);
  while (!(weights[index] > 0)) index = (index + 3) % 4;  // rounding can select an empty last cell
  const float lower = index == 0 ? 0 : (index == 1 ? b1 : (index == 2 ? b2 : b3));
  return {index, std::clamp((x - lower) / weights[index], 0.0f, kOneMinusEpsilon)};
}

}  // namespace

EnvironmentImage::EnvironmentImage(const TexelImage& image, float scale, bool mis_compensation)
    : width_(image.width), height_(std::max(image.height, 3)), layout_(width_, height_) {
  COVARY_CHECK(image.channels == 3 && image.floats.size() == image.n_pixels() * 3 && image.n_pixels() > 0,
               "an environment needs a linear RGB image");
  texels_.resize(layout_.size());

  // Copies the texels and integrates over the sphere: the tent of each row against the sine.
  const double step = static_cast<double>(M_PI) / (height_ - 1);
  double integral[3] = {0, 0, 0}, luminance_integral = 0;
  for (int y = 0; y < height_; ++y) {
    double row_weight = 0;
    if (y > 0) row_weight += tent_times_sine(y * step, step, -1);
    if (y + 1 < height_) row_weight += tent_times_sine(y * step, step, 1);
    const double per_texel = row_weight * step * 2 * M_PI / width_;
    for (int x = 0; x < width_; ++x) {
      const float* rgb = image.floats.data() + (static_cast<size_t>(std::min(y, image.height - 1)) * width_ + x) * 3;
      const Spectrum value = Spectrum(rgb[0], rgb[1], rgb[2]) * scale;
      texels_[layout_.index(x, y)].value = value;
      for (int c = 0; c < 3; ++c) integral[c] += per_texel * value[c];
      luminance_integral += per_texel * luminance(value);
      largest_ = std::max(largest_, luminance(value));
    }
  }
  for (int c = 0; c < 3; ++c) integral_[c] = static_cast<float>(integral[c]);

  mean_luminance_ = static_cast<float>(luminance_integral / (4 * M_PI));
  make_tables(mis_compensation);
}

EnvironmentImage EnvironmentImage::compensated() const {
  EnvironmentImage result = *this;
  result.make_tables(true);
  return result;
}

void EnvironmentImage::make_tables(bool mis_compensation) {
  compensated_ = mis_compensation;
  // [Karlik2019] Sec. 4: the mean over the sphere is subtracted; a constant map keeps its weights.
  float offset = mis_compensation ? mean_luminance_ : 0.0f;
  if (largest_ <= 1.01f * offset) offset = 0;
  black_ = !(largest_ > 0);
  if (black_) return;

  const double step = static_cast<double>(M_PI) / (height_ - 1);
  std::vector<float> row_sums(layout_.blocks_y()), row(layout_.blocks_x());
  const std::vector<float> ones(layout_.blocks_x(), 1.0f);
  double z = 0;
  block_columns_.clear();
  block_columns_.reserve(layout_.blocks_y());
  for (int block_y = 0; block_y < layout_.blocks_y(); ++block_y) {
    std::fill(row.begin(), row.end(), 0.0f);
    double sum = 0;
    for (int y = block_y * kBlock; y < std::min((block_y + 1) * kBlock, height_); ++y) {
      // The tent at a pole has the mean sine of a third of a row away.
      const double sine = tent_mass(y) < 1 ? std::sin(step / 3) : std::sin(y * step);
      for (int x = 0; x < width_; ++x) {
        Texel& texel = texels_[layout_.index(x, y)];
        texel.weight = static_cast<float>(sine * std::max(0.0f, luminance(texel.value) - offset));
        row[x / kBlock] += texel.weight * tent_mass(y);
        sum += texel.weight * tent_mass(y);
      }
    }
    row_sums[block_y] = static_cast<float>(sum);
    z += sum;
    block_columns_.emplace_back(sum > 0 ? row : ones);
  }
  block_rows_ = Discrete(row_sums);
  inverse_z_ = static_cast<float>(static_cast<double>(width_) * (height_ - 1) / z);
}

EnvironmentImage::UvLookup EnvironmentImage::lookup_uv(float u, float v) const {
  const float x = u * static_cast<float>(width_) - 0.5f, y = v * static_cast<float>(height_ - 1);
  int column = static_cast<int>(std::floor(x));
  const int row = std::clamp(static_cast<int>(y), 0, height_ - 2);
  const float fx = x - static_cast<float>(column), fy = y - static_cast<float>(row);
  if (column < 0) column += width_;
  column = std::clamp(column, 0, width_ - 1);
  const int next = column + 1 < width_ ? column + 1 : 0;
  const Texel *upper = texels_.data() + layout_.row_offset(row), *lower = texels_.data() + layout_.row_offset(row + 1);
  const size_t left = BlockLayout::column_offset(column), right = BlockLayout::column_offset(next);
  const Texel &t00 = upper[left], &t10 = upper[right], &t01 = lower[left], &t11 = lower[right];
  const float w00 = (1 - fx) * (1 - fy), w10 = fx * (1 - fy), w01 = (1 - fx) * fy, w11 = fx * fy;
  return {t00.value * w00 + t10.value * w10 + t01.value * w01 + t11.value * w11,
          (t00.weight * w00 + t10.weight * w10 + t01.weight * w01 + t11.weight * w11) * inverse_z_};
}

EnvironmentImage::Lookup EnvironmentImage::lookup(const Vec3& d) const {
  const float sine = std::sqrt(d.x * d.x + d.z * d.z);
  const UvLookup found = lookup_uv(angle_turns(d.x, -d.z), 2 * angle_turns(sine, d.y));
  // d(omega) = sin(theta) d(theta) d(phi) = 2 pi^2 sin(theta) du dv.
  return {found.value, sine > 0 ? found.pdf_uv / (2 * kPi * kPi * sine) : 0};
}

void EnvironmentImage::prefetch_table(Vec2 u) const {
  if (!black_) block_columns_[block_rows_.sample(u.y).index].prefetch(u.x);
}

void EnvironmentImage::prefetch_texels(Vec2 u) const {
  if (black_) return;
  const Texel* texels = block(choose_block(u));
  for (int i = 0; i < kBlock; ++i) __builtin_prefetch(texels + i * kBlock);
}

EnvironmentImage::Sample EnvironmentImage::sample(Vec2 u) const {
  if (black_) return {{0, 1, 0}, Spectrum(), 0};
  const BlockChoice chosen = choose_block(u);

  // A texel of the block: row from the remapped u.y, column from the remapped u.x.
  const Texel* texels = block(chosen);
  const int x0 = static_cast<int>(chosen.x) * kBlock, y0 = static_cast<int>(chosen.y) * kBlock;
  float row_weights[kBlock], columns[kBlock];
  for (int i = 0; i < kBlock; ++i) {
    const Texel* row = texels + i * kBlock;
    row_weights[i] = ((row[0].weight + row[1].weight) + (row[2].weight + row[3].weight)) * tent_mass(y0 + i);
  }
  const CellChoice row = choose_cell(row_weights, chosen.remapped.y);
  for (int i = 0; i < kBlock; ++i) columns[i] = texels[row.index * kBlock + i].weight;
  const CellChoice column = choose_cell(columns, chosen.remapped.x);

  // A position in the texel's tent, or at a pole in the half of it that lies inside the image.
  const int y = y0 + row.index;
  const float half_tent = 1 - safe_sqrt(1 - row.remapped);
  const float offset = y == 0 ? half_tent : (y == height_ - 1 ? -half_tent : warp::interval_to_tent(row.remapped, 1));
  const float v = clamp01((static_cast<float>(y) + offset) / static_cast<float>(height_ - 1));
  float s = (static_cast<float>(x0 + column.index) + 0.5f + warp::interval_to_tent(column.remapped, 1)) /
            static_cast<float>(width_);
  s = clamp01(s < 0 ? s + 1 : (s >= 1 ? s - 1 : s));

  const SinCos theta = sincos_turns(0.5f * v), phi = sincos_turns(s);
  const UvLookup found = lookup_uv(s, v);
  Sample sample;
  sample.d = {phi.sin * theta.sin, theta.cos, -phi.cos * theta.sin};
  sample.value = found.value;
  sample.pdf_solid_angle = theta.sin > 1e-8f ? found.pdf_uv / (2 * kPi * kPi * theta.sin) : 0;
  return sample;
}

}  // namespace covary
