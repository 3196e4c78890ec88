// SPDX-License-Identifier: Apache-2.0
// `bdpt`: bidirectional path tracing (bidirectional_tracer.h).
//
// | parameter     | type    | default | meaning                                                                    |
// |---------------|---------|---------|----------------------------------------------------------------------------|
// | max_depth     | integer | -1      | largest number of path edges; -1: no limit                                 |
// | rr_depth      | integer | 5       | number of edges after which roulette may end a subpath                     |
// | hide_emitters | boolean | false   | lights are invisible to the camera                                         |
// | heuristic     | string  | power   | weights of techniques: `power` (exponent 2) or `balance`                   |
// | light_tracing | string  | auto    | light paths joined to the lens, in a pass of their own: `on`, `off`,       |
// |               |         |         | `auto` (not beside a pass with common random numbers)                      |
// | light_paths   | float   | 1       | light paths of that pass for each camera sample                            |
#include "integrators/bidirectional_tracer.h"

namespace covary {

std::shared_ptr<Integrator> make_bdpt(Parameters& parameters, const PathLengthSettings& lengths) {
  BidirectionalSettings settings;
  settings.lengths = lengths;
  settings.light_tracing = LightTracingSettings::from(parameters);
  const std::string heuristic = parameters.get_choice("heuristic", "power", {"power", "balance"});
  settings.heuristic = heuristic == "balance" ? Heuristic::kBalance : Heuristic::kPower;
  return std::make_shared<BidirectionalTracer<BidirectionalParts>>(settings);
}

}  // namespace covary
