// SPDX-License-Identifier: Apache-2.0
// Images as text in an HTML page: half floats, prediction residuals, deflate, base64. Decoded by assets/images.js.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// The bits of the nearest half float; finite values are clamped to ±65504, infinities and NaN are preserved.
uint16_t half_bits(float value);

/// Residuals of predicting each value from its neighbours; 2 · width · height · channels bytes. The bits of half
/// floats, read as integers, grow roughly logarithmically, so noise that scales all channels alike cancels in their
/// differences:
///   v = bits of the channel minus those of the previous channel [0 for the first]
///   d = v - floor((left + above) / 2) with the neighbours' v; only the existing one at a border, 0 in the corner
/// all modulo 2^16, v and d in [-2^15, 2^15). Channel by channel and row by row, first the high bytes of all z, which
/// are mostly zero, then all low bytes.
std::vector<uint8_t> predicted_halves(const Image& image);

/// predicted_halves() compressed with zlib, as base64.
std::string encode_image(const Image& image);

std::string base64(const std::vector<uint8_t>& bytes);

}  // namespace covary
