// SPDX-License-Identifier: Apache-2.0
// Images as text for an HTML page: half floats, differences of neighbours, deflate, base64. assets/images.js decodes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// The bits of the nearest half float; finite values beyond ±65504 become ±65504, infinities and not-a-number stay.
uint16_t half_bits(float value);

/// For each channel, row by row, the bits of each pixel's half float less those of the pixel to its left (of the pixel
/// above in the first column, of 0 in the corner), modulo 2^16; first all high bytes, then all low bytes.
/// 2 · width · height · channels bytes. High bytes repeat, so that deflate finds more than in the pixels themselves.
std::vector<uint8_t> predicted_halves(const Image& image);

/// predicted_halves() in zlib's format, as base64.
std::string encode_image(const Image& image);

std::string base64(const std::vector<uint8_t>& bytes);

}  // namespace covary
