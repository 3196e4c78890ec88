// SPDX-License-Identifier: Apache-2.0
// Lookup of control-variate coefficients along paths: cells of a grid by position and normal, each with its own lights,
// and coarser cells for what finer ones have not seen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/large_vector.h"
#include "core/ray.h"
#include "sampling/system_sums.h"

namespace covary {

/// Maps points to cells: cubes, `resolution` of them along the longest side of the bounds.
class CellGrid {
 public:
  static constexpr uint32_t kMaxResolution = 1u << 16;
  static constexpr uint32_t kEveryNormal = 6;  ///< CellKey::kind() when normals are not distinguished
  CellGrid() = default;
  /// Throws Error(kUsage) when the resolution is 0 or above kMaxResolution. `by_normal` distinguishes normals by the
  /// nearest of the six axis directions.
  CellGrid(const Bounds3& bounds, uint32_t resolution, bool by_normal);
  /// Points outside the bounds belong to the nearest cell. `normal` need not have unit length.
  CellKey key(const Vec3& position, const Vec3& normal) const;
  uint32_t resolution() const { return resolution_; }
  bool by_normal() const { return by_normal_; }
  /// The grid with cells twice as wide.
  CellGrid coarser() const;
  float cell_width() const { return cell_width_; }
  uint32_t level() const { return level_; }  ///< of its keys: number of coarser() calls

 private:
  friend class CoefficientTable;
  Vec3 origin_;
  float cell_width_ = 1;
  uint32_t resolution_ = 1, level_ = 0;
  bool by_normal_ = true;
};

/// Immutable once built; lookups are thread-safe. The control of a vertex is
///
///     control = light_sum + Σ_j N_j dense_j − Σ_s ( light(s) r_light(s) + Σ_j dense_j r_j(s) ),
///
/// and plain + scale · control is the controlled estimate.
class CoefficientTable {
 public:
  static constexpr uint32_t kNone = ~0u;
  CoefficientTable() = default;
  /// An empty table for lights 0 … n_lights − 1.
  CoefficientTable(const CellGrid& grid, uint32_t n_lights, uint32_t n_dense)
      : grid_(grid), n_lights_(n_lights), n_dense_(n_dense) {}

  const CellGrid& grid() const { return grid_; }
  uint32_t n_lights() const { return n_lights_; }
  uint32_t n_dense() const { return n_dense_; }
  /// The finest cell with coefficients for the place, or kNone: no control.
  uint32_t find(CellKey key) const;
  /// Prefetches what find(key) reads.
  void prefetch(CellKey key) const { index_.prefetch(key.bits); }
  /// Prefetches what scale(), light_sum() and dense() read for a cell.
  void prefetch_cell(uint32_t cell) const {
    __builtin_prefetch(&cells_[cell]), __builtin_prefetch(&dense_[size_t{cell} * n_dense_]);
  }
  /// Prefetches what light() reads.
  void prefetch_light(uint32_t cell, uint32_t light) const;

  /// Fraction of the control to use in `cell`, in [0, 1]; is_black() if the cell is switched off.
  Spectrum scale(uint32_t cell) const { return cells_[cell].scale; }
  /// Σ_k N_k β_k over all lights.
  Spectrum light_sum(uint32_t cell) const { return cells_[cell].light_sum; }
  /// β of a dense technique.
  Spectrum dense(uint32_t cell, uint32_t j) const { return dense_[size_t{cell} * n_dense_ + j]; }
  /// β of a light: from the finest of the cell and its ancestors that has seen the light, otherwise zero.
  Spectrum light(uint32_t cell, uint32_t light) const {
    const Cell& own = cells_[cell];
    return own.n_slots == kEveryLight ? slots_[own.first + light].value : light_of(cell, light);
  }

