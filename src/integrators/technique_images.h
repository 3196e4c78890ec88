// SPDX-License-Identifier: Apache-2.0
// The techniques (s, t) of bidirectional path tracing one by one, each as an image before and after its weights: what
// finds which light, and where.
#pragma once

#include <vector>

#include "film/film.h"
#include "passes/render_pass.h"

namespace covary {

/// What one technique adds to the image.
struct TechniqueImage {
  int s = 0, t = 0;  ///< vertices from the light and from the camera
  Image weighted;    ///< all of these add up to the image, up to the length of paths below
  Image unweighted;  ///< the technique alone; dark where it cannot find the light
};

/// Longest paths that are shown, in edges.
inline constexpr int kTechniqueEdges = 6;

/// Whether render_techniques() can take the integrator.
bool has_techniques(const Integrator& integrator);

/// All techniques for paths of up to kTechniqueEdges edges that found something, ordered by length, then s. Reads
/// settings.spp (its largest number), sampling, seed, pass, filter and stop; light paths as many as the
/// integrator has for these samples, in whole bundles. `window`: the pixels rendered, which are those of the images.
/// Throws Error(kUsage) where `integrator` is not bidirectional.
std::vector<TechniqueImage> render_techniques(const Scene& scene, const Integrator& integrator,
                                              const PassSettings& settings, const CropWindow& window);

}  // namespace covary
