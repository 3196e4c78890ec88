// SPDX-License-Identifier: Apache-2.0
#include "passes/direct_light.h"

#include <algorithm>
#include <functional>

#include "core/error.h"

namespace covary {

void trace_direct_light(const Scene& scene, const Integrator& direct_light, const PassSettings& settings,
                        const Film& film, Film& direct) {
  PassSettings same = settings;
  same.spp = SampleTarget(film.counts());
  same.limit = UINT32_MAX;
  same.seconds = 0;
  same.checkpoint = nullptr;
  render_pass(scene, direct_light, same, direct);
}

Film indirect_light(const Film& film, const Film& direct) {
  COVARY_CHECK(film.counts() == direct.counts() && film.groups() == direct.groups(), "both hold the same samples");
  Film result = film;
  std::transform(film.data().begin(), film.data().end(), direct.data().begin(), result.data().begin(), std::minus<>());
  return result;
}

}  // namespace covary
