// SPDX-License-Identifier: Apache-2.0
// Films of the parts of samples that an integrator separates (PathContext::by_part), such as the light of individual
// lamps: the samples are traced again with the same random numbers.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "film/film.h"
#include "passes/integrator.h"
#include "passes/render_pass.h"

namespace covary {

/// Adds to film i of `parts` part i of the samples of `film`, until its counts are reached; the films of `parts` must
/// agree in groups, counts and window. Takes as long as rendering `film` did. `settings`: those of the film's pass;
/// returns early, with fewer samples, once settings.stop is true. Samples that are black in the film because they are
/// negative or not finite are black in all parts.
void trace_parts(const Scene& scene, const Integrator& integrator, const PassSettings& settings, const Film& film,
                 std::span<Film> parts);

/// Empty films for parts of the samples of `film`.
std::vector<Film> films_of_parts(const Film& film, size_t n_parts, int groups);

/// The groups of the scene's lights (Emitter::group()), in order, without lights that have none.
std::vector<std::string> light_groups(const Scene& scene);

// The image's layers of direct and indirect light, for compositing: direct light is traced again with the same random
// numbers and shorter paths; indirect light is the rest of the film.

/// The layers' names, in films and files.
inline constexpr const char* kLayerNames[] = {"Direct", "Indirect"};

/// Adds to `direct` the part of the samples of `film` with at most two edges (Integrator::of_direct_light(), prepared),
/// in the same groups. `settings`: those of the film's pass. Returns early, with fewer samples, once settings.stop is
/// true.
void trace_direct_light(const Scene& scene, const Integrator& direct_light, const PassSettings& settings,
                        const Film& film, Film& direct);

/// The remainder of a film without its direct light, from the same samples.
Film indirect_light(const Film& film, const Film& direct);

// The image by path length in edges: directly visible lights (1), one reflection (2), …

/// Longest path length that gets an image; longer paths are excluded.
inline constexpr int kMaxEdges = 16;

/// Image i contains the part of the film's samples with paths of i + 1 edges; there is one image per length, at most
/// kMaxEdges. They sum to the film's mean if no path is longer. Traces the samples again, which takes as long as
/// rendering the film did. `settings`: those of the film's render; returns none once stop is true. Throws Error(kUsage)
/// for an integrator without Integrator::longest_path().
std::vector<Image> path_length_images(const Scene& scene, const Integrator& integrator, const PassSettings& settings,
                                      const Film& film);

}  // namespace covary
