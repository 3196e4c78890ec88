// SPDX-License-Identifier: Apache-2.0
#include "denoising/rows_of_parts.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "core/error.h"

namespace covary {
namespace {

Planes rows_of(const Planes& planes, int first, int n) {
  COVARY_CHECK(planes.border() == 0, "rows of planes without border");
  Planes rows(planes.width(), n, planes.count(), 0, 0);
  for (int c = 0; c < planes.count(); ++c)
    for (int y = 0; y < n; ++y) std::copy_n(planes.row(c, first + y), planes.width(), rows.row(c, y));
  return rows;
}

Planes joined(const Planes& above, const Planes& below) {
  Planes all(above.width(), above.height() + below.height(), above.count(), 0, 0);
  for (int c = 0; c < all.count(); ++c)
    for (int y = 0; y < all.height(); ++y) {
      const bool is_above = y < above.height();
      std::copy_n(is_above ? above.row(c, y) : below.row(c, y - above.height()), all.width(), all.row(c, y));
    }
  return all;
}

Image joined(Image above, const Image& below) {
  above.data.insert(above.data.end(), below.data.begin(), below.data.end());
  above.height += below.height;
  return above;
}

/// Calls f(first, second) for all pairs of images, and of planes, of parts that hold the same kinds.
template <typename First, typename Second, typename F>
void for_each_pair(First& a, Second& b, const F& f) {
  const auto mean = [&](auto& m, auto& n) {
    f(m.mean, n.mean), f(m.variance_of_mean, n.variance_of_mean);
    if (m.relative_count) f(*m.relative_count, *n.relative_count);
  };
  const auto part = [&](auto& p, auto& q) {
    f(p.image.estimate, q.image.estimate), f(p.image.std_error, q.image.std_error), mean(p.independent, q.independent);
    if (!p.limited) return;
    f(p.limited->estimate, q.limited->estimate), f(p.limited->std_error, q.limited->std_error);
    mean(p.limited->independent, q.limited->independent);
  };
  part(a.whole, b.whole);
  for (const size_t half : {0, 1}) part(a.halves[half], b.halves[half]);
}

std::vector<unsigned char> rows_of(const std::vector<unsigned char>& valid, int width, int first, int n) {
  const auto begin = valid.begin() + static_cast<ptrdiff_t>(first) * width;
  return {begin, begin + static_cast<ptrdiff_t>(n) * width};
}

int width_of(const DenoisingParts& parts) { return parts.whole.image.estimate.width; }

void leave(int first, int n, CandidateSet& set) {
  set.base = covary::rows_of(set.base, first, n);
  for (Image& image : set.candidates) image = covary::rows_of(image, first, n);
}

/// Parts that hold the same kinds of images, all empty.
DenoisingParts like(const DenoisingParts& parts) {
  DenoisingParts empty;
  empty.is_mean = parts.is_mean, empty.name = parts.name;
  const auto mean = [](const Moments& from, Moments& to) {
    if (from.relative_count) to.relative_count.emplace();
  };
  const auto part = [&](const DenoisingPart& from, DenoisingPart& to) {
    mean(from.independent, to.independent);
    if (from.limited) mean(from.limited->independent, to.limited.emplace().independent);
  };
  part(parts.whole, empty.whole);
  for (const size_t half : {0, 1}) part(parts.halves[half], empty.halves[half]);
  return empty;
}

}  // namespace

void leave_rows(int first, int n, DenoisingParts& parts) {
  parts.valid = rows_of(parts.valid, width_of(parts), first, n);
  for_each_pair(parts, parts, [&](auto& rows, auto&) { rows = rows_of(rows, first, n); });
  parts.groups = {}, parts.features = {};
}

void leave_rows(int first, int n, MixedParts& mixed) {
  mixed.counts = {}, mixed.mixture.weights.clear();
  for (CandidateSet* set : {&mixed.whole, &mixed.halves[0], &mixed.halves[1]}) leave(first, n, *set);
  for (Image* image : {&mixed.mixture.image, &mixed.mixture.halves[0], &mixed.mixture.halves[1]})
    *image = rows_of(*image, first, n);
}

void leave_rows(int first, int n, std::vector<CandidateSet>& sets) {
  for (CandidateSet& set : sets) leave(first, n, set);
}

DenoisingParts rows_of(const DenoisingParts& parts, int first, int n) {
  DenoisingParts rows = like(parts);
  rows.valid = rows_of(parts.valid, width_of(parts), first, n);
  for_each_pair(parts, rows, [&](const auto& from, auto& to) { to = rows_of(from, first, n); });
  return rows;
}

std::vector<std::vector<Image>> rows_of(const std::vector<CandidateSet>& sets, int first, int n) {
  std::vector<std::vector<Image>> rows;
  for (const CandidateSet& set : sets) {
    std::vector<Image>& images = rows.emplace_back();
    for (const Image& image : set.candidates) images.push_back(rows_of(image, first, n));
  }
  return rows;
}

void append_rows(DenoisingParts below, DenoisingParts& parts) {
  if (parts.valid.empty()) {
    parts = std::move(below);
    return;
  }
  parts.valid.insert(parts.valid.end(), below.valid.begin(), below.valid.end());
  for_each_pair(parts, below, [](auto& all, auto& more) { all = joined(std::move(all), more), more = {}; });
}

void set_rows(const std::vector<std::vector<Image>>& rows, std::vector<CandidateSet>& sets) {
  for (size_t i = 0; i < rows.size(); ++i)
    for (size_t p = 0; p < rows[i].size(); ++p)
      std::copy(rows[i][p].data.begin(), rows[i][p].data.end(), sets[i].candidates[p].data.begin());
}

}  // namespace covary
