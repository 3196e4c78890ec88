// SPDX-License-Identifier: Apache-2.0
// Image textures. Texel (x, y), y counted from the top row of the image, is centred at ((x + 0.5) / width, (y + 0.5) /
// height) in texture coordinates: v = 0 is the top edge.
#pragma once

#include "scene/texture.h"
#include "textures/image.h"
#include "textures/uv_transform.h"

namespace covary {

enum class WrapMode { kRepeat, kMirror, kClamp, kBlack };
enum class FilterType { kBilinear, kNearest };

struct BitmapSettings {
  bool raw = false;  ///< integer files hold linear values: no sRGB decoding
  float gamma = 0;   ///< if positive, integers are decoded by this power instead of sRGB's curve
  FilterType filter = FilterType::kBilinear;
  WrapMode wrap = WrapMode::kRepeat;
  UvTransform to_uv;  ///< from surface parameters to texture coordinates
};

/// Texture that interpolates `image`, which has at least one pixel. Positions are sampled exactly in proportion to the
/// interpolated luminance if to_uv maps the unit square to itself, uniformly otherwise.
std::shared_ptr<Texture> make_bitmap_texture(TexelImage image, const BitmapSettings& settings);

}  // namespace covary
