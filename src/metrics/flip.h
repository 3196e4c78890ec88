// SPDX-License-Identifier: Apache-2.0
// FLIP, the difference a viewer sees when flipping between two images [Andersson2020], and its form for high dynamic
// range [Andersson2021]. Written from the papers.
#pragma once

#include <functional>

#include "film/film.h"

namespace covary {

/// Pixels per degree of visual angle: a screen 0.7 m wide with 3840 pixels seen from 0.7 m, as in [Andersson2020].
inline constexpr float kFlipPixelsPerDegree = 67.0206f;

/// LDR-FLIP per pixel, in [0, 1]; linear RGB, clamped to [0, 1].
Image flip_ldr(const Image& image, const Image& reference, float pixels_per_degree = kFlipPixelsPerDegree);

/// Exposures of HDR-FLIP in stops, chosen from the reference's luminance.
struct FlipExposures {
  float start = 0, stop = 0;
  int count = 2;
};
FlipExposures flip_exposures(const Image& reference);
/// The same of a reference in pieces: `visit` calls its argument with each of them, in any order. It is called twice.
using VisitImages = std::function<void(const std::function<void(const Image&)>&)>;
FlipExposures flip_exposures(const VisitImages& visit);

/// How many rows around a pixel its FLIP depends on, at kFlipPixelsPerDegree.
inline constexpr int kFlipReach = 10;

/// HDR-FLIP per pixel: the largest LDR-FLIP over the exposures, tone mapped by the ACES curve. Finite linear RGB.
Image flip_hdr(const Image& image, const Image& reference, const FlipExposures& exposures,
               float pixels_per_degree = kFlipPixelsPerDegree);
/// With the exposures of this reference.
Image flip_hdr(const Image& image, const Image& reference);

}  // namespace covary
