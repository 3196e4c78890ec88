// SPDX-License-Identifier: Apache-2.0
#include "sampling/coefficient_cache.h"

#include <algorithm>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {
namespace {

constexpr uint32_t kCoarsest = 4;  // cells along the longest side of the pyramid's last grid, below its root
constexpr uint32_t kChunk = 32;    // cells that a thread takes at a time

/// One cell while it is solved.
struct CellSystem {
  CellKey key;
  SystemLayout layout;
  std::vector<double> head, rows;
  std::vector<uint32_t> lights;
  uint32_t parent = CoefficientTable::kNone;  // in the level above
  Coefficients solution;
  Spectrum scale{1}, light_sum{0};
  SystemView view() const { return {layout, head, lights, rows}; }
};
using Level = std::vector<CellSystem>;

/// Order in which the children of each cell of every coarser grid are neighbours: the bits of x, y, z interleaved.
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

/// Rows of `cells`, sorted by light, those of one light added up in the order of the cells.
void gather_rows(std::span<const CellSystem> cells, CellSystem& sum) {
  std::vector<std::pair<uint32_t, const double*>> rows;
  const size_t size = sum.layout.row_size();
  for (const CellSystem& cell : cells)
    for (size_t i = 0; i < cell.lights.size(); ++i) rows.emplace_back(cell.lights[i], &cell.rows[i * size]);
  std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [light, row] : rows) {
    if (sum.lights.empty() || sum.lights.back() != light) {
      sum.lights.push_back(light);
      sum.rows.resize(sum.rows.size() + size);
    }
    double* own = &sum.rows[sum.rows.size() - size];
    for (size_t i = 0; i < size; ++i) own[i] += row[i];
  }
}

Level finest_level(const SystemSums& sums) {
  const uint32_t n = sums.n_cells();
  std::vector<uint32_t> order(n), place(n);
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return curve_position(sums.key(a)) < curve_position(sums.key(b)); });
  for (uint32_t i = 0; i < n; ++i) place[order[i]] = i;
  std::vector<std::vector<uint32_t>> rows(n);
  for (size_t i = 0; i < sums.n_rows(); ++i) rows[place[sums.row_cell(i)]].push_back(static_cast<uint32_t>(i));
  Level level(n);
  parallel_for(n, kChunk, [&](uint32_t i) {
    CellSystem& cell = level[i];
    cell.key = sums.key(order[i]), cell.layout = sums.layout();
    const auto head = sums.head(order[i]);
    cell.head.assign(head.begin(), head.end());
    std::sort(rows[i].begin(), rows[i].end(),
              [&](uint32_t a, uint32_t b) { return sums.row_light(a) < sums.row_light(b); });
    for (uint32_t row : rows[i]) {
      cell.lights.push_back(sums.row_light(row));
      cell.rows.insert(cell.rows.end(), sums.row(row).begin(), sums.row(row).end());
    }
  });
  return level;
}

/// The level above: cells twice as wide, or a single one, the root, that knows no normals.
Level coarser_level(Level& finer, bool root) {
  const auto parent_key = [&](const CellSystem& cell) {
    return root ? CoefficientTable::root_key() : cell.key.coarser(1);
  };
  std::vector<uint32_t> first;
  for (uint32_t i = 0; i < finer.size(); ++i) {
    if (i == 0 || !(parent_key(finer[i]) == parent_key(finer[i - 1]))) first.push_back(i);
    finer[i].parent = static_cast<uint32_t>(first.size() - 1);
  }
  first.push_back(static_cast<uint32_t>(finer.size()));
  Level level(first.size() - 1);
  parallel_for(static_cast<uint32_t>(level.size()), kChunk, [&](uint32_t i) {
    const std::span<const CellSystem> children(&finer[first[i]], &finer[0] + first[i + 1]);
    CellSystem& cell = level[i];
    cell.key = parent_key(children[0]), cell.layout = children[0].layout;
    cell.head.resize(cell.layout.head_size());
    for (const CellSystem& child : children)
      for (size_t j = 0; j < cell.head.size(); ++j) cell.head[j] += child.head[j];
    gather_rows(children, cell);
  });
  return level;
}

