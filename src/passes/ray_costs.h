// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <vector>

#include "film/film.h"
#include "passes/integrator.h"
#include "passes/render_pass.h"

namespace covary {

/// Approximate rays per sample at each pixel of `film`, relative to their mean: from one sample in each cell of 4 x 4
/// pixels, averaged over 9 x 9 cells. Counting rays makes the results independent of the clock. `settings`: those of
/// the pass, whose number gives the samples their own random numbers. All 1 if `stop` (may be null) becomes true, or if
/// no rays are traced.
std::vector<double> ray_costs(const Scene& scene, const Integrator& integrator, const PassSettings& settings,
                              const Film& film, const std::atomic<bool>* stop);

}  // namespace covary