  uint32_t n_cells() const { return static_cast<uint32_t>(cells_.size()); }
  uint32_t n_switched_off() const;
  size_t bytes() const;
  /// Approximate size in bytes of a table of `n_cells` cells with `n_values` coefficients of lights.
  static size_t expected_bytes(size_t n_cells, size_t n_values) { return n_cells * 2 * sizeof(Cell) + n_values * 32; }
  uint64_t hash() const;
  /// Reserves memory for cells with these numbers of coefficients of lights.
  void reserve(std::span<const size_t> lights_per_cell);

  /// A cell to be added. Lights not in `lights` have the parent's coefficients.
  struct NewCell {
    CellKey key;
    uint32_t parent = kNone;  ///< index of the parent, added before, or kNone
    Spectrum scale, light_sum;
    std::span<const uint32_t> lights;        ///< in increasing order
    std::span<const Spectrum> light_values;  ///< β of `lights`
    std::span<const Spectrum> dense_values;  ///< β of the dense techniques
  };
  /// Adds cells, in parallel, with consecutive indices. The cell with root_key() serves every place for which no other
  /// is found.
  void add_cells(std::span<const NewCell> cells);
  static CellKey root_key() { return {0, 0, 0, 0, 255}; }

  /// Multiplies the coefficients of each light. Sums over lights are unchanged: they remain correct if the expected
  /// numbers of samples are divided by the same factors.
  void scale_lights(std::span<const float> factors);
  /// Relative probabilities of lights (or clusters), if these were learnt too; otherwise empty.
  const std::vector<float>& selection() const { return selection_; }
  void set_selection(std::vector<float> selection) { selection_ = std::move(selection); }

  /// Serialises the table, as described in docs/file-formats.md. `key` identifies what the coefficients belong to
  /// (scene and settings).
  std::string to_bytes(const std::string& key) const;
  /// Deserialises to_bytes(). `where` names the source in messages. Throws Error(kInput) when the bytes are truncated,
  /// damaged, of another version, or have another key.
  static CoefficientTable from_bytes(std::string_view bytes, const std::string& key, const std::string& where);
  /// The content of to_bytes() after its header, and back. Throws Error(kInput) for invalid bytes.
  std::string body() const;
  static CoefficientTable from_body(std::string_view bytes, const std::string& where);

 private:
  // A cell that has seen many of the lights stores a value for every light, inherited ones included; others store an
  // open-addressing table of those they have seen, and a bit set over groups of lights that usually rejects the others
  // without touching the table.
  static constexpr uint32_t kEveryLight = kNone;
  struct alignas(64) Cell {
    Spectrum scale, light_sum;
    uint32_t parent = kNone;
    uint32_t n_slots = 0;  // a power of two, 0 for no lights, or kEveryLight
    size_t first = 0;      // index into slots_
    uint64_t bits[2] = {};
    uint64_t unused = 0;  // no byte is left uninitialised, see hash()

    void note(uint32_t light) { bits[light >> 6 & 1] |= uint64_t{1} << (light & 63); }
    bool may_hold(uint32_t light) const { return bits[light >> 6 & 1] >> (light & 63) & 1; }
  };
  struct Slot {
    uint32_t light = kNone;  // kNone: empty
    Spectrum value;
  };
  Spectrum light_of(uint32_t cell, uint32_t light) const;
  uint32_t slots_for(size_t n_lights) const;
  uint32_t n_slots_of(uint32_t slots) const { return slots == kEveryLight ? n_lights_ : slots; }
  void fill(Cell& cell, const NewCell& from);
  std::vector<uint32_t> lights_of(const Cell& cell) const;

  CellGrid grid_;
  uint32_t n_lights_ = 0, n_dense_ = 0;
  uint32_t last_level_ = 0;  // highest level of any cell except the root
  uint32_t root_ = kNone;
  KeyIndex index_;
  LargeVector<Cell> cells_;
  LargeVector<Spectrum> dense_;
  LargeVector<Slot> slots_;
  std::vector<float> selection_;
};

}  // namespace covary
