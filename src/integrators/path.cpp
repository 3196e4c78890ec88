// SPDX-License-Identifier: Apache-2.0
// `path`: path tracing (path_tracer.h) with uniform light selection, the power heuristic and BSDF sampling.
#include "integrators/path_tracer.h"

namespace covary {

std::shared_ptr<Integrator> make_path(Settings&, const PathLengthSettings& lengths) {
  return std::make_shared<PathTracer<PathParts>>("path", lengths);
}

}  // namespace covary
