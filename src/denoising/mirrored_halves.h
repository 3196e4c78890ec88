// SPDX-License-Identifier: Apache-2.0
// Improves a denoiser's image of all samples by those of the halves, which are needed to judge it anyway (ours).
//
// Networks err differently on other samples and on mirror images. With the denoiser D, all samples h, halves h_A and
// h_B, and reversal of columns M_x and of rows M_y, D(h) is replaced by
//
//     D(h) / 2 + (M_x D(M_x h_A) + M_y D(M_y h_B)) / 4.
//
// Averaging over mirror images is common in image restoration: Timofte, Rothe, Van Gool, CVPR 2016, "enhanced
// prediction".
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "film/film.h"

namespace covary {

/// What is reversed.
enum class Mirror { kNone, kColumns, kRows };
Image mirrored(const Image& image, Mirror mirror);

/// `denoise(image, mirror)` denoises a mirrored image. `images`: all samples, or these and both halves. The results
/// have the original order of pixels; the first is the mean above if there are halves.
std::vector<Image> denoise_with_halves(std::span<const Image* const> images,
                                       const std::function<Image(const Image& image, Mirror mirror)>& denoise);

}  // namespace covary
