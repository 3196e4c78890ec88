// SPDX-License-Identifier: Apache-2.0
// `path`: path tracing (path_tracer.h) with uniform light selection, the power heuristic and BSDF sampling.
//
// | parameter     | type    | default | meaning                                                    |
// |---------------|---------|---------|------------------------------------------------------------|
// | max_depth     | integer | -1      | largest number of path edges; -1: no limit                 |
// | rr_depth      | integer | 5       | number of edges after which roulette may end a path        |
// | hide_emitters | boolean | false   | lights are invisible to the camera                         |
#include "integrators/path_tracer.h"

namespace covary {

std::shared_ptr<Integrator> make_path(Parameters&, const PathLengthSettings& lengths) {
  return std::make_shared<PathTracer<PathParts>>("path", lengths);
}

}  // namespace covary
