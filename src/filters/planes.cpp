// SPDX-License-Identifier: Apache-2.0
#include "filters/planes.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>

#include "core/parallel.h"
#include "film/groups.h"
#include "filters/relative_counts.h"

namespace covary {

Planes::Planes(int width, int height, int count, int border, float value)
    : width_(width), height_(height), count_(count), border_(border), stride_(width + 2 * border + lanes::kLanes) {
  data_.assign(static_cast<size_t>(count) * (height + 2 * border) * stride_ + lanes::kLanes, value);
}

namespace {

/// Whether all values are usable: infinity and NaN have the largest exponent. Integer arithmetic, which can be
/// vectorised in any order.
bool all_usable(const float* values, size_t n) {
  constexpr uint32_t kExponent = 0x7f800000, kLimit = std::bit_cast<uint32_t>(kTooLarge);
  uint32_t bad = 0;
  for (size_t i = 0; i < n; ++i) bad |= (std::bit_cast<uint32_t>(values[i]) & kExponent) >= kLimit;
  return bad == 0;
}

/// Whether n consecutive pixels are usable in both images.
bool all_usable(const GroupedImage& a, const GroupedImage& b, int x, int y, int n) {
  const auto are_usable = [&](const GroupedImage& image) {
    return all_usable(image.pixel(x, y), static_cast<size_t>(n) * 3 * image.groups);
  };
  return are_usable(a) && (b.data == a.data || are_usable(b));
}

}  // namespace

std::vector<unsigned char> finite_pixels(const GroupedImage& a, const GroupedImage& b, long& n_nonfinite) {
  std::vector<unsigned char> valid(static_cast<size_t>(a.width) * a.height, 1);
  std::atomic<long> bad{0};
  parallel_for(a.height, 8, [&](int y) {
    if (all_usable(a, b, 0, y, a.width)) return;
    long bad_in_row = 0;
    for (int x = 0; x < a.width; ++x) {
      if (all_usable(a, b, x, y, 1)) continue;
      valid[static_cast<size_t>(y) * a.width + x] = 0;
      ++bad_in_row;
    }
    bad += bad_in_row;
  });
  n_nonfinite = bad;
  return valid;
}

namespace {

/// Mean of the groups first, first + step, … of one pixel and its variance, per channel.
struct PixelMoments {
  float mean[3] = {}, variance[3] = {};
};

/// Three channels; the fourth is unused.
typedef float Rgb __attribute__((vector_size(4 * sizeof(float))));

/// Groups of equal sizes.
PixelMoments equal_moments(const float* p, int groups, int first, int step) {
  const int n = (groups - first + step - 1) / step;
  const float* const end = p + 3 * (groups - 1);  // memory beyond the last group may not be readable
  const Rgb last = {end[0], end[1], end[2], 0};
  const auto at = [&](int t) {
    Rgb value;
    std::memcpy(&value, p + 3 * t, sizeof value);
    return value;
  };
  const bool has_last = (groups - 1 - first) % step == 0;
  Rgb mean = {}, squares = {};
  for (int t = first; t < groups - 1; t += step) mean += at(t);
  if (has_last) mean += last;
  mean /= static_cast<float>(n);
  for (int t = first; t < groups - 1; t += step) squares += (at(t) - mean) * (at(t) - mean);
  if (has_last) squares += (last - mean) * (last - mean);
  PixelMoments m;
  for (int c = 0; c < 3; ++c) {
    m.mean[c] = mean[c];
    m.variance[c] = n > 1 ? squares[c] / (static_cast<float>(n) * static_cast<float>(n - 1)) : 0.0f;
  }
  return m;
}

/// Groups of `count` samples, weighted by their sizes n_t: m = sum n_t m_t / N, sum n_t (m_t - m)^2 / ((n - 1) N).
PixelMoments weighted_moments(const float* p, int groups, uint32_t count, int first, int step) {
  const int n = (groups - first + step - 1) / step;
  const auto size = [&](int t) { return static_cast<float>(group_size(count, groups, t)); };
  PixelMoments m;
  float samples = 0, squares[3] = {};
  for (int t = first; t < groups; t += step) {
    samples += size(t);
    for (int c = 0; c < 3; ++c) m.mean[c] += size(t) * p[3 * t + c];
  }
  for (float& s : m.mean) s /= samples;
  for (int t = first; t < groups; t += step)
    for (int c = 0; c < 3; ++c) squares[c] += size(t) * (p[3 * t + c] - m.mean[c]) * (p[3 * t + c] - m.mean[c]);
  for (int c = 0; c < 3; ++c) m.variance[c] = n > 1 ? squares[c] / (samples * static_cast<float>(n - 1)) : 0.0f;
  return m;
}

/// Moments::relative_count.
std::optional<Planes> relative_count_plane(const GroupedImage& image, int border) {
  const std::vector<float> counts = relative_counts(image);
  if (counts.empty()) return std::nullopt;
  Planes planes(image.width, image.height, 1, border, 1.0f);
  for (int y = 0; y < image.height; ++y)
    std::copy_n(counts.data() + static_cast<size_t>(y) * image.width, image.width, planes.row(0, y));
  return planes;
}

}  // namespace

std::vector<float> relative_counts(const GroupedImage& image) {
  if (!image.counts) return {};
  const uint32_t* end = image.counts + static_cast<size_t>(image.width) * image.height;
  const double mean = image.mean_count > 0
                          ? image.mean_count
                          : std::accumulate(image.counts, end, 0.0) / static_cast<double>(end - image.counts);
  if (std::all_of(image.counts, end, [&](uint32_t n) { return n == mean; })) return {};
  std::vector<float> relative;
  relative.reserve(static_cast<size_t>(end - image.counts));
  for (const uint32_t* n = image.counts; n < end; ++n) relative.push_back(static_cast<float>(*n / mean));
  return relative;
}

Moments moments(const GroupedImage& image, const std::vector<unsigned char>& valid, int border, float outside,
                int first, int step) {
  Moments m{Planes(image.width, image.height, 3, border, outside),
            Planes(image.width, image.height, 3, border, kUseless), relative_count_plane(image, border)};
  parallel_for(image.height, 8, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      if (!valid[static_cast<size_t>(y) * image.width + x]) continue;
      const float* p = image.pixel(x, y);
      const PixelMoments pixel = image.has_equal_groups(x, y)
                                     ? equal_moments(p, image.groups, first, step)
                                     : weighted_moments(p, image.groups, image.count(x, y), first, step);
      for (int c = 0; c < 3; ++c) {
        m.mean.row(c, y)[x] = pixel.mean[c];
        m.variance_of_mean.row(c, y)[x] = pixel.variance[c];
      }
    }
  });
  return m;
}

