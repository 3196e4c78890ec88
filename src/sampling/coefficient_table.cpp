// SPDX-License-Identifier: Apache-2.0
#include "sampling/coefficient_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/parallel.h"
#include "sampling/training_bytes.h"

namespace covary {
namespace {

uint32_t nearest_axis(const Vec3& n) {
  const Vec3 a = abs(n);
  const int axis = a.x >= a.y ? (a.x >= a.z ? 0 : 2) : (a.y >= a.z ? 1 : 2);
  return static_cast<uint32_t>(2 * axis + (n[axis] < 0 ? 1 : 0));
}

constexpr size_t kChunk = 64;  // cells per task

}  // namespace

CellGrid::CellGrid(const Bounds3& bounds, uint32_t resolution, bool by_normal)
    : resolution_(resolution), by_normal_(by_normal) {
  if (resolution < 1 || resolution > kMaxResolution)
    throw Error(ErrorCode::kUsage,
                fmt::format("a grid of {} cells; between 1 and {} along the longest side of the scene are possible",
                            resolution, kMaxResolution));
  if (bounds.empty()) return;
  origin_ = bounds.lower;
  const float longest = max_component(bounds.upper - bounds.lower);
  if (longest > 0 && std::isfinite(longest)) cell_width_ = longest / static_cast<float>(resolution);
}

CellKey CellGrid::key(const Vec3& position, const Vec3& normal) const {
  const Vec3 cell = (position - origin_) / cell_width_;
  const auto last = static_cast<float>(resolution_ - 1);
  const auto coordinate = [&](float x) { return x > 0 ? static_cast<uint32_t>(std::min(x, last)) : 0; };
  return {coordinate(cell.x), coordinate(cell.y), coordinate(cell.z), by_normal_ ? nearest_axis(normal) : kEveryNormal,
          level_};
}

CellGrid CellGrid::coarser() const {
  CellGrid grid = *this;
  grid.cell_width_ *= 2;
  grid.resolution_ = (resolution_ + 1) / 2;
  ++grid.level_;
  return grid;
}

uint32_t CoefficientTable::find(CellKey key) const {
  for (uint32_t level = key.level(); level <= last_level_; ++level, key = key.coarser(1)) {
    const uint32_t cell = index_.find(key.bits);
    if (cell != KeyIndex::kNone) return cell;
  }
  return root_;
}

Spectrum CoefficientTable::light_of(uint32_t cell, uint32_t light) const {
  for (; cell != kNone; cell = cells_[cell].parent) {
    const Cell& own = cells_[cell];
    if (own.n_slots == kEveryLight) return slots_[own.first + light].value;
    if (!own.may_hold(light)) continue;
    const Slot* slots = &slots_[own.first];
    for (uint32_t i = light & (own.n_slots - 1); slots[i].light != kNone; i = (i + 1) & (own.n_slots - 1))
      if (slots[i].light == light) return slots[i].value;
  }
  return Spectrum(0);
}

void CoefficientTable::prefetch_light(uint32_t cell, uint32_t light) const {
  for (; cell != kNone; cell = cells_[cell].parent) {
    const Cell& own = cells_[cell];
    if (own.n_slots != kEveryLight && !own.may_hold(light)) continue;
    __builtin_prefetch(&slots_[own.first + (own.n_slots == kEveryLight ? light : light & (own.n_slots - 1))]);
    return;
  }
}

uint32_t CoefficientTable::n_switched_off() const {
  uint32_t n = 0;
  for (const Cell& cell : cells_) n += is_black(cell.scale);
  return n;
}

size_t CoefficientTable::bytes() const {
  return index_.bytes() + cells_.capacity() * sizeof(Cell) + dense_.capacity() * sizeof(Spectrum) +
         slots_.capacity() * sizeof(Slot);
}

uint64_t CoefficientTable::hash() const {
  std::string parts;
  const auto append = [&](const auto& array) { append_bytes(parts, hash_bytes(std::as_bytes(std::span(array)))); };
  append_bytes(parts, grid_.origin_), append_bytes(parts, grid_.cell_width_), append_bytes(parts, grid_.level_);
  append(index_.keys()), append(cells_), append(dense_), append(slots_), append(selection_);
  return hash_bytes(parts);
}

void CoefficientTable::reserve(std::span<const size_t> lights_per_cell) {
  size_t n_slots = slots_.size();
  for (const size_t n : lights_per_cell) n_slots += n_slots_of(slots_for(n));
  const size_t n_cells = cells_.size() + lights_per_cell.size();
  index_.reserve(n_cells), cells_.reserve(n_cells), dense_.reserve(n_cells * n_dense_), slots_.reserve(n_slots);
}

uint32_t CoefficientTable::slots_for(size_t n_lights) const {
  if (n_lights == 0) return 0;
  // At least one slot stays empty, so that searches terminate.
  const uint32_t slots = std::bit_ceil(static_cast<uint32_t>(n_lights + n_lights / 2 + 1));
  return slots < n_lights_ ? slots : kEveryLight;
}

void CoefficientTable::add_cells(std::span<const NewCell> cells) {
  const size_t first = cells_.size();
  size_t n_slots = slots_.size();
  for (const NewCell& cell : cells) {
    const uint32_t number = index_.insert(cell.key.bits);
    COVARY_CHECK(number == cells_.size() && (cell.parent == kNone || cell.parent < first), "a cell before its parent");
    COVARY_CHECK(cell.lights.size() == cell.light_values.size() && cell.dense_values.size() == n_dense_,
                 "coefficients of another system");
    if (cell.key == root_key())
      root_ = number;
    else
      last_level_ = std::max(last_level_, cell.key.level());
    const uint32_t slots = slots_for(cell.lights.size());
    cells_.push_back({cell.scale, cell.light_sum, cell.parent, slots, n_slots});
    n_slots += n_slots_of(slots);
    dense_.insert(dense_.end(), cell.dense_values.begin(), cell.dense_values.end());
  }
  slots_.resize(n_slots);
  parallel_for(cells.size(), kChunk, [&](size_t i) { fill(cells_[first + i], cells[i]); });
}

void CoefficientTable::fill(Cell& cell, const NewCell& from) {
  Slot* slots = slots_.data() + cell.first;
  if (cell.n_slots == kEveryLight) {
    for (uint32_t light = 0, k = 0; light < n_lights_; ++light)
      slots[light] = {light, k < from.lights.size() && from.lights[k] == light ? from.light_values[k++]
                             : from.parent != kNone                            ? this->light(from.parent, light)
                                                                               : Spectrum(0)};
    return;
  }
  for (size_t k = 0; k < from.lights.size(); ++k) {
    uint32_t i = from.lights[k] & (cell.n_slots - 1);
    while (slots[i].light != kNone) i = (i + 1) & (cell.n_slots - 1);
    slots[i] = {from.lights[k], from.light_values[k]};
    cell.note(from.lights[k]);
  }
}

void CoefficientTable::scale_lights(std::span<const float> factors) {
  COVARY_CHECK(factors.size() == n_lights_, "a factor for each light");
  for (Slot& slot : slots_)
    if (slot.light != kNone) slot.value *= factors[slot.light];
}

std::vector<uint32_t> CoefficientTable::lights_of(const Cell& cell) const {
  std::vector<uint32_t> lights;
  for (uint32_t i = 0; i < n_slots_of(cell.n_slots); ++i)
    if (const uint32_t light = slots_[cell.first + i].light; light != kNone) lights.push_back(light);
  std::sort(lights.begin(), lights.end());
  return lights;
}

std::string CoefficientTable::body() const {
  std::string body;
  append_bytes(body, grid_.origin_), append_bytes(body, grid_.cell_width_), append_bytes(body, grid_.resolution_);
  append_bytes(body, grid_.level_), append_bytes(body, uint32_t{grid_.by_normal_});
  append_bytes(body, static_cast<uint32_t>(selection_.size()));
  for (const float probability : selection_) append_bytes(body, probability);
  append_bytes(body, n_lights_), append_bytes(body, n_dense_), append_bytes(body, n_cells());
  for (uint32_t i = 0; i < n_cells(); ++i) {
    const Cell& cell = cells_[i];
    append_bytes(body, index_.keys()[i]), append_bytes(body, cell.parent), append_bytes(body, cell.scale),
        append_bytes(body, cell.light_sum);
    for (uint32_t j = 0; j < n_dense_; ++j) append_bytes(body, dense(i, j));
    const std::vector<uint32_t> lights = lights_of(cell);
    append_bytes(body, static_cast<uint32_t>(lights.size()));
    for (uint32_t own : lights) append_bytes(body, own), append_bytes(body, light(i, own));
  }
  return body;
}

std::string CoefficientTable::to_bytes(const std::string& key) const { return training_file_bytes(key, body()); }

CoefficientTable CoefficientTable::from_bytes(std::string_view bytes, const std::string& key,
                                              const std::string& where) {
  return from_body(training_file_body(bytes, key, where), where);
}

CoefficientTable CoefficientTable::from_body(std::string_view bytes, const std::string& where) {
  ByteReader reader(bytes, where);
  const auto check = [&](bool possible) { reader.check(possible); };
  CellGrid grid;
  grid.origin_ = reader.read<Vec3>(), grid.cell_width_ = reader.read<float>();
  grid.resolution_ = reader.read<uint32_t>(), grid.level_ = reader.read<uint32_t>();
  grid.by_normal_ = reader.read<uint32_t>() != 0;
  std::vector<float> selection;
  double total = 0;
  for (auto n = reader.read<uint32_t>(); n > 0; --n) {
    selection.push_back(reader.read<float>());
    check(selection.back() >= 0 && std::isfinite(selection.back()));
    total += selection.back();
  }
  const auto n_lights = reader.read<uint32_t>(), n_dense = reader.read<uint32_t>();
  check(selection.empty() || (selection.size() == n_lights && total > 0));
  check(grid.resolution_ >= 1 && n_dense <= SystemLayout::kMaxDense);
  CoefficientTable table(grid, n_lights, n_dense);
  table.set_selection(std::move(selection));
  std::vector<Spectrum> dense(n_dense), values;
  std::vector<uint32_t> lights;
  for (auto n_cells = reader.read<uint32_t>(); n_cells > 0; --n_cells) {
    NewCell cell;
    cell.key.bits = reader.read<uint64_t>();
    cell.parent = reader.read<uint32_t>();
    check(table.index_.find(cell.key.bits) == KeyIndex::kNone);
    check(cell.parent == kNone || cell.parent < table.n_cells());
    cell.scale = reader.read<Spectrum>(), cell.light_sum = reader.read<Spectrum>();
    for (Spectrum& value : dense) value = reader.read<Spectrum>();
    lights.clear(), values.clear();
    for (auto n = reader.read<uint32_t>(); n > 0; --n) {
      lights.push_back(reader.read<uint32_t>());
      values.push_back(reader.read<Spectrum>());
      check(lights.back() < n_lights && (lights.size() < 2 || lights[lights.size() - 2] < lights.back()));
    }
    cell.lights = lights, cell.light_values = values, cell.dense_values = dense;
    table.add_cells({&cell, 1});
  }
  check(reader.rest().empty());
  return table;
}

}  // namespace covary
