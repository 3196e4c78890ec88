// SPDX-License-Identifier: Apache-2.0
// `bdpt`: bidirectional path tracing (bidirectional_tracer.h).
#include "integrators/bidirectional_tracer.h"

namespace covary {

std::shared_ptr<Integrator> make_bdpt(Settings& settings, const PathLengthSettings& lengths) {
  BidirectionalSettings own;
  own.lengths = lengths;
  settings.group("Integrator bdpt", OptionEffect::kSamples);
  declare(settings, own.light_tracing);
  return std::make_shared<BidirectionalTracer<BidirectionalParts>>(own);
}

}  // namespace covary
