// SPDX-License-Identifier: Apache-2.0
// Sums of the normal equations (coefficient_solver.h) of many cells, sparse in cells and lights. Each thread adds the
// samples of a tile to its own sums; these are then merged in the order of tiles, so that the totals are bit-identical
// for any number of threads.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/large_vector.h"
#include "core/random.h"
#include "sampling/coefficient_solver.h"

namespace covary {

/// A cell of a regular grid: coordinates below 2^17, its kind (class of normals, below 32), and its level (below 256):
/// how many times coarser by two its grid is than the finest.
struct CellKey {
  static constexpr uint32_t kMaxCoordinate = (1u << 17) - 1;
  uint64_t bits = 0;

  CellKey() = default;
  CellKey(uint32_t x, uint32_t y, uint32_t z, uint32_t kind, uint32_t level)
      : bits(x | (uint64_t{y} << 17) | (uint64_t{z} << 34) | (uint64_t{kind} << 51) | (uint64_t{level} << 56)) {}
  uint32_t x() const { return static_cast<uint32_t>(bits) & kMaxCoordinate; }
  uint32_t y() const { return static_cast<uint32_t>(bits >> 17) & kMaxCoordinate; }
  uint32_t z() const { return static_cast<uint32_t>(bits >> 34) & kMaxCoordinate; }
  uint32_t kind() const { return static_cast<uint32_t>(bits >> 51) & 31; }
  uint32_t level() const { return static_cast<uint32_t>(bits >> 56); }
  /// The cell of a grid with 2^n times wider cells. Cells of different kinds stay separate.
  CellKey coarser(uint32_t n) const { return {x() >> n, y() >> n, z() >> n, kind(), level() + n}; }
  bool operator==(const CellKey&) const = default;
};

/// One sample: f/p and the balance weight of each technique that could have taken it.
///
/// Every sample counts, including zero ones: a blocked light sample has r = 1 for its light, and a failed BSDF sample r
/// = 1 for the BSDF. r_light and r_dense sum to 1.
struct ControlledSample {
  static constexpr uint32_t kNoLight = ~0u;
  Spectrum value;                  ///< f/p, without the throughput before the vertex
  uint32_t light = kNoLight;       ///< light (or cluster) that could have been sampled here, or kNoLight
  float r_light = 0;               ///< its balance weight
  std::span<const float> r_dense;  ///< balance weights of the dense techniques, as many as in the sums
};

/// Maps 64-bit keys to 0, 1, 2, … in the order of first use.
class KeyIndex {
 public:
  static constexpr uint32_t kNone = ~0u;
  /// Index of `key`, a new one if it is not present.
  uint32_t insert(uint64_t key);
  /// Index of `key`, or kNone.
  uint32_t find(uint64_t key) const;
  std::span<const uint64_t> keys() const { return keys_; }
  void clear();
  /// Reserves memory for n keys.
  void reserve(size_t n);
  /// Prefetches what find(key) reads first.
  void prefetch(uint64_t key) const {
    if (!slots_.empty()) __builtin_prefetch(&slots_[slot_of(key)]);
  }
  size_t bytes() const { return slots_.capacity() * sizeof(Slot) + keys_.capacity() * sizeof(uint64_t); }

 private:
  struct Slot {
    uint64_t key = 0;
    uint32_t number = kNone;  // kNone: empty
  };
  size_t slot_of(uint64_t key) const { return mix64(key) & (slots_.size() - 1); }
  void resize(size_t n_slots);
  LargeVector<Slot> slots_;  // open addressing; the size is a power of two
  std::vector<uint64_t> keys_;
};

class SystemSums {
 public:
  /// `level`: that of the keys.
  explicit SystemSums(SystemLayout layout = {}, uint32_t level = 0) : layout_(layout), level_(level) {}

  /// Reserves memory for these numbers of cells and rows.
  void reserve(size_t n_cells, size_t n_rows);
  /// Index of a cell, for add(); valid until clear().
  uint32_t cell(CellKey key);
  /// Adds one sample of a vertex in `cell`. A sample with a non-finite value or a non-finite or negative weight is
  /// ignored and counted. Weights r must be in [0, 1].
  void add(uint32_t cell, float weight, const ControlledSample& sample);
  /// Same if the layout is by channel, with a weight per channel.
  void add_by_channel(uint32_t cell, const Spectrum& weights, ControlledSample sample);
  /// Adds the evidence of a vertex on the coefficients in use: `plain`, the sum of its f/p, and `control`, the unscaled
  /// control added to it. The coefficients must not depend on this vertex.
  void add_held_out(uint32_t cell, float weight, const Spectrum& plain, const Spectrum& control);
  /// Adds the residual of a sample's value after its control, for the light that could have taken it: the mean over RGB
  /// of its square.
  void add_residual(uint32_t light, float weight, const Spectrum& residual);
  /// Σ w residual² of each light; lights beyond the end have none.
  std::span<const double> light_residuals() const { return light_residuals_; }
  void forget_residuals() { light_residuals_.clear(); }
  /// Adds all sums of `other`, whose level must not exceed this one's.
  void merge(const SystemSums& other);
  /// Scales the sums of held-out vertices, which judged older coefficients.
  void scale_held_out(double factor);
  void clear();

  const SystemLayout& layout() const { return layout_; }
  uint32_t level() const { return level_; }
  uint32_t n_cells() const { return static_cast<uint32_t>(cells_.keys().size()); }
  size_t n_rows() const { return rows_index_.keys().size(); }
  CellKey key(uint32_t cell) const;
  std::span<const double> head(uint32_t cell) const;
  /// Cell and light of a row; rows are in the order of their first samples.
  uint32_t row_cell(size_t row) const { return static_cast<uint32_t>(rows_index_.keys()[row] >> 32); }
  uint32_t row_light(size_t row) const { return static_cast<uint32_t>(rows_index_.keys()[row]); }
  std::span<const float> row(size_t row) const;
  uint64_t n_rejected() const { return n_rejected_; }  ///< samples ignored because they were not finite
  size_t bytes() const;

 private:
  SystemLayout layout_;
  uint32_t level_;
  KeyIndex cells_, rows_index_;  // rows: cell index << 32 | light
  std::vector<double> heads_;
  std::vector<float> rows_;  // many, hence single precision, whose error is far below that of the samples
  std::vector<double> light_residuals_;
  uint64_t n_rejected_ = 0;
};

}  // namespace covary
