// SPDX-License-Identifier: Apache-2.0
#include "film/luminance_chroma.h"

#include <OpenEXR/ImfRgbaFile.h>

#include <cstdint>
#include <cstring>
#include <vector>

namespace covary {

namespace Imf = OPENEXR_IMF_NAMESPACE;

bool has_luminance_chroma(const Imf::ChannelList& channels) {
  const Imf::Channel *y = channels.findChannel("Y"), *ry = channels.findChannel("RY"), *by = channels.findChannel("BY");
  const auto is_half_size = [](const Imf::Channel* c) { return c && c->xSampling == 2 && c->ySampling == 2; };
  return y && y->xSampling == 1 && y->ySampling == 1 && is_half_size(ry) && is_half_size(by);
}

struct LuminanceChroma::File {
  explicit File(const std::string& path) : input(path.c_str()) {}
  Imf::RgbaInputFile input;
};

LuminanceChroma::LuminanceChroma(const std::string& path) : file_(std::make_unique<File>(path)) {}
LuminanceChroma::~LuminanceChroma() = default;

void LuminanceChroma::read_rows(std::span<const ExrPlane> planes, int y, int n_rows) const {
  const Imath::Box2i window = file_->input.dataWindow();
  const auto width = static_cast<size_t>(window.max.x - window.min.x + 1);
  std::vector<Imf::Rgba> pixels(width * static_cast<size_t>(n_rows));
  // The address of pixel (0, 0) of the file, which need not be among these.
  Imf::Rgba* const origin = pixels.data() - (window.min.x + static_cast<ptrdiff_t>(y) * static_cast<ptrdiff_t>(width));
  file_->input.setFrameBuffer(origin, 1, width);
  file_->input.readPixels(y, y + n_rows - 1);
  for (const ExrPlane& plane : planes) {
    auto* to = static_cast<char*>(plane.base);
    for (const Imf::Rgba& pixel : pixels) {
      const float value = plane.name == "R" ? pixel.r : plane.name == "G" ? pixel.g : pixel.b;
      const auto whole = static_cast<uint32_t>(value);
      plane.type == ExrPlane::Type::kUint ? std::memcpy(to, &whole, sizeof whole)
                                          : std::memcpy(to, &value, sizeof value);
      to += plane.pixel_stride;
    }
  }
}

}  // namespace covary
