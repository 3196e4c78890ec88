// SPDX-License-Identifier: Apache-2.0
#include "sampling/coefficient_cache.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {
namespace {

constexpr uint32_t kCoarsest = 4;  // cells along the longest side of the pyramid's last grid, below its root
constexpr uint32_t kChunk = 32;    // cells per task

/// The cells of one grid while they are solved, ordered along a space-filling curve: arrays over cells, and over lights
/// seen in cells.
struct Level {
  SystemLayout layout;
  std::vector<CellKey> keys;
  std::vector<double> heads;
  std::vector<size_t> first;  // index of each cell's first light, and their total number
  std::vector<uint32_t> lights;
  std::vector<float> rows;
  std::vector<uint32_t> parents;  // in the level above; empty if there is none
  std::vector<Spectrum> light_values, dense_values, scales, light_sums;

  uint32_t n_cells() const { return static_cast<uint32_t>(keys.size()); }
  size_t n_lights(uint32_t cell) const { return first[cell + 1] - first[cell]; }
  std::span<const uint32_t> lights_of(uint32_t cell) const { return {lights.data() + first[cell], n_lights(cell)}; }
  CoefficientsView coefficients(uint32_t cell) {
    return {{light_values.data() + first[cell], n_lights(cell)},
            {dense_values.data() + size_t{cell} * layout.n_dense, layout.n_dense}};
  }
  SystemView system(uint32_t cell) const {
    return {layout,
            {heads.data() + size_t{cell} * layout.head_size(), layout.head_size()},
            {lights.data() + first[cell], n_lights(cell)},
            {rows.data() + first[cell] * layout.row_size(), n_lights(cell) * layout.row_size()}};
  }
  /// Allocates the arrays over cells and, once first is known, over lights.
  void resize_cells(size_t n) {
    keys.resize(n), first.resize(n + 1), heads.resize(n * layout.head_size());
    dense_values.resize(n * layout.n_dense), scales.resize(n, Spectrum(1)), light_sums.resize(n);
  }
  void resize_lights() {
    for (size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    lights.resize(first.back()), rows.resize(first.back() * layout.row_size()), light_values.resize(first.back());
  }
};

/// An order in which the children of each cell of every coarser grid are adjacent: Morton code of x, y, z.
uint64_t curve_position(CellKey key) {
  const auto spread = [](uint64_t v) {
    v = (v | v << 32) & 0x001f00000000ffffull;
    v = (v | v << 16) & 0x001f0000ff0000ffull;
    v = (v | v << 8) & 0x100f00f00f00f00full;
    v = (v | v << 4) & 0x10c30c30c30c30c3ull;
    return (v | v << 2) & 0x1249249249249249ull;
  };
  return uint64_t{key.kind()} << 51 | spread(key.z()) << 2 | spread(key.y()) << 1 | spread(key.x());
}

/// A set of lights that can be read in increasing order.
class LightSetBits {
 public:
  explicit LightSetBits(size_t n_lights) : words_((n_lights + 63) / 64) {}
  void insert(uint32_t light) { words_[light / 64] |= uint64_t{1} << light % 64; }
  template <typename F>
  void take_each(const F& f) {
    for (size_t w = 0; w < words_.size(); ++w)
      for (; words_[w] != 0; words_[w] &= words_[w] - 1)
        f(static_cast<uint32_t>(64 * w + static_cast<size_t>(std::countr_zero(words_[w]))));
  }

