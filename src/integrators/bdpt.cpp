// SPDX-License-Identifier: Apache-2.0
// `bdpt`: bidirectional path tracing (bidirectional_tracer.h).
#include "integrators/bidirectional_tracer.h"

namespace covary {

std::shared_ptr<Integrator> make_bdpt(Settings& settings, const PathLengthSettings& lengths) {
  static constexpr std::pair<const char*, Heuristic> kHeuristics[] = {{"power", Heuristic::kPower},
                                                                      {"balance", Heuristic::kBalance}};
  BidirectionalSettings own;
  own.lengths = lengths;
  settings.group("Integrator bdpt", OptionEffect::kSamples);
  declare(settings, own.light_tracing);
  settings.choice("heuristic", own.heuristic, kHeuristics, "MIS heuristic: power (exponent 2), or balance");
  return std::make_shared<BidirectionalTracer<BidirectionalParts>>(own);
}

}  // namespace covary
