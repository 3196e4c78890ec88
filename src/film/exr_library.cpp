// SPDX-License-Identifier: Apache-2.0
#include "film/exr_library.h"

#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfThreading.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>

#include <mutex>

namespace covary {
namespace {

/// Tiles larger than this in either direction are taken as damage.
constexpr int kMaxTile = 1 << 12;

}  // namespace

void prepare_exr_library() {
  static std::mutex mutex;
  static int current = -1;
  const std::lock_guard lock(mutex);
  if (current < 0)
    Imf::Header::setMaxImageSize(kMaxExrSize, kMaxExrSize), Imf::Header::setMaxTileSize(kMaxTile, kMaxTile);
  const auto allowed =
      static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  const int wanted = allowed > 1 ? allowed : 0;  // 0: the calling thread does the work
  if (wanted != current) Imf::setGlobalThreadCount(current = wanted);
}

const char* exr_type_name(Imf::PixelType type) {
  return type == Imf::HALF ? "half" : type == Imf::FLOAT ? "float" : "uint";
}

Imf::PixelType exr_pixel_type(const ExrPlane& plane) {
  return plane.type == ExrPlane::Type::kUint ? Imf::UINT : Imf::FLOAT;
}

Imf::Slice exr_slice(const ExrPlane& plane, const Imath::Box2i& window) {
  const size_t width = static_cast<size_t>(int64_t{window.max.x} - window.min.x + 1);
  return Imf::Slice::Make(exr_pixel_type(plane), plane.base, window, plane.pixel_stride, plane.pixel_stride * width);
}

std::string exr_shape_text(const ImagePlace& place, const std::vector<std::string>& channels) {
  const CropWindow& w = place.window;
  return fmt::format("{} {} {} {} {} {}\n{}", place.frame_width, place.frame_height, w.x, w.y, w.width, w.height,
                     fmt::join(channels, "\n"));
}

}  // namespace covary