 private:
  std::vector<uint64_t> words_;
};

/// Calls body(first, last) for consecutive parts of [0, n), in parallel.
template <typename Body>
void parallel_parts(uint32_t n, const Body& body) {
  parallel_for((n + kChunk - 1) / kChunk,
               [&](uint32_t part) { body(part * kChunk, std::min(n, (part + 1) * kChunk)); });
}

Level finest_level(const SystemSums& sums, size_t n_lights) {
  Level level{sums.layout()};
  const uint32_t n = sums.n_cells();
  level.resize_cells(n);
  std::vector<std::pair<uint64_t, uint32_t>> order(n);
  for (uint32_t i = 0; i < n; ++i) order[i] = {curve_position(sums.key(i)), i};
  std::sort(order.begin(), order.end());
  std::vector<uint32_t> place(n);
  for (uint32_t i = 0; i < n; ++i) place[order[i].second] = i;

  // Group rows by cell, in any order; then sort them by light.
  for (size_t i = 0; i < sums.n_rows(); ++i) ++level.first[place[sums.row_cell(i)] + 1];
  level.resize_lights();
  std::vector<uint32_t> rows(sums.n_rows());
  std::vector<size_t> next(level.first.begin(), level.first.end() - 1);
  for (size_t i = 0; i < sums.n_rows(); ++i) rows[next[place[sums.row_cell(i)]]++] = static_cast<uint32_t>(i);
  parallel_parts(n, [&](uint32_t begin, uint32_t end) {
    LightSetBits seen(n_lights);
    std::vector<uint32_t> row_of(n_lights);
    for (uint32_t i = begin; i < end; ++i) {
      level.keys[i] = sums.key(order[i].second);
      std::ranges::copy(sums.head(order[i].second), level.heads.data() + size_t{i} * level.layout.head_size());
      for (size_t r = level.first[i]; r < level.first[i + 1]; ++r)
        seen.insert(sums.row_light(rows[r])), row_of[sums.row_light(rows[r])] = rows[r];
      size_t r = level.first[i];
      seen.take_each([&](uint32_t light) {
        level.lights[r] = light;
        std::ranges::copy(sums.row(row_of[light]), level.rows.data() + r++ * level.layout.row_size());
      });
    }
  });
  return level;
}

/// The level above: cells twice as wide, or the root, a single cell that does not distinguish normals.
Level coarser_level(Level& finer, size_t n_lights, bool root) {
  const auto parent_key = [&](uint32_t i) { return root ? CoefficientTable::root_key() : finer.keys[i].coarser(1); };
  std::vector<uint32_t> child;  // the first of each parent
  finer.parents.resize(finer.n_cells());
  for (uint32_t i = 0; i < finer.n_cells(); ++i) {
    if (i == 0 || !(parent_key(i) == parent_key(i - 1))) child.push_back(i);
    finer.parents[i] = static_cast<uint32_t>(child.size() - 1);
  }
  const auto n = static_cast<uint32_t>(child.size());
  child.push_back(finer.n_cells());
  Level level{finer.layout};
  level.resize_cells(n);
  const size_t head_size = level.layout.head_size(), row_size = level.layout.row_size();
  const auto insert_lights = [&](uint32_t i, LightSetBits& seen) {
    for (size_t r = finer.first[child[i]]; r < finer.first[child[i + 1]]; ++r) seen.insert(finer.lights[r]);
  };
  parallel_parts(n, [&](uint32_t begin, uint32_t end) {
    LightSetBits seen(n_lights);
    for (uint32_t i = begin; i < end; ++i) {
      insert_lights(i, seen);
      seen.take_each([&](uint32_t) { ++level.first[i + 1]; });
    }
  });
  level.resize_lights();
  parallel_parts(n, [&](uint32_t begin, uint32_t end) {
    LightSetBits seen(n_lights);
    std::vector<size_t> row_of(n_lights);
    for (uint32_t i = begin; i < end; ++i) {
      level.keys[i] = parent_key(child[i]);
      double* head = level.heads.data() + i * head_size;
      for (size_t h = child[i] * head_size; h < child[i + 1] * head_size; ++h) head[h % head_size] += finer.heads[h];
      insert_lights(i, seen);
      size_t next = level.first[i];
      seen.take_each([&](uint32_t light) { level.lights[next] = light, row_of[light] = next++; });
      for (size_t r = finer.first[child[i]]; r < finer.first[child[i + 1]]; ++r) {
        float* row = level.rows.data() + row_of[finer.lights[r]] * row_size;
        for (size_t j = 0; j < row_size; ++j) row[j] += finer.rows[r * row_size + j];
      }
    }
  });
  return level;
}

void solve_cell(Level& level, uint32_t i, const Level* above, const std::vector<float>& light_counts,
                const CacheSettings& settings) {
  const CoefficientsView own = level.coefficients(i);
  const std::span<const uint32_t> lights = level.lights_of(i);
  double sum[3] = {};
  const auto add_to_sum = [&](const Spectrum& value, double count) {
    for (int c = 0; c < 3; ++c) sum[c] += count * value[c];
  };
  if (above) {
    // The prior: the parent's coefficients for the lights of the cell, all of which it has seen.
    const uint32_t parent = level.parents[i];
    const size_t m = level.layout.n_dense;
    std::copy_n(above->dense_values.data() + parent * m, m, own.dense.begin());
    size_t p = above->first[parent];
    add_to_sum(above->light_sums[parent], 1);
    level.scales[i] = above->scales[parent];
    for (size_t k = 0; k < lights.size(); ++k) {
      while (above->lights[p] != lights[k]) ++p;
      own.lights[k] = above->light_values[p];
      add_to_sum(own.lights[k], -light_counts[lights[k]]);  // lights not seen keep their part of the sum
    }
  }
  solve_block_arrow(level.system(i), {settings.prior_samples, settings.monochrome}, own);
  for (size_t k = 0; k < lights.size(); ++k) add_to_sum(own.lights[k], light_counts[lights[k]]);
  for (int c = 0; c < 3; ++c) level.light_sums[i][c] = static_cast<float>(sum[c]);
  if (settings.held_out)
    level.scales[i] = best_fraction(level.system(i), level.scales[i], settings.prior_vertices, settings.monochrome);
}

/// Finest first; `resolution`: that of the finest, or 0 for no coarser levels.
std::vector<Level> levels_of(const SystemSums& sums, uint32_t resolution, size_t n_lights) {
  std::vector<Level> levels;
  levels.push_back(finest_level(sums, n_lights));
  if (resolution == 0) return levels;
  for (; resolution > kCoarsest; resolution = (resolution + 1) / 2)
    levels.push_back(coarser_level(levels.back(), n_lights, false));
  levels.push_back(coarser_level(levels.back(), n_lights, true));
  return levels;
}

std::vector<size_t> lights_per_cell(const std::vector<Level>& levels) {
  std::vector<size_t> lights;
  for (const Level& level : levels)
    for (uint32_t i = 0; i < level.n_cells(); ++i) lights.push_back(level.n_lights(i));
  return lights;
}

/// Adds the cells of a level to a table; `first_above`: index there of the first cell of the level above.
void add_to_table(Level& level, uint32_t first_above, CoefficientTable& table) {
  std::vector<CoefficientTable::NewCell> cells(level.n_cells());
  for (uint32_t i = 0; i < level.n_cells(); ++i) {
    const CoefficientsView values = level.coefficients(i);
    const uint32_t parent = level.parents.empty() ? CoefficientTable::kNone : first_above + level.parents[i];
    cells[i] = {level.keys[i],      parent,        level.scales[i], level.light_sums[i],
                level.lights_of(i), values.lights, values.dense};
  }
  table.add_cells(cells);
}

}  // namespace

CacheSettings CacheSettings::published(uint32_t resolution) {
  CacheSettings settings;
  settings.resolution = resolution;
  settings.by_normal = settings.pyramid = settings.held_out = false;
  settings.prior_samples = 0.1;
  return settings;
}

CoefficientCache::CoefficientCache(const Bounds3& bounds, std::vector<float> light_counts, uint32_t n_dense,
                                   const CacheSettings& settings)
    : settings_(settings),
      finest_(bounds, settings.resolution, settings.by_normal),
      light_counts_(std::move(light_counts)),
      layout_{n_dense, settings.by_channel && !settings.monochrome} {
  COVARY_CHECK(n_dense <= SystemLayout::kMaxDense, "too many techniques");
  restart();
}

void CoefficientCache::restart() {
  level_ = 0, n_rejected_ = 0;
  sums_ = SystemSums(layout_);
  table_ = CoefficientTable(finest_, static_cast<uint32_t>(light_counts_.size()), layout_.n_dense);
}

void CoefficientCache::absorb(const SystemSums& sums) {
  sums_.merge(sums);
  const auto needed = [&] {
    return sums_.bytes() + std::max(table_.bytes(), CoefficientTable::expected_bytes(sums_.n_cells(), sums_.n_rows()));
  };
  while (needed() > settings_.memory_limit && can_coarsen()) coarsen();
}

void CoefficientCache::coarsen() {
  SystemSums coarser(layout_, sums_.level() + 1);
  coarser.merge(sums_);
  sums_ = std::move(coarser);
}

void CoefficientCache::update() {
  std::vector<Level> levels;
  for (;;) {
    CellGrid grid = finest_;
    for (level_ = 0; level_ < sums_.level(); ++level_) grid = grid.coarser();
    table_ = CoefficientTable(grid, static_cast<uint32_t>(light_counts_.size()), layout_.n_dense);
    if (sums_.n_cells() == 0) return;
    levels = levels_of(sums_, settings_.pyramid ? grid.resolution() : 0, light_counts_.size());
    table_.reserve(lights_per_cell(levels));
    if (sums_.bytes() + table_.bytes() <= settings_.memory_limit || !can_coarsen()) break;
    coarsen();
  }
  uint32_t first_above = 0, first = 0;
  for (size_t l = levels.size(); l-- > 0; first_above = first, first = table_.n_cells()) {
    const Level* above = l + 1 < levels.size() ? &levels[l + 1] : nullptr;
    parallel_for(levels[l].n_cells(), kChunk,
                 [&](uint32_t i) { solve_cell(levels[l], i, above, light_counts_, settings_); });
    add_to_table(levels[l], first_above, table_);
  }
  sums_.scale_held_out(0);
}

std::vector<float> CoefficientCache::best_selection() const {
  constexpr double kKept = 0.2;  // fraction of the former probabilities: lights may matter where no sample has been yet
  const std::span<const double> residuals = sums_.light_residuals();
  std::vector<double> roots(light_counts_.size());
  double count = 0, sum = 0;
  for (size_t k = 0; k < roots.size(); ++k) {
    if (k < residuals.size()) roots[k] = std::sqrt(light_counts_[k] * residuals[k]);
    count += light_counts_[k], sum += roots[k];
  }
  if (!(sum > 0)) return {};
  std::vector<float> selection;
  for (size_t k = 0; k < roots.size(); ++k)
    selection.push_back(static_cast<float>(kKept * light_counts_[k] / count + (1 - kKept) * roots[k] / sum));
  return selection;
}

void CoefficientCache::select(std::vector<float> light_counts) {
  COVARY_CHECK(light_counts.size() == light_counts_.size(), "an expected number of samples for each light");
  std::vector<float> factors;
  for (size_t k = 0; k < light_counts.size(); ++k)
    factors.push_back(light_counts[k] > 0 ? light_counts_[k] / light_counts[k] : 0);
  if (table_.n_cells() > 0) table_.scale_lights(factors);
  light_counts_ = std::move(light_counts);
  n_rejected_ = n_rejected();
  sums_ = SystemSums(layout_, sums_.level());
}

void CoefficientCache::freeze() {
  n_rejected_ = n_rejected();
  sums_ = SystemSums(layout_, sums_.level());
}

}  // namespace covary
