// SPDX-License-Identifier: Apache-2.0
#include "sampling/system_sums.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/error.h"

namespace covary {
namespace {

template <typename T>
void add_to(T* sums, std::span<const T> numbers) {
  for (size_t i = 0; i < numbers.size(); ++i) sums[i] += numbers[i];
}

}  // namespace

uint32_t KeyIndex::insert(uint64_t key) {
  if (3 * slots_.size() <= 4 * keys_.size()) resize(std::max<size_t>(64, 2 * slots_.size()));
  for (size_t i = slot_of(key);; i = (i + 1) & (slots_.size() - 1)) {
    Slot& slot = slots_[i];
    if (slot.number == kNone) {
      slot = {key, static_cast<uint32_t>(keys_.size())};
      keys_.push_back(key);
      return slot.number;
    }
    if (slot.key == key) return slot.number;
  }
}

uint32_t KeyIndex::find(uint64_t key) const {
  if (slots_.empty()) return kNone;
  for (size_t i = slot_of(key);; i = (i + 1) & (slots_.size() - 1))
    if (slots_[i].number == kNone || slots_[i].key == key) return slots_[i].number;
}

void KeyIndex::reserve(size_t n) {
  keys_.reserve(n);
  if (const size_t needed = std::bit_ceil(4 * n / 3 + 1); needed > slots_.size()) resize(std::max<size_t>(64, needed));
}

void KeyIndex::resize(size_t n_slots) {
  slots_.assign(n_slots, Slot());
  for (size_t number = 0; number < keys_.size(); ++number) {
    size_t i = slot_of(keys_[number]);
    while (slots_[i].number != kNone) i = (i + 1) & (slots_.size() - 1);
    slots_[i] = {keys_[number], static_cast<uint32_t>(number)};
  }
}

void KeyIndex::clear() {
  keys_.clear();
  slots_.assign(slots_.size(), Slot());
}

void SystemSums::reserve(size_t n_cells, size_t n_rows) {
  cells_.reserve(n_cells), rows_index_.reserve(n_rows);
  heads_.reserve(n_cells * layout_.head_size()), rows_.reserve(n_rows * layout_.row_size());
}

uint32_t SystemSums::cell(CellKey key) {
  const uint32_t number = cells_.insert(key.bits);
  heads_.resize(cells_.keys().size() * layout_.head_size());
  return number;
}

// The terms of one sample in A and b of [Hua2023] Eq. (21), in balance weights: r_k = N_k λ_k / p with λ_k of Eq. (18);
// `weight` is that of Eqs. (25) and (29).
void SystemSums::add(uint32_t cell, float weight, const ControlledSample& sample) {
  const Spectrum weighted = sample.value * weight;
  if (!(weight >= 0 && std::isfinite(weight)) || !is_finite(weighted)) {
    ++n_rejected_;
    return;
  }
  double* head = &heads_[size_t{cell} * layout_.head_size()];
  head[SystemLayout::kWeight] += weight;
  head[SystemLayout::kWeightSquared] += static_cast<double>(weight) * weight;
  for (int c = 0; c < 3; ++c) head[SystemLayout::kValue + static_cast<uint32_t>(c)] += weighted[c];
  for (uint32_t j = 0; j < layout_.n_dense; ++j) {
    const double r = sample.r_dense[j];
    if (r == 0) continue;
    double* own = head + layout_.dense(j);
    for (int c = 0; c < 3; ++c) own[c] += r * weighted[c];                                           // b_j, Eq. (21)
    for (uint32_t i = 0; i <= j; ++i) head[layout_.matrix(i, j)] += weight * r * sample.r_dense[i];  // A_ij, Eq. (21)
  }
  if (sample.light == ControlledSample::kNoLight || sample.r_light == 0) return;
  const uint32_t number = rows_index_.insert(uint64_t{cell} << 32 | sample.light);
  rows_.resize(rows_index_.keys().size() * layout_.row_size());
  float* row = &rows_[size_t{number} * layout_.row_size()];
  const float r = sample.r_light;
  row[SystemLayout::kDiagonal] += weight * r * r;  // the light's own row in Eq. (32): A_kk, b_k, A_kj
  for (int c = 0; c < 3; ++c) row[SystemLayout::kRowValue + static_cast<uint32_t>(c)] += r * weighted[c];
  for (uint32_t j = 0; j < layout_.n_dense; ++j) row[SystemLayout::kRowDense + j] += weight * r * sample.r_dense[j];
}

void SystemSums::add_by_channel(uint32_t cell, const Spectrum& weights, ControlledSample sample) {
  const float weight = mean(weights);
  const uint64_t rejected = n_rejected_;
  if (weight > 0) sample.value = sample.value * weights / Spectrum(weight);  // b_c has the weight of its channel
  add(cell, weight, sample);
  if (n_rejected_ != rejected) return;
  const bool of_light = sample.light != ControlledSample::kNoLight && sample.r_light != 0;
  float* row =
      of_light ? &rows_[size_t{rows_index_.find(uint64_t{cell} << 32 | sample.light)} * layout_.row_size()] : nullptr;
  for (uint32_t c = 0; c < 3; ++c) {
    const float w = weights[static_cast<int>(c)];
    double* own = &heads_[size_t{cell} * layout_.head_size() + layout_.channel(c)];
    *own++ += w, *own++ += double{w} * w;
    for (uint32_t j = 0; j < layout_.n_dense; ++j)
      for (uint32_t i = 0; i <= j; ++i) *own++ += double{w} * sample.r_dense[j] * sample.r_dense[i];
    if (!row) continue;
    float* light = row + layout_.channel_row(c);
    *light++ += w * sample.r_light * sample.r_light;
    for (uint32_t j = 0; j < layout_.n_dense; ++j) *light++ += w * sample.r_light * sample.r_dense[j];
  }
}

void SystemSums::add_held_out(uint32_t cell, float weight, const Spectrum& plain, const Spectrum& control) {
  const Spectrum both = plain * control * weight, squared = control * control * weight;
  if (!is_finite(both) || !is_finite(squared) || !is_finite(plain * weight) || !std::isfinite(weight)) return;
  double* head = &heads_[size_t{cell} * layout_.head_size()];
  head[SystemLayout::kHeldOut] += 1;
  head[SystemLayout::kHeldOutWeight] += weight;
  for (int c = 0; c < 3; ++c) {
    head[SystemLayout::kPlain + static_cast<uint32_t>(c)] += static_cast<double>(weight) * plain[c];
    head[SystemLayout::kControl + static_cast<uint32_t>(c)] += static_cast<double>(weight) * control[c];
    head[SystemLayout::kPlainControl + static_cast<uint32_t>(c)] += both[c];
    head[SystemLayout::kControlSquared + static_cast<uint32_t>(c)] += squared[c];
  }
}

void SystemSums::add_residual(uint32_t light, float weight, const Spectrum& residual) {
  const double square = static_cast<double>(weight) * mean(residual * residual);
  if (!std::isfinite(square)) return;
  if (light_residuals_.size() <= light) light_residuals_.resize(light + 1);
  light_residuals_[light] += square;
}

void SystemSums::merge(const SystemSums& other) {
  COVARY_CHECK(other.level_ <= level_ && other.layout_ == layout_, "sums of other cells");
  std::vector<uint32_t> own_cell(other.n_cells());
  for (uint32_t i = 0; i < other.n_cells(); ++i) {
    own_cell[i] = cell(other.key(i).coarser(level_ - other.level_));
    add_to(&heads_[size_t{own_cell[i]} * layout_.head_size()], other.head(i));
  }
  for (size_t i = 0; i < other.n_rows(); ++i) {
    const uint64_t key = uint64_t{own_cell[other.row_cell(i)]} << 32 | other.row_light(i);
    const uint32_t number = rows_index_.insert(key);
    rows_.resize(rows_index_.keys().size() * layout_.row_size());
    add_to(&rows_[size_t{number} * layout_.row_size()], other.row(i));
  }
  light_residuals_.resize(std::max(light_residuals_.size(), other.light_residuals_.size()));
  add_to(light_residuals_.data(), std::span(other.light_residuals_));
  n_rejected_ += other.n_rejected_;
}

void SystemSums::scale_held_out(double factor) {
  for (uint32_t i = 0; i < n_cells(); ++i)
    for (uint32_t j = SystemLayout::kHeldOut; j < SystemLayout::kDense; ++j)
      heads_[size_t{i} * layout_.head_size() + j] *= factor;
}

void SystemSums::clear() {
  cells_.clear(), rows_index_.clear();
  heads_.clear(), rows_.clear(), light_residuals_.clear();
  n_rejected_ = 0;
}

CellKey SystemSums::key(uint32_t cell) const {
  CellKey key;
  key.bits = cells_.keys()[cell];
  return key;
}

std::span<const double> SystemSums::head(uint32_t cell) const {
  return std::span(heads_).subspan(size_t{cell} * layout_.head_size(), layout_.head_size());
}

std::span<const float> SystemSums::row(size_t row) const {
  return std::span(rows_).subspan(row * layout_.row_size(), layout_.row_size());
}

size_t SystemSums::bytes() const {
  return cells_.bytes() + rows_index_.bytes() + (heads_.capacity() + light_residuals_.capacity()) * sizeof(double) +
         rows_.capacity() * sizeof(float);
}

}  // namespace covary
