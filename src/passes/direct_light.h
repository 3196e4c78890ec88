// SPDX-License-Identifier: Apache-2.0
// The image's layers of direct and indirect light, for compositing: direct light is traced again with the same random
// numbers and shorter paths, and indirect light is what is left of the film.
#pragma once

#include "film/film.h"
#include "passes/integrator.h"
#include "passes/render_pass.h"

namespace covary {

/// The layers' names, in films and files.
inline constexpr const char* kLayerNames[] = {"Direct", "Indirect"};

/// Brings `direct` to the part of the samples of `film` that came by at most two edges (Integrator::of_direct_light(),
/// prepared), in the same groups. `settings`: those of the film's pass. Returns early, with
/// fewer samples, once settings.stop is true.
void trace_direct_light(const Scene& scene, const Integrator& direct_light, const PassSettings& settings,
                        const Film& film, Film& direct);

/// What a film holds beside that part of the same samples.
Film indirect_light(const Film& film, const Film& direct);

}  // namespace covary
