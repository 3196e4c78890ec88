// SPDX-License-Identifier: Apache-2.0
#include "metrics/alignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/error.h"

namespace covary {
namespace {

CropWindow intersection(const CropWindow& a, const CropWindow& b) {
  const int x0 = std::max(a.x, b.x), y0 = std::max(a.y, b.y);
  return {x0, y0, std::min(a.x + a.width, b.x + b.width) - x0, std::min(a.y + a.height, b.y + b.height) - y0};
}

}  // namespace

std::string text_of(const CropWindow& w) { return fmt::format("{} x {} at ({}, {})", w.width, w.height, w.x, w.y); }

CropWindow common_window(const std::string& path, const ImagePlace& place, const CropWindow& window,
                         const std::string& other_path, const ImagePlace& other) {
  if (place.frame_width != other.frame_width || place.frame_height != other.frame_height)
    throw Error(
        ErrorCode::kInput,
        fmt::format(
            "{} has a frame of {} x {} pixels, {} one of {} x {}; images of one size are compared: render one again "
            "with the size of the other (of covary: --resolution)",
            path, place.frame_width, place.frame_height, other_path, other.frame_width, other.frame_height));
  const CropWindow common = intersection(window, other.window);
  if (common.width < 1 || common.height < 1)
    throw Error(ErrorCode::kInput, fmt::format("{} ({}) and {} ({}) have no pixels in common", path,
                                               text_of(place.window), other_path, text_of(other.window)));
  return common;
}

Image cut(const PlacedImage& source, const CropWindow& window) {
  Image result(window.width, window.height, 3);
  for (int y = 0; y < window.height; ++y)
    std::copy_n(source.image.pixel(window.x - source.place.window.x, window.y - source.place.window.y + y),
                static_cast<size_t>(window.width) * 3, result.pixel(0, y));
  return result;
}

Image cut(PlacedImage&& source, const CropWindow& window) {
  return source.place.window == window ? std::move(source.image) : cut(source, window);
}

}  // namespace covary
