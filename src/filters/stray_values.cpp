// SPDX-License-Identifier: Apache-2.0
#include "filters/stray_values.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <tuple>

#include "filters/planes.h"

namespace covary {
namespace {

constexpr float kConfirmed = 0.1f;     // of the value, in another group of the pixel, or beside it
constexpr double kDarkestPixel = 0.1;  // the root of relMSE's 0.01

bool is_darker(const StrayValue& a, const StrayValue& b) { return a.brightness > b.brightness; }  // for heaps

float brightness(const float* rgb) { return (std::abs(rgb[0]) + std::abs(rgb[1]) + std::abs(rgb[2])) / 3; }

bool are_usable(const float* rgb) { return std::all_of(rgb, rgb + 3, is_usable); }

/// Whether a pixel is much brighter than the eight around it.
bool stands_out(const Image& image, const std::vector<float>& brightnesses, int x, int y) {
  const float own = brightnesses[static_cast<size_t>(y) * image.width + x];
  for (int j = std::max(0, y - 1); j <= std::min(image.height - 1, y + 1); ++j)
    for (int i = std::max(0, x - 1); i <= std::min(image.width - 1, x + 1); ++i)
      if ((i != x || j != y) && brightnesses[static_cast<size_t>(j) * image.width + i] > kConfirmed * own) return false;
  return true;
}

/// 1 for pixels whose values are stray or not usable; see with_usable_values().
std::vector<unsigned char> bad_pixels(const Image& image) {
  std::vector<unsigned char> bad(image.data.size() / 3);
  std::vector<float> brightnesses(bad.size());
  for (size_t p = 0; p < bad.size(); ++p) {
    bad[p] = !are_usable(&image.data[3 * p]);
    if (!bad[p]) brightnesses[p] = brightness(&image.data[3 * p]);
  }
  if (bad.size() <= kMaxStrays) return bad;
  std::vector<float> ordered = brightnesses;
  const auto rest = ordered.begin() + kMaxStrays;
  std::nth_element(ordered.begin(), rest, ordered.end(), std::greater<>());
  double light = kDarkestPixel * static_cast<double>(bad.size());
  for (auto it = rest; it != ordered.end(); ++it) light += *it;
  std::vector<size_t> strays;
  for (size_t p = 0; p < bad.size(); ++p) {
    const int x = static_cast<int>(p % image.width), y = static_cast<int>(p / image.width);
    if (brightnesses[p] > kMaxOfPicture * light && stands_out(image, brightnesses, x, y)) strays.push_back(p);
  }
  if (strays.size() < kMaxStrays)
    for (const size_t p : strays) bad[p] = 1;
  return bad;
}

/// The mean of the usable pixels, other than those marked in `bad`, in the square of radius r around (x, y), per
/// channel; false if there are none.
bool mean_around(const Image& image, const std::vector<unsigned char>& bad, int x, int y, int r, float* rgb) {
  double sum[3] = {};
  long n = 0;
  for (int j = std::max(0, y - r); j <= std::min(image.height - 1, y + r); ++j)
    for (int i = std::max(0, x - r); i <= std::min(image.width - 1, x + r); ++i) {
      if (bad[static_cast<size_t>(j) * image.width + i]) continue;
      for (int c = 0; c < 3; ++c) sum[c] += image.pixel(i, j)[c];
      ++n;
    }
  for (int c = 0; c < 3 && n > 0; ++c) rgb[c] = static_cast<float>(sum[c] / static_cast<double>(n));
  return n > 0;
}

}  // namespace

void StrayValues::add_rows(const GroupedImage& image) {
  groups_ = image.groups;
  if (groups_ < 2) return;
  for (int y = 0; y < image.height; ++y, ++next_row_)
    for (int x = 0; x < image.width; ++x) {
      const float* p = image.pixel(x, y);
      StrayValue largest{x, next_row_, -1, 0};
      float second = 0;
      double light = 0;
      for (int t = 0; t < image.groups; ++t) {
        if (!are_usable(p + 3 * t)) continue;
        const float value = brightness(p + 3 * t);
        light += value;
        second = std::max(second, std::min(value, largest.brightness));
        if (value > largest.brightness) largest.brightness = value, largest.group = t;
      }
      light_ += (light - largest.brightness) / (image.groups - 1) + kDarkestPixel;
      if (second > kConfirmed * largest.brightness || largest.group < 0) continue;
      if (brightest_.size() == kMaxStrays && largest.brightness <= brightest_.front().brightness) continue;
      if (brightest_.size() == kMaxStrays) {
        std::pop_heap(brightest_.begin(), brightest_.end(), is_darker);
        brightest_.pop_back();
      }
      brightest_.push_back(largest);
      std::push_heap(brightest_.begin(), brightest_.end(), is_darker);
    }
}

std::vector<StrayValue> StrayValues::found() const {
  std::vector<StrayValue> strays = brightest_;
  std::erase_if(strays, [&](const StrayValue& s) { return !(s.brightness > kMaxOfPicture * light_ * groups_); });
  if (strays.size() == kMaxStrays) return {};
  std::sort(strays.begin(), strays.end(), [](const StrayValue& a, const StrayValue& b) {
    return std::tuple(-a.brightness, a.y, a.x) < std::tuple(-b.brightness, b.y, b.x);
  });
  return strays;
}

void leave_out(const std::vector<StrayValue>& strays, int first_row, int n_rows, int width, int groups, float* data) {
  for (const StrayValue& s : strays)
    if (s.y >= first_row && s.y < first_row + n_rows)
      std::fill_n(data + ((static_cast<size_t>(s.y - first_row) * width + s.x) * groups + s.group) * 3, 3,
                  std::numeric_limits<float>::quiet_NaN());
}

Image with_usable_values(Image image, std::vector<StrayValue>* replaced) {
  const std::vector<unsigned char> bad = bad_pixels(image);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (!bad[static_cast<size_t>(y) * image.width + x]) continue;
      if (replaced) replaced->push_back({x, y, 0, brightness(image.pixel(x, y))});
      float* rgb = image.pixel(x, y);
      std::fill_n(rgb, 3, 0.0f);
      const int farthest = std::max(image.width, image.height);
      for (int r = 1; r <= farthest && !mean_around(image, bad, x, y, r, rgb);) r *= 2;
    }
  return image;
}

}  // namespace covary
