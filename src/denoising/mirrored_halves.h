// SPDX-License-Identifier: Apache-2.0
// Improves a denoiser's image of all samples by averaging with those of the halves, needed for cross-validation anyway.
//
// A network makes different errors for other samples and for mirror images. With the denoiser D, all samples h, halves
// h_A and h_B, and reversals M_x of columns and M_y of rows, D(h) is replaced by
//
//     D(h) / 2 + (M_x D(M_x h_A) + M_y D(M_y h_B)) / 4.
//
// Averaging over mirror images is common in image restoration ("enhanced prediction" of [Timofte2016]).
#pragma once

#include <functional>
#include <span>

#include "film/film.h"

namespace covary {

/// The axis whose order is reversed.
enum class Mirror { kNone, kColumns, kRows };
Image mirrored(Image image, Mirror mirror);

/// `denoise(image, mirror, part)` denoises a mirrored image, of all samples (0), which come last, or a half (1, 2).
/// `images`: all samples, or all samples and both halves; receives the results, in the original order of pixels. The
/// first is the average above if there are halves.
void denoise_with_halves(std::span<Image> images,
                         const std::function<Image(Image image, Mirror mirror, int part)>& denoise);

}  // namespace covary