/// The parent's coefficients for the lights of a cell, all of which the parent has seen.
Coefficients prior_of(const CellSystem& cell, const CellSystem* parent) {
  Coefficients prior;
  prior.lights.resize(cell.lights.size());
  prior.dense.resize(cell.layout.n_dense);
  if (!parent) return prior;
  prior.dense = parent->solution.dense;
  for (size_t k = 0, p = 0; k < cell.lights.size(); ++k) {
    while (parent->lights[p] != cell.lights[k]) ++p;
    prior.lights[k] = parent->solution.lights[p];
  }
  return prior;
}

void solve_cell(CellSystem& cell, const CellSystem* parent, const std::vector<float>& light_counts,
                const CacheSettings& settings) {
  const Coefficients prior = prior_of(cell, parent);
  cell.solution = solve_block_arrow(cell.view(), prior, {settings.prior_samples, settings.monochrome});
  // Lights that the cell has not seen count with what they have in the parent's sum.
  if (parent) cell.light_sum = parent->light_sum, cell.scale = parent->scale;
  for (size_t k = 0; k < cell.lights.size(); ++k)
    cell.light_sum += (cell.solution.lights[k] - prior.lights[k]) * light_counts[cell.lights[k]];
  if (settings.held_out) cell.scale = best_share(cell.view(), cell.scale, settings.prior_vertices, settings.monochrome);
}

}  // namespace

CacheSettings CacheSettings::published(uint32_t resolution) {
  CacheSettings settings;
  settings.resolution = resolution;
  settings.by_normal = settings.pyramid = settings.held_out = false;
  settings.prior_samples = 0;
  return settings;
}

CoefficientCache::CoefficientCache(const Bounds3& bounds, std::vector<float> light_counts, uint32_t n_dense,
                                   const CacheSettings& settings)
    : settings_(settings),
      finest_(bounds, settings.resolution, settings.by_normal),
      light_counts_(std::move(light_counts)),
      layout_{n_dense} {
  COVARY_CHECK(n_dense <= SystemLayout::kMaxDense, "too many techniques");
  restart();
}

void CoefficientCache::restart() {
  level_ = 0, n_rejected_ = 0;
  sums_ = SystemSums(layout_);
  table_ = CoefficientTable(finest_, layout_);
}

void CoefficientCache::absorb(const SystemSums& sums) {
  sums_.merge(sums);
  const uint32_t last = CellKey::kMaxCoordinate;
  while (sums_.bytes() > settings_.memory_limit && (settings_.resolution & last) >> sums_.level() > 0) {
    SystemSums coarser(layout_, sums_.level() + 1);
    coarser.merge(sums_);
    sums_ = std::move(coarser);
  }
}

void CoefficientCache::update() {
  CellGrid grid = finest_;
  for (level_ = 0; level_ < sums_.level(); ++level_) grid = grid.coarser();
  table_ = CoefficientTable(grid, layout_);
  if (sums_.n_cells() == 0) return;

  std::vector<Level> levels;  // finest first
  levels.push_back(finest_level(sums_));
  if (settings_.pyramid) {
    for (uint32_t resolution = grid.resolution(); resolution > kCoarsest; resolution = (resolution + 1) / 2)
      levels.push_back(coarser_level(levels.back(), false));
    levels.push_back(coarser_level(levels.back(), true));
  }
  std::vector<uint32_t> numbers, parent_numbers;  // in the table
  for (size_t l = levels.size(); l-- > 0;) {
    Level& level = levels[l];
    const Level* above = l + 1 < levels.size() ? &levels[l + 1] : nullptr;
    const auto n = static_cast<uint32_t>(level.size());
    parallel_for(n, kChunk, [&](uint32_t i) {
      solve_cell(level[i], above ? &(*above)[level[i].parent] : nullptr, light_counts_, settings_);
    });
    std::swap(numbers, parent_numbers);
    numbers.clear();
    for (const CellSystem& cell : level)
      numbers.push_back(table_.add_cell(cell.key, above ? parent_numbers[cell.parent] : CoefficientTable::kNone,
                                        cell.scale, cell.light_sum, cell.lights, cell.solution));
  }
  sums_.scale_held_out(0);
}

void CoefficientCache::freeze() {
  n_rejected_ = n_rejected();
  sums_ = SystemSums(layout_, sums_.level());
}

}  // namespace covary
