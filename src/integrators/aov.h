// SPDX-License-Identifier: Apache-2.0
// Auxiliary images (AOVs): the auxiliary features of the surfaces behind each pixel.
#pragma once

#include <atomic>

#include "film/auxiliary_features.h"
#include "film/film.h"
#include "passes/render_pass.h"

namespace covary {

/// Maximum number of mirror and glass bounces that are followed to the surface behind.
inline constexpr int kFollowedBounces = 8;

/// Fills film.aovs with the images, each the mean over filtered camera rays: `most` of them, or as many rounds of 16 as
/// it takes until the standard errors of the pixel's albedos and normals are below 0.01, or its rays, through glass,
/// have met 3 * `most` surfaces:
///
///     Albedo           reflectance of the first surface, in [0, 1]
///     N, P             its shading normal and position in world space
///     DenoisingAlbedo  reflectance of the first surface with more than delta lobes, times the throughput of the
///                      mirrors and panes of glass before it, in [0, 1]
///     DenoisingNormal  its shading normal in world space
///     A                of one channel, if `alpha`: the fraction of rays that meet a surface or a medium
///
/// In participating media, a ray ends where the sample's path first scatters, if that comes before a surface: there,
/// the values are the scattering albedo, no normal, and the position. Boundaries of media (bsdf `null`) are then
/// passed.
///
/// At a mirror or glass surface, one direction is sampled as for a path, at most kFollowedBounces times; a ray that is
/// still between mirrors then takes the last of them. Rays that leave the scene count as zero. The random numbers are
/// points of a Sobol' sequence with the pass's key, as good as four times as many independent ones. Tells
/// PassSettings::progress the pixels done. If `stop` becomes true, ends at the next row and leaves film.aovs unchanged.
void render_aovs(const Scene& scene, const PassSettings& pass, uint32_t most, Film& film,
                 const std::atomic<bool>* stop = nullptr, bool alpha = false);

}  // namespace covary
