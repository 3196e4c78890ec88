// SPDX-License-Identifier: Apache-2.0
// One line per integrator.
#include "integrators/integrator.h"

namespace covary {

std::shared_ptr<Integrator> make_bdpt(Parameters&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_controlled_path(Parameters&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_guided_path(Parameters&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_path(Parameters&, const PathLengthSettings&);

std::span<const IntegratorPlugin> integrator_plugins() {
  static constexpr IntegratorPlugin kPlugins[] = {
      {"bdpt", make_bdpt},
      {"controlled-path", make_controlled_path},
      {"guided-path", make_guided_path},
      {"path", make_path},
  };
  return kPlugins;
}

PathLengthSettings PathLengthSettings::from(Parameters& parameters) {
  PathLengthSettings lengths;
  const int max_depth = parameters.get_int("max_depth", -1, -1, kUnlimited);
  lengths.max_depth = max_depth < 0 ? kUnlimited : max_depth;
  lengths.rr_depth = parameters.get_int("rr_depth", 5, 1, kUnlimited);
  lengths.hide_emitters = parameters.get_bool("hide_emitters", false);
  return lengths;
}

std::string PathLengthSettings::text() const {
  const auto number = [](int depth) { return depth == kUnlimited ? std::string("unlimited") : std::to_string(depth); };
  return "min_depth=" + number(min_depth) + " max_depth=" + number(max_depth) + " rr_depth=" + number(rr_depth) +
         " hide_emitters=" + (hide_emitters ? "true" : "false");
}

}  // namespace covary
