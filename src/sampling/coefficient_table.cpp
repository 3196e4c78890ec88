// SPDX-License-Identifier: Apache-2.0
#include "sampling/coefficient_table.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "core/content_hash.h"
#include "core/error.h"

namespace covary {
namespace {

uint32_t nearest_axis(const Vec3& n) {
  const Vec3 a = abs(n);
  const int axis = a.x >= a.y ? (a.x >= a.z ? 0 : 2) : (a.y >= a.z ? 1 : 2);
  return static_cast<uint32_t>(2 * axis + (n[axis] < 0 ? 1 : 0));
}

/// Bytes of a table, written one value after the other. All machines that run this are little-endian.
static_assert(std::endian::native == std::endian::little);
template <typename T>
void append(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

constexpr std::string_view kMagic = "covary coefficients\n";
constexpr uint32_t kVersion = 1;

class Reader {
 public:
  Reader(std::string_view bytes, const std::string& where) : bytes_(bytes), where_(where) {}
  template <typename T>
  T read() {
    T value;
    std::memcpy(static_cast<void*>(&value), take(sizeof(T)).data(), sizeof(T));
    return value;
  }
  std::string_view take(size_t size) {
    if (bytes_.size() < size) fail("is truncated: a training file was expected to go on");
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }
  std::string_view rest() const { return bytes_; }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::kInput, fmt::format("{}: {}", where_, what));
  }

