// SPDX-License-Identifier: Apache-2.0
// What `guided-path` knows at a surface.
#pragma once

#include <optional>

#include "integrators/guided_path.h"
#include "passes/training.h"

namespace covary {

/// Probes the first surface along `ray`; nothing where there is none. The images are 2 `height` wide. Each pixel of the
/// radiance is the mean of `spp` samples of the trained integrator. The number of threads changes no bit.
std::optional<GuideProbe> probe_guide(const Scene& scene, const GuidedPath& integrator, Ray ray, int height,
                                      uint32_t spp, uint64_t seed);

}  // namespace covary
