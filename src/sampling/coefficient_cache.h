// SPDX-License-Identifier: Apache-2.0
// Learns control-variate coefficients in spatial cells ([Hua2023] Sec. 4.2 and 6.1):
//
//     while a wave of samples is traced    each thread adds to its own SystemSums from new_sums()
//     after each tile, in order            absorb()
//     after the wave                       update(): solves all cells; table() then serves the next wave
//
// Beyond the paper: cells by normal as well; a pyramid of ever wider cells, each shrunk towards its parent where it has
// little data; a test of each cell's coefficients on the vertices of the next wave, which scales the control or
// switches it off; a memory limit, met by doubling the width of the cells.
#pragma once

#include <cstdint>
#include <vector>

#include "sampling/coefficient_table.h"

namespace covary {

struct CacheSettings {
  uint32_t resolution = 64;    ///< cells along the longest side of the scene, 1 to CellGrid::kMaxResolution
  bool by_normal = true;       ///< distinguish normals
  bool pyramid = true;         ///< false: cells are independent, and a cell without data uses no control
  bool held_out = true;        ///< scale each cell's control by its performance in the next wave
  bool monochrome = false;     ///< one coefficient for all channels
  bool by_channel = false;     ///< SystemLayout::by_channel, unless monochrome
  double prior_samples = 0.3;  ///< SolveSettings::prior_samples
  double prior_vertices = 32;  ///< number of held-out vertices that the parent's scale is worth
  size_t memory_limit = size_t{256} << 20;  ///< bytes of sums and coefficients while training
  /// As published: position only, independent cells, no test. The prior is the weakest that is useful: without any,
  /// lights that are only found by directions, with tiny weights, have unbounded coefficients.
  static CacheSettings published(uint32_t resolution);
};

class CoefficientCache {
 public:
  CoefficientCache() = default;
  /// `light_counts`: N_k, the expected number of samples that a vertex takes of light (or cluster) k; with one light
  /// sample, its probability. `n_dense`: number of dense techniques. Throws like CellGrid.
  CoefficientCache(const Bounds3& bounds, std::vector<float> light_counts, uint32_t n_dense,
                   const CacheSettings& settings);

  /// What the next wave reads. Empty before the first update(): every find() gives kNone.
  const CoefficientTable& table() const { return table_; }
  /// The key of a place, for table().find() and for sums from new_sums(); it changes only in update().
  CellKey key(const Vec3& position, const Vec3& normal) const { return table_.grid().key(position, normal); }
  /// Empty sums for one thread.
  SystemSums new_sums() const { return SystemSums(layout_, level_); }
  /// Adds sums from new_sums(). Coarsens the grid of the next update() when the memory limit is reached.
  void absorb(const SystemSums& sums);
  /// Solves all cells, in parallel; bit-identical for any number of threads.
  void update();
  /// Selection probabilities of lights for least variance: c_k proportional to the square root of c_k Σ w residual²
  /// over the samples since forget_residuals(), mixed with the former probabilities. Empty if no light was seen.
  std::vector<float> best_selection() const;
  void forget_residuals() { sums_.forget_residuals(); }
  /// Sets new expected numbers of samples of lights, `light_counts`. The table's coefficients are rescaled accordingly,
  /// and the sums, which belong to the former numbers, are discarded.
  void select(std::vector<float> light_counts);
  /// Sets CoefficientTable::selection() of the table.
  void set_selection(std::vector<float> selection) { table_.set_selection(std::move(selection)); }
  /// Discards the sums, which are needed only for training.
  void freeze();
  /// Discards everything learnt.
  void restart();

  uint64_t n_rejected() const { return sums_.n_rejected() + n_rejected_; }  ///< samples ignored: not finite
  uint32_t n_coarsened() const { return sums_.level(); }  ///< times the cells were widened to save memory
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
  uint64_t n_rejected_ = 0;  // of sums already discarded
  SystemSums sums_;
  CoefficientTable table_;
};

}  // namespace covary