 private:
  std::string_view bytes_;
  const std::string& where_;
};

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

void CoefficientTable::prefetch(CellKey key) const { index_.prefetch(key.bits); }

const CoefficientTable::Entry* CoefficientTable::entry(const Cell& cell, uint32_t light) const {
  if (cell.n_entries == 0) return nullptr;
  const Entry* entries = &entries_[cell.first_entry];
  const uint32_t mask = cell.n_entries - 1;
  for (uint32_t i = light & mask;; i = (i + 1) & mask) {
    if (entries[i].light == light) return &entries[i];
    if (entries[i].light == kNone) return nullptr;
  }
}

Spectrum CoefficientTable::light(uint32_t cell, uint32_t light) const {
  for (; cell != kNone; cell = cells_[cell].parent)
    if (const Entry* found = entry(cells_[cell], light)) return found->value;
  return Spectrum(0);
}

uint32_t CoefficientTable::n_switched_off() const {
  uint32_t n = 0;
  for (const Cell& cell : cells_) n += is_black(cell.scale);
  return n;
}

size_t CoefficientTable::bytes() const {
  return index_.bytes() + cells_.capacity() * sizeof(Cell) + dense_.capacity() * sizeof(Spectrum) +
         entries_.capacity() * sizeof(Entry);
}

uint64_t CoefficientTable::hash() const { return hash_bytes(to_bytes("")); }

uint32_t CoefficientTable::add_cell(CellKey key, uint32_t parent, const Spectrum& scale, const Spectrum& light_sum,
                                    std::span<const uint32_t> lights, const Coefficients& coefficients) {
  const uint32_t number = index_.insert(key.bits);
  COVARY_CHECK(number == cells_.size() && (parent == kNone || parent < number), "a cell twice or before its parent");
  if (key == root_key())
    root_ = number;
  else
    last_level_ = std::max(last_level_, key.level());
  Cell& cell = cells_.emplace_back(Cell{scale, light_sum, parent, static_cast<uint32_t>(entries_.size()), 0});
  dense_.insert(dense_.end(), coefficients.dense.begin(), coefficients.dense.end());
  if (lights.empty()) return number;
  // At least one entry stays empty, so that a search ends.
  cell.n_entries = std::bit_ceil(static_cast<uint32_t>(lights.size() + lights.size() / 2 + 1));
  entries_.resize(entries_.size() + cell.n_entries);
  Entry* entries = &entries_[cell.first_entry];
  for (size_t k = 0; k < lights.size(); ++k) {
    uint32_t i = lights[k] & (cell.n_entries - 1);
    while (entries[i].light != kNone) i = (i + 1) & (cell.n_entries - 1);
    entries[i] = {lights[k], coefficients.lights[k]};
  }
  return number;
}

std::string CoefficientTable::to_bytes(const std::string& key) const {
  std::string body;
  append(body, grid_.origin_), append(body, grid_.cell_width_), append(body, grid_.resolution_);
  append(body, grid_.level_), append(body, uint32_t{grid_.by_normal_});
  append(body, layout_.n_dense), append(body, n_cells());
  for (uint32_t i = 0; i < n_cells(); ++i) {
    const Cell& cell = cells_[i];
    append(body, index_.keys()[i]), append(body, cell.parent), append(body, cell.scale), append(body, cell.light_sum);
    for (uint32_t j = 0; j < layout_.n_dense; ++j) append(body, dense(i, j));
    std::vector<Entry> lights;
    for (uint32_t e = 0; e < cell.n_entries; ++e)
      if (const Entry& own = entries_[cell.first_entry + e]; own.light != kNone) lights.push_back(own);
    std::sort(lights.begin(), lights.end(), [](const Entry& a, const Entry& b) { return a.light < b.light; });
    append(body, static_cast<uint32_t>(lights.size()));
    for (const Entry& own : lights) append(body, own.light), append(body, own.value);
  }
  std::string bytes(kMagic);
  append(bytes, kVersion), append(bytes, uint64_t{key.size()}), bytes += key;
  append(bytes, uint64_t{body.size()}), append(bytes, hash_bytes(body)), bytes += body;
  return bytes;
}

CoefficientTable CoefficientTable::from_bytes(std::string_view bytes, const std::string& key,
                                              const std::string& where) {
  Reader reader(bytes, where);
  if (!bytes.starts_with(kMagic.substr(0, bytes.size())))
    reader.fail("is no training file; --save-training writes them");
  reader.take(kMagic.size());
  const auto version = reader.read<uint32_t>();
  if (version != kVersion)
    reader.fail(fmt::format("is a training file of version {}; this program reads version {}", version, kVersion));
  const std::string_view found = reader.take(reader.read<uint64_t>());
  const auto size = reader.read<uint64_t>(), hash = reader.read<uint64_t>();
  if (reader.rest().size() < size)
    reader.fail(fmt::format("is truncated: {} bytes of {} are there", reader.rest().size(), size));
  if (reader.rest().size() > size || hash_bytes(reader.rest()) != hash)
    reader.fail("is damaged: its content does not match its checksum");
  if (found != key)
    reader.fail(fmt::format("was trained for another scene or with other settings: '{}'; '{}' is needed", found, key));

  CellGrid grid;
  grid.origin_ = reader.read<Vec3>(), grid.cell_width_ = reader.read<float>();
  grid.resolution_ = reader.read<uint32_t>(), grid.level_ = reader.read<uint32_t>();
  grid.by_normal_ = reader.read<uint32_t>() != 0;
  CoefficientTable table(grid, SystemLayout{reader.read<uint32_t>()});
  if (grid.resolution_ < 1 || table.layout_.n_dense > SystemLayout::kMaxDense)
    reader.fail("is damaged: impossible numbers");
  const auto n_cells = reader.read<uint32_t>();
  Coefficients coefficients;
  coefficients.dense.resize(table.layout_.n_dense);
  std::vector<uint32_t> lights;
  for (uint32_t i = 0; i < n_cells; ++i) {
    CellKey cell;
    cell.bits = reader.read<uint64_t>();
    const auto parent = reader.read<uint32_t>();
    const auto scale = reader.read<Spectrum>(), light_sum = reader.read<Spectrum>();
    for (Spectrum& value : coefficients.dense) value = reader.read<Spectrum>();
    lights.clear(), coefficients.lights.clear();
    for (auto n = reader.read<uint32_t>(); n > 0; --n) {
      lights.push_back(reader.read<uint32_t>());
      coefficients.lights.push_back(reader.read<Spectrum>());
    }
    table.add_cell(cell, parent, scale, light_sum, lights, coefficients);
  }
  return table;
}

}  // namespace covary
