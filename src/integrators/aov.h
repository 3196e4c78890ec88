// SPDX-License-Identifier: Apache-2.0
// Auxiliary images: what the surfaces behind each pixel look like.
#pragma once

#include <atomic>

#include "film/film.h"
#include "passes/render_pass.h"

namespace covary {

/// The names of all auxiliary images, in film.aovs and as layers of files.
inline constexpr const char* kAuxiliaryImages[] = {"Albedo", "N", "P", "DenoisingAlbedo", "DenoisingNormal"};

/// Mirrors and glass that are followed to the surface behind them.
inline constexpr int kFollowedBounces = 8;

/// Fills film.aovs with the images, each the mean over filtered camera rays: `most` of them, or as many rounds of 16 as
/// it takes until the standard errors of the pixel's albedos and normals are below 0.01:
///
///     Albedo           reflectance of the first surface, in [0, 1]
///     N, P             its shading normal and position in world space
///     DenoisingAlbedo  reflectance of the first surface that scatters light in more than single directions, times what
///                      the mirrors and panes of glass before it let through, in [0, 1]
///     DenoisingNormal  its shading normal in world space
///
/// In participating media a ray ends where the sample's path first scatters, if that comes before a surface: with the
/// scattering albedo there, no normal, and the position. Boundaries of media (bsdf `null`) are then passed.
///
/// Where a ray meets a surface of mirror or glass, one direction is drawn as a path's is, at most kFollowedBounces
/// times; a ray that is still between mirrors then takes the last of them. Rays that leave the scene count as zero. The
/// random numbers are the points of a Sobol' sequence with the pass's key: as good as four times as many independent
/// ones. Ends at the next row once `stop` is true, and leaves film.aovs as it is.
void render_aovs(const Scene& scene, const PassSettings& pass, uint32_t most, Film& film,
                 const std::atomic<bool>* stop = nullptr);

}  // namespace covary
