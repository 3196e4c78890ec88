// SPDX-License-Identifier: Apache-2.0
// The image by the number of edges of its paths: what is seen of the lights themselves (1), by one reflection (2), …
#pragma once

#include <vector>

#include "film/film.h"
#include "passes/integrator.h"
#include "passes/render_pass.h"

namespace covary {

/// Most edges of a path that are told apart; longer paths are in none of the images.
inline constexpr int kMostEdges = 16;

/// Image i holds the part of the film's samples that came by paths of i + 1 edges; as many images as there are lengths,
/// at most kMostEdges. Together they are the film's mean where no path has more edges. Traces the samples again, which
/// takes as long as the film did. `settings`: those of the film's render; reads stop, and then returns none. Throws
/// Error(kUsage) for an integrator without Integrator::longest_path().
std::vector<Image> path_length_images(const Scene& scene, const Integrator& integrator, const PassSettings& settings,
                                      const Film& film);

}  // namespace covary
