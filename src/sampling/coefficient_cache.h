// SPDX-License-Identifier: Apache-2.0
// Learns the coefficients of control variates in cells of space ([Hua2023] Sec. 4.2 and 6.1):
//
//     while a wave of samples is traced    each thread adds to SystemSums made by new_sums()
//     after each tile, in their order      absorb()
//     after the wave                       update(): solves all cells; table() then serves the next wave
//
// What is ours: cells by normal too; a pyramid of ever wider cells, each drawn to its parent where it has little data;
// a test of each cell's coefficients by the vertices of the next wave, which scales the control or switches it off;
// a limit of memory, kept by cells twice as wide.
#pragma once

#include <cstdint>
#include <vector>

#include "sampling/coefficient_table.h"

namespace covary {

struct CacheSettings {
  uint32_t resolution = 64;    ///< cells along the longest side of the scene, 1 to CellGrid::kMaxResolution
  bool by_normal = true;       ///< tell normals apart
  bool pyramid = true;         ///< false: each cell stands alone, and without data is plain
  bool held_out = true;        ///< scale each cell's control by what the next wave says of it
  bool monochrome = false;     ///< one coefficient for all channels
  bool by_channel = false;     ///< SystemLayout::by_channel, unless monochrome
  double prior_samples = 0.3;  ///< SolveSettings::prior_samples
  double prior_vertices = 32;  ///< how many held-out vertices the parent's scale counts as
  size_t memory_limit = size_t{256} << 20;  ///< bytes of sums and coefficients while training
  /// As published: position only, cells alone, no test. The pull is as small as has a use: without any, lights that
  /// only directions find, with tiny weights, have coefficients without limit.
  static CacheSettings published(uint32_t resolution);
};

class CoefficientCache {
 public:
  CoefficientCache() = default;
  /// `light_counts`: N_k, the expected number of samples that a vertex takes by light (or cluster) k, for one light
  /// sample its probability. `n_dense`: number of dense techniques. Throws like CellGrid.
  CoefficientCache(const Bounds3& bounds, std::vector<float> light_counts, uint32_t n_dense,
                   const CacheSettings& settings);

  /// What the next wave reads. Empty before the first update(): every find() gives kNone.
  const CoefficientTable& table() const { return table_; }
  /// The key of a place, for table().find() and for sums made by new_sums(); it changes only in update().
  CellKey key(const Vec3& position, const Vec3& normal) const { return table_.grid().key(position, normal); }
  /// Empty sums for one thread.
  SystemSums new_sums() const { return SystemSums(layout_, level_); }
  /// Adds sums of new_sums(). Coarsens the grid of the next update() when memory has reached its limit.
  void absorb(const SystemSums& sums);
  /// Solves all cells, in parallel; the number of threads changes no bit.
  void update();
  /// How probable lights should be for the least variance: c_k in proportion to the root of c_k Σ w residual² over the
  /// samples since forget_residuals(), and for a part as before. Empty where no light was seen.
  std::vector<float> best_selection() const;
  void forget_residuals() { sums_.forget_residuals(); }
  /// Lights have other expected numbers of samples from now on: `light_counts`. The table's coefficients are changed
  /// accordingly, and the sums, which belong to the former numbers, are forgotten.
  void select(std::vector<float> light_counts);
  /// CoefficientTable::selection() of the table.
  void set_selection(std::vector<float> selection) { table_.set_selection(std::move(selection)); }
  /// Forgets the sums, which only training needs.
  void freeze();
  /// Forgets everything that was learnt.
  void restart();

  uint64_t n_rejected() const { return sums_.n_rejected() + n_rejected_; }  ///< samples left out: not finite
  uint32_t n_coarsened() const { return sums_.level(); }  ///< times that the cells became wider to save memory
  size_t bytes() const { return sums_.bytes() + table_.bytes(); }
  const CacheSettings& settings() const { return settings_; }

 private:
  bool can_coarsen() const { return settings_.resolution >> sums_.level() > 0; }
  void coarsen();

  CacheSettings settings_;
  CellGrid finest_;
  std::vector<float> light_counts_;
  SystemLayout layout_;
  uint32_t level_ = 0;       // of the table's grid
  uint64_t n_rejected_ = 0;  // of sums that are gone
  SystemSums sums_;
  CoefficientTable table_;
};

}  // namespace covary
