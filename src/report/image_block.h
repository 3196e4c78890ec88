// SPDX-License-Identifier: Apache-2.0
// Images as text for an HTML page: half floats, differences from predictions, deflate, base64. assets/images.js
// decodes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// The bits of the nearest half float; finite values beyond ±65504 become ±65504, infinities and not-a-number stay.
uint16_t half_bits(float value);

/// What each value differs from what its neighbours suggest; 2 · width · height · channels bytes. The bits of half
/// floats, read as integers, grow like a logarithm, so that noise which scales all channels alike cancels in their
/// differences:
///   v = bits of the channel less those of the channel before [of 0 for the first]
///   d = v - floor((left + above) / 2), the v of the pixel's neighbours; one alone at the border, 0 in the corner
///   z = 2 d for d >= 0, -2 d - 1 otherwise
/// all modulo 2^16, v and d in [-2^15, 2^15). Channel by channel and row by row, first all high bytes of z, then all
/// low bytes: the high ones are nearly all zero.
std::vector<uint8_t> predicted_halves(const Image& image);

/// predicted_halves() in zlib's format, as base64.
std::string encode_image(const Image& image);

std::string base64(const std::vector<uint8_t>& bytes);

}  // namespace covary
