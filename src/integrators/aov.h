// SPDX-License-Identifier: Apache-2.0
// Auxiliary images: what the first surface behind each pixel looks like.
#pragma once

#include <atomic>

#include "film/film.h"
#include "integrators/render_pass.h"

namespace covary {

/// Fills film.aovs with `Albedo` (reflectance in [0, 1]), `N` (shading normal in world space) and `P` (position in
/// world space), each the mean over `spp` filtered camera rays; rays that leave the scene count as zero. The film
/// positions are those of the first `spp` samples of the pass of these settings, whose own number of samples is not
/// read. Ends at the next row once `stop` is true, and leaves film.aovs as it is.
void render_aovs(const Scene& scene, const PassSettings& settings, uint32_t spp, Film& film,
                 const std::atomic<bool>* stop = nullptr);

}  // namespace covary
