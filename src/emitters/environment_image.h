// SPDX-License-Identifier: Apache-2.0
// An image on the sphere of directions, with a sampler whose density follows its bilinear interpolation.
//
// Mapping (Mitsuba 3's): u = atan2(x, -z) / 2 pi wraps around, v = acos(y) / pi runs from the top (+y) to the bottom.
// Texel column i is centred at u = (i + 0.5) / width; row j lies at v = j / (height - 1), so the first and last rows
// are the poles.
//
// Sampling. With the tent functions h of the interpolation and texel weights w_ij = sin(theta_j) max(0, luminance -
// offset), the density per unit (u, v) area is the interpolation of the weights,
//     p(u, v) = sum_ij w_ij h_i(u) h_j(v) / Z,
// sampled by choosing a texel, then a position within its tent. Per unit solid angle this is the luminance over its
// integral, except for how the sine varies within a row: value over density is nearly constant however small the sun,
// and the density is positive wherever the interpolated luminance is (rows at the poles use the mean sine of their
// tents, not zero).
//
// Texels are stored in 4 x 4 blocks, and the tables choose blocks: tables a sixteenth of the size stay in cache, and a
// sample then touches one or two places in the large array.
#pragma once

#include <array>
#include <vector>

#include "core/distribution.h"
#include "core/large_vector.h"
#include "core/spectrum.h"
#include "core/vec.h"
#include "scene/emitter.h"
#include "textures/block_layout.h"
#include "textures/image.h"

namespace covary {

class EnvironmentImage {
 public:
  /// `image`: linear RGB floats as from read_linear_rgb(), at least one pixel; with fewer than three rows, the last row
  /// is repeated. `scale` multiplies all values, >= 0. `mis_compensation`: subtract the mean luminance from the
  /// sampling weights (Karlík et al. 2019), for use together with a strategy that covers all directions.
  EnvironmentImage(const TexelImage& image, float scale, bool mis_compensation);
  /// The same light, sampled with `mis_compensation`.
  EnvironmentImage compensated() const;
  bool is_compensated() const { return compensated_; }

  struct Lookup {
    Spectrum value;
    float pdf_solid_angle;  ///< density of sample() at the direction
  };
  Lookup lookup(const Vec3& d) const;

  struct Sample {
    Vec3 d;
    Spectrum value;
    float pdf_solid_angle;  ///< 0 if the image is black
  };
  Sample sample(Vec2 u) const;
  /// sample() of each `u`, up to rounding; `wi` is `d`.
  void sample(EnvironmentSamples& samples) const;
  /// Integral of the value over the sphere of directions.
  const Spectrum& integral() const { return integral_; }

 private:
  static constexpr int kBlock = BlockLayout::kBlock;
  struct Texel {
    Spectrum value;
    float weight;  // w; zero for padding
  };
  /// The block that sample(u) uses, and the remapped u.
  struct BlockChoice {
    uint32_t x, y;
    Vec2 remapped;
  };
  BlockChoice choose_block(Vec2 u) const {
    const Discrete::Result row = block_rows_.sample(u.y);
    const AliasTable::Result column = block_columns_[row.index].sample(u.x);
    return {column.index, row.index, {column.remapped, row.remapped}};
  }
  const Texel* block(const BlockChoice& at) const {
    return texels_.data() + layout_.index(static_cast<int>(at.x) * kBlock, static_cast<int>(at.y) * kBlock);
  }
  /// Value and the sampling density per unit (u, v) area at u in [0, 1], v in [0, 1].
  struct UvLookup {
    Spectrum value;
    float pdf_uv;
  };
  /// The four texels around a point, and the weights of those to the right and below.
  struct Cell {
    int column, next, row;
    float right, below;
  };
  static Cell cell_at(float u, float v, int width, int height);
  using Corners = std::array<const Texel*, 4>;
  Corners corners_of(int column, int next, int row) const;
  UvLookup interpolate(const Corners& corners, float right, float below) const;
  UvLookup interpolate(const Cell& cell) const {
    return interpolate(corners_of(cell.column, cell.next, cell.row), cell.right, cell.below);
  }
  /// Weights of the rows of a block that begins at row `y0`.
  std::array<float, kBlock> row_weights(const Texel* block, int y0) const;
  /// Fraction of a row's tent that lies inside the image.
  float tent_mass(int row) const { return row == 0 || row == height_ - 1 ? 0.5f : 1.0f; }

  /// Computes sampling weights and tables from the values.
  void make_tables(bool mis_compensation);

  int width_, height_;
  BlockLayout layout_;
  LargeVector<Texel> texels_;
  Discrete block_rows_;  // empty if nothing is to be sampled
  std::vector<AliasTable> block_columns_;
  bool black_ = true, compensated_ = false;
  float mean_luminance_ = 0, largest_ = 0;  // luminance: mean over the sphere, maximum over texels
  float inverse_z_ = 0;
  Spectrum integral_;
};

}  // namespace covary
