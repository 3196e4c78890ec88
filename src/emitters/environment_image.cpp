// SPDX-License-Identifier: Apache-2.0
#include "emitters/environment_image.h"

#include "core/error.h"
#include "core/warp.h"

namespace covary {
namespace {

constexpr int kLanes = 16;  // of loops that are vectorised

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

/// Chooses one of four cells in proportion to their weights, at least one of which is positive. Values are selected
/// instead of branching, which half of the time would be mispredicted, and does not vectorise.
inline CellChoice choose_cell(float w0, float w1, float w2, float w3, float u) {
  const float b1 = w0, b2 = b1 + w1, b3 = b2 + w2, x = u * (b3 + w3);
  int last = w1 > 0 ? 1 : 0;  // rounding can select an empty last cell
  last = w2 > 0 ? 2 : last;
  last = w3 > 0 ? 3 : last;
  int index = x >= b1 ? 1 : 0;
  index = x >= b2 ? 2 : index;
  index = x >= b3 ? 3 : index;
  index = std::min(index, last);
  float lower = 0, weight = w0;
  lower = index == 1 ? b1 : lower, weight = index == 1 ? w1 : weight;
  lower = index == 2 ? b2 : lower, weight = index == 2 ? w2 : weight;
  lower = index == 3 ? b3 : lower, weight = index == 3 ? w3 : weight;
  const float remapped = (x - lower) / weight;
  return {index, std::max(0.0f, std::min(remapped, kOneMinusEpsilon))};
}

/// choose_cell() for `n` samples, rounded up to whole vectors; `u` is remapped.
void choose_cells(int n, const float (&weights)[4][EnvironmentSamples::kCapacity], float* u, int* index) {
  for (int first = 0; first < n; first += kLanes) {
#pragma GCC ivdep
    for (int l = first; l < first + kLanes; ++l) {
      const CellChoice choice = choose_cell(weights[0][l], weights[1][l], weights[2][l], weights[3][l], u[l]);
      index[l] = choice.index, u[l] = choice.remapped;
    }
  }
}

/// Where `u` and `v` in [0, 1) lie in the tent of a texel, or at a pole in the half of it that is inside the image.
inline Vec2 point_in(int column, int row, float u, float v, int width, int height) {
  const float half_tent = 1 - safe_sqrt(1 - v);
  float offset = warp::interval_to_tent(v, 1);
  offset = row == 0 ? half_tent : offset;
  offset = row == height - 1 ? -half_tent : offset;
  const float y = clamp01((static_cast<float>(row) + offset) / static_cast<float>(height - 1));
  const float x = (static_cast<float>(column) + 0.5f + warp::interval_to_tent(u, 1)) / static_cast<float>(width);
  float around = x < 0 ? x + 1 : x;
  around = x >= 1 ? x - 1 : around;
  return {clamp01(around), y};
}

struct Direction {
  Vec3 d;
  float sine;  // of the angle to the y axis
};
inline Direction direction_of(Vec2 at) {
  const SinCos theta = sincos_turns(0.5f * at.y), phi = sincos_turns(at.x);
  return {{phi.sin * theta.sin, theta.cos, -phi.cos * theta.sin}, theta.sin};
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

inline EnvironmentImage::Cell EnvironmentImage::cell_at(float u, float v, int width, int height) {
  const float x = u * static_cast<float>(width) - 0.5f, y = v * static_cast<float>(height - 1);
  int column = static_cast<int>(std::floor(x));
  const int row = std::clamp(static_cast<int>(y), 0, height - 2);
  const float fx = x - static_cast<float>(column), fy = y - static_cast<float>(row);
  column = column < 0 ? column + width : column;
  column = std::clamp(column, 0, width - 1);
  return {column, column + 1 < width ? column + 1 : 0, row, fx, fy};
}

inline EnvironmentImage::Corners EnvironmentImage::corners_of(int column, int next, int row) const {
  const Texel* upper = texels_.data() + layout_.row_offset(row);
  const Texel* lower = texels_.data() + layout_.row_offset(row + 1);
  const size_t left = BlockLayout::column_offset(column), right = BlockLayout::column_offset(next);
  return {upper + left, upper + right, lower + left, lower + right};
}

inline EnvironmentImage::UvLookup EnvironmentImage::interpolate(const Corners& corners, float fx, float fy) const {
  const float w00 = (1 - fx) * (1 - fy), w10 = fx * (1 - fy), w01 = (1 - fx) * fy, w11 = fx * fy;
  const auto& [t00, t10, t01, t11] = corners;
  return {t00->value * w00 + t10->value * w10 + t01->value * w01 + t11->value * w11,
          (t00->weight * w00 + t10->weight * w10 + t01->weight * w01 + t11->weight * w11) * inverse_z_};
}

EnvironmentImage::Lookup EnvironmentImage::lookup(const Vec3& d) const {
  const float sine = std::sqrt(d.x * d.x + d.z * d.z);
  const UvLookup found = interpolate(cell_at(angle_turns(d.x, -d.z), 2 * angle_turns(sine, d.y), width_, height_));
  // d(omega) = sin(theta) d(theta) d(phi) = 2 pi^2 sin(theta) du dv.
  return {found.value, sine > 0 ? found.pdf_uv / (2 * kPi * kPi * sine) : 0};
}

inline std::array<float, EnvironmentImage::kBlock> EnvironmentImage::row_weights(const Texel* block, int y0) const {
  std::array<float, kBlock> weights;
  for (int i = 0; i < kBlock; ++i) {
    const Texel* row = block + i * kBlock;
    weights[i] = ((row[0].weight + row[1].weight) + (row[2].weight + row[3].weight)) * tent_mass(y0 + i);
  }
  return weights;
}

EnvironmentImage::Sample EnvironmentImage::sample(Vec2 u) const {
  if (black_) return {{0, 1, 0}, Spectrum(), 0};
  const BlockChoice chosen = choose_block(u);

  // A texel of the block: row from the remapped u.y, column from the remapped u.x.
  const Texel* texels = block(chosen);
  const int x0 = static_cast<int>(chosen.x) * kBlock, y0 = static_cast<int>(chosen.y) * kBlock;
  const std::array<float, kBlock> rows = row_weights(texels, y0);
  const CellChoice row = choose_cell(rows[0], rows[1], rows[2], rows[3], chosen.remapped.y);
  texels += row.index * kBlock;
  const CellChoice column =
      choose_cell(texels[0].weight, texels[1].weight, texels[2].weight, texels[3].weight, chosen.remapped.x);

  const Vec2 at = point_in(x0 + column.index, y0 + row.index, column.remapped, row.remapped, width_, height_);
  const Direction towards = direction_of(at);
  const UvLookup found = interpolate(cell_at(at.x, at.y, width_, height_));
  return {towards.d, found.value, towards.sine > 1e-8f ? found.pdf_uv / (2 * kPi * kPi * towards.sine) : 0};
}

void EnvironmentImage::sample(EnvironmentSamples& samples) const {
  constexpr int kMax = EnvironmentSamples::kCapacity;
  const int n = samples.size;
  if (black_) {
    for (int l = 0; l < n; ++l) samples.pdf_solid_angle[l] = 0;
    return;
  }
  // Memory accesses of a step overlap: entries of the tables, then texels.
  Discrete::Result block_rows[kMax];
  for (int l = 0; l < n; ++l) {
    block_rows[l] = block_rows_.sample(samples.u_y[l]);
    block_columns_[block_rows[l].index].prefetch(samples.u_x[l]);
  }
  alignas(64) float weights[kBlock][kMax] = {}, rest_x[kMax] = {}, rest_y[kMax] = {};
  alignas(64) int column[kMax] = {}, row[kMax] = {};
  const Texel* texels[kMax];
  for (int l = 0; l < n; ++l) {
    const AliasTable::Result found = block_columns_[block_rows[l].index].sample(samples.u_x[l]);
    column[l] = static_cast<int>(found.index) * kBlock, row[l] = static_cast<int>(block_rows[l].index) * kBlock;
    rest_x[l] = found.remapped, rest_y[l] = block_rows[l].remapped;
    texels[l] = texels_.data() + layout_.index(column[l], row[l]);
    for (int i = 0; i < kBlock; ++i) __builtin_prefetch(texels[l] + i * kBlock);
  }
  for (int l = 0; l < n; ++l) {
    const std::array<float, kBlock> rows = row_weights(texels[l], row[l]);
    for (int i = 0; i < kBlock; ++i) weights[i][l] = rows[i];
  }
  alignas(64) int row_in_block[kMax] = {}, column_in_block[kMax] = {};
  choose_cells(n, weights, rest_y, row_in_block);
  for (int l = 0; l < n; ++l) {
    for (int i = 0; i < kBlock; ++i) weights[i][l] = texels[l][row_in_block[l] * kBlock + i].weight;
    row[l] += row_in_block[l];
  }
  choose_cells(n, weights, rest_x, column_in_block);
  alignas(64) float sine[kMax], right[kMax], below[kMax];
  alignas(64) int next[kMax];
  const int width = width_, height = height_;
  for (int first = 0; first < n; first += kLanes) {
#pragma GCC ivdep
    for (int l = first; l < first + kLanes; ++l) {
      const Vec2 at = point_in(column[l] + column_in_block[l], row[l], rest_x[l], rest_y[l], width, height);
      const Direction towards = direction_of(at);
      samples.wi_x[l] = towards.d.x, samples.wi_y[l] = towards.d.y, samples.wi_z[l] = towards.d.z;
      sine[l] = towards.sine;
      const Cell cell = cell_at(at.x, at.y, width, height);
      column[l] = cell.column, next[l] = cell.next, row[l] = cell.row, right[l] = cell.right, below[l] = cell.below;
    }
  }
  Corners corners[kMax];
  for (int l = 0; l < n; ++l) {
    corners[l] = corners_of(column[l], next[l], row[l]);
    for (const Texel* corner : corners[l]) __builtin_prefetch(corner);
  }
  for (int l = 0; l < n; ++l) {
    const UvLookup found = interpolate(corners[l], right[l], below[l]);
    samples.r[l] = found.value.r, samples.g[l] = found.value.g, samples.b[l] = found.value.b;
    samples.pdf_solid_angle[l] = sine[l] > 1e-8f ? found.pdf_uv / (2 * kPi * kPi * sine[l]) : 0;
  }
}

}  // namespace covary
