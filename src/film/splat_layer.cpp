// SPDX-License-Identifier: Apache-2.0
#include "film/splat_layer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/parallel.h"

namespace covary {
namespace {

constexpr size_t kMaxBadSplats = 10;

/// Rows that are summed together: their sums in double precision take at most about 3 MB, unless one row takes more.
int band_rows(const Film& film) {
  const size_t sums_per_row = static_cast<size_t>(film.width()) * static_cast<size_t>(film.groups());
  return static_cast<int>(std::clamp<size_t>((size_t{1} << 17) / sums_per_row, 1, 16));
}

}  // namespace

SplatLayer::SplatLayer(Film& film, bool allows_negative) : film_(film), allows_negative_(allows_negative) {
  const std::vector<uint32_t>& counts = film.counts();
  COVARY_CHECK(!counts.empty(), "a light film needs pixels");
  if (!std::all_of(counts.begin(), counts.end(), [&](uint32_t n) { return n == counts[0]; }))
    throw Error(ErrorCode::kInput, "the pixels of a light film differ in their number of samples; expected equal ones");
  const std::string expected = fmt::to_string(kBundlePaths);
  std::string& found = film.attributes[film_key::kLightPaths];
  if (counts[0] > 0 && found != expected)
    throw Error(ErrorCode::kInput,
                fmt::format("a film with '{}' light paths per sample cannot be continued as a light film "
                            "with {}",
                            found, expected));
  found = expected;
}

bool SplatLayer::begin_round(uint32_t target) {
  const auto groups = static_cast<uint32_t>(film_.groups());
  COVARY_CHECK(target % groups == 0, "bundles must be a multiple of the number of groups");
  first_ = end_ = film_.count(0, 0);
  if (first_ >= target) return false;
  const uint32_t size = groups * std::max(1u, kRoundBundles / groups);
  end_ = static_cast<uint32_t>(std::min<uint64_t>(target, (uint64_t{first_} / size + 1) * size));
  bundles_.resize(std::max<size_t>(bundles_.size(), end_ - first_));
  for (Bundle& bundle : bundles_) bundle.splats.clear(), bundle.bad.clear();
  return true;
}

void SplatLayer::add(uint64_t path, int x, int y, const Spectrum& value) {
  const uint64_t bundle = path / kBundlePaths;
  COVARY_CHECK(bundle >= first_ && bundle < end_, fmt::format("light path {} does not belong to the round", path));
  const int column = x - film_.crop().x, row = y - film_.crop().y;
  if (column < 0 || row < 0 || column >= film_.width() || row >= film_.height()) return;
  Bundle& list = bundles_[bundle - first_];
  const bool negative = value.r < 0 || value.g < 0 || value.b < 0;
  if (!is_finite(value) || (negative && !allows_negative_)) [[unlikely]] {
    list.bad.push_back({path, x, y, value});
    return;
  }
  list.splats.push_back({static_cast<uint32_t>(row) * static_cast<uint32_t>(film_.width()) + column, value});
}

void SplatLayer::finish_round() {
  COVARY_CHECK(first_ < end_ && film_.count(0, 0) == first_, "a round of the film as it is");
  const size_t n = end_ - first_;
  // Sorted by pixel, in path order within a pixel.
  parallel_for(n, [&](size_t i) {
    std::vector<Splat>& splats = bundles_[i].splats;
    std::stable_sort(splats.begin(), splats.end(), [](const Splat& a, const Splat& b) { return a.pixel < b.pixel; });
  });
  const int rows = band_rows(film_), n_bands = (film_.height() + rows - 1) / rows;
  parallel_for(n_bands, [&](int i) { add_band(i * rows, std::min((i + 1) * rows, film_.height())); });
  count_splats();
  first_ = end_;
}

void SplatLayer::add_band(int first_row, int end_row) {
  const auto width = static_cast<uint32_t>(film_.width()), groups = static_cast<uint32_t>(film_.groups());
  const uint32_t first_pixel = static_cast<uint32_t>(first_row) * width,
                 end_pixel = static_cast<uint32_t>(end_row) * width;
  std::vector<std::array<double, 3>> sums(static_cast<size_t>(end_pixel - first_pixel) * groups);
  for (uint32_t b = first_; b < end_; ++b) {
    const std::vector<Splat>& splats = bundles_[b - first_].splats;
    auto splat = std::lower_bound(splats.begin(), splats.end(), first_pixel,
                                  [](const Splat& s, uint32_t pixel) { return s.pixel < pixel; });
    for (; splat != splats.end() && splat->pixel < end_pixel; ++splat) {
      std::array<double, 3>& sum = sums[static_cast<size_t>(splat->pixel - first_pixel) * groups + b % groups];
      for (int c = 0; c < 3; ++c) sum[c] += splat->value[c];
    }
  }
  std::vector<Spectrum> means(groups);
  for (uint32_t pixel = first_pixel; pixel < end_pixel; ++pixel) {
    for (uint32_t g = 0; g < groups; ++g)
      for (int c = 0; c < 3; ++c)
        means[g][c] = static_cast<float>(sums[static_cast<size_t>(pixel - first_pixel) * groups + g][c] / kBundlePaths);
    film_.add_sums(static_cast<int>(pixel % width), static_cast<int>(pixel / width), (end_ - first_) / groups, means);
  }
}

void SplatLayer::count_splats() {
  for (uint32_t b = first_; b < end_; ++b) {
    const Bundle& bundle = bundles_[b - first_];
    counts_.n_splats += bundle.splats.size();
    for (const BadSplat& bad : bundle.bad) {
      ++(is_finite(bad.value) ? counts_.n_negative : counts_.n_not_finite);
      if (counts_.bad_splats.size() < kMaxBadSplats) counts_.bad_splats.push_back(bad);
    }
  }
}

}  // namespace covary
