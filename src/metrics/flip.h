// SPDX-License-Identifier: Apache-2.0
// FLIP, the difference perceived when flipping between two images [Andersson2020], and its HDR version [Andersson2021].
// Implemented from the papers.
#pragma once

#include <functional>

#include "film/film.h"

namespace covary {

/// Pixels per degree of visual angle: a screen 0.7 m and 3840 pixels wide, seen from 0.7 m, as in [Andersson2020].
inline constexpr float kFlipPixelsPerDegree = 67.0206f;

/// LDR-FLIP per pixel, in [0, 1]. Linear RGB, clamped to [0, 1].
Image flip_ldr(const Image& image, const Image& reference, float pixels_per_degree = kFlipPixelsPerDegree);

/// Range of HDR-FLIP's exposures in stops, chosen from the reference's luminance.
struct FlipExposures {
  float start = 0, stop = 0;
  int count = 2;
};
FlipExposures flip_exposures(const Image& reference);
/// The same for a reference in pieces: `visit` calls its argument with each piece, in any order. It is called twice.
using VisitImages = std::function<void(const std::function<void(const Image&)>&)>;
FlipExposures flip_exposures(const VisitImages& visit);

/// Radius in rows of the neighbourhood that FLIP of a pixel depends on, at kFlipPixelsPerDegree.
inline constexpr int kFlipHalo = 10;

/// HDR-FLIP per pixel: the maximum of LDR-FLIP over exposures, tone mapped with the ACES curve. Finite linear RGB.
Image flip_hdr(const Image& image, const Image& reference, const FlipExposures& exposures,
               float pixels_per_degree = kFlipPixelsPerDegree);
/// Uses the exposures of this reference.
Image flip_hdr(const Image& image, const Image& reference);

}  // namespace covary
