// SPDX-License-Identifier: Apache-2.0
// A denoiser's image of all samples, bettered by those of halves of them, which are needed to judge it anyway (ours).
//
// Networks err differently on other samples and on mirror images. D: the denoiser, h: all samples, h_A, h_B: halves,
// M_x and M_y: columns and rows in reverse order; then in place of D(h)
//
//     D(h) / 2 + (M_x D(M_x h_A) + M_y D(M_y h_B)) / 4.
//
// Means over mirror images are usual in image restoration: Timofte, Rothe, Van Gool, CVPR 2016, "enhanced prediction".
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "film/film.h"

namespace covary {

/// What is in reverse order.
enum class Mirror { kNone, kColumns, kRows };
Image mirrored(const Image& image, Mirror mirror);

/// `denoise(image, mirror)` denoises an image that is mirrored. `images`: all samples, or these and both halves. The
/// results have the images' own order of pixels, and that of all samples is the mean above where there are halves.
std::vector<Image> denoise_with_halves(std::span<const Image* const> images,
                                       const std::function<Image(const Image& image, Mirror mirror)>& denoise);

}  // namespace covary
