// SPDX-License-Identifier: Apache-2.0
// Films of the parts of samples that an integrator tells apart (PathContext::by_part), such as the light of single
// lamps: the samples are traced again with the same random numbers.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "film/film.h"
#include "passes/integrator.h"
#include "passes/render_pass.h"

namespace covary {

/// Brings film i of `parts` to part i of the samples of `film`; the films of `parts` have the same groups, counts and
/// window. Takes as long as the film did. `settings`: those of the film's pass; returns early, with fewer samples, once
/// settings.stop is true. Samples that are black in the film because they are not finite or negative are so in all.
void trace_parts(const Scene& scene, const Integrator& integrator, const PassSettings& settings, const Film& film,
                 std::span<Film> parts);

/// Films without samples, for parts of the samples of `film`.
std::vector<Film> films_of_parts(const Film& film, size_t n_parts, int groups);

/// The groups of the scene's lights (Emitter::group()), in their order; those without one are in none.
std::vector<std::string> light_groups(const Scene& scene);

}  // namespace covary