namespace {

/// The mean of `image` over the valid pixels of the square of 5 x 5 around (x, y), channel c; 0 if there are none.
float mean_around(const Image& image, const std::vector<unsigned char>& valid, int x, int y, int c) {
  double sum = 0;
  int n = 0;
  for (int j = std::max(0, y - 2); j <= std::min(image.height - 1, y + 2); ++j)
    for (int i = std::max(0, x - 2); i <= std::min(image.width - 1, x + 2); ++i)
      if (valid[static_cast<size_t>(j) * image.width + i]) sum += image.pixel(i, j)[c], ++n;
  return n ? static_cast<float>(sum / n) : 0.0f;
}

}  // namespace

void fill_invalid(const GroupedImage& a, const GroupedImage& b, const std::vector<unsigned char>& valid,
                  Image& result) {
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      if (valid[static_cast<size_t>(y) * a.width + x]) continue;
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        int n = 0;
        for (const GroupedImage* image : {&a, &b})
          for (int t = 0; t < image->groups; ++t) {
            const float v = image->pixel(x, y)[3 * t + c];
            if (!is_usable(v)) continue;
            sum += v;
            ++n;
          }
        result.pixel(x, y)[c] = n ? static_cast<float>(sum / n) : mean_around(result, valid, x, y, c);
      }
    }
}

std::vector<Offset> window_offsets(int window) {
  const int r = window / 2;
  std::vector<Offset> offsets;
  for (int dy = -r; dy <= r; ++dy)
    for (int dx = -r; dx <= r; ++dx) offsets.push_back({dx, dy});
  std::stable_sort(offsets.begin(), offsets.end(), [](const Offset& a, const Offset& b) {
    return a.dx * a.dx + a.dy * a.dy < b.dx * b.dx + b.dy * b.dy;
  });
  return offsets;
}

}  // namespace covary
