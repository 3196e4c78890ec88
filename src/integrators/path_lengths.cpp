// SPDX-License-Identifier: Apache-2.0
#include "integrators/path_lengths.h"

namespace covary {

void declare(Settings& s, PathLengthSettings& v) {
  constexpr int kMax = 1 << 30;
  static const OptionTraits kOfScene{.level = OptionLevel::kScene};
  int max_depth = v.max_depth == PathLengthSettings::kUnlimited ? -1 : v.max_depth;
  s.group("Paths", OptionEffect::kSamples);
  s.whole("max-depth", max_depth, {.low = -1, .high = kMax},
          "Maximum path edges: 1 is visible emission, 2 direct light; -1: no limit", {.level = OptionLevel::kBasic});
  s.whole("min-depth", v.min_depth, {.low = 0, .high = kMax}, "Leave out paths with fewer edges than this", kOfScene);
  s.whole("rr-depth", v.rr_depth, {.low = 1, .high = kMax}, "Edges after which Russian roulette may end a path",
          kOfScene);
  s.on_off("hide-emitters", v.hide_emitters, "Show lights that the camera sees directly as black", kOfScene);
  v.max_depth = max_depth < 0 ? PathLengthSettings::kUnlimited : max_depth;
}

std::string PathLengthSettings::text() const {
  const auto number = [](int depth) { return depth == kUnlimited ? std::string("unlimited") : std::to_string(depth); };
  return "min_depth=" + number(min_depth) + " max_depth=" + number(max_depth) + " rr_depth=" + number(rr_depth) +
         " hide_emitters=" + (hide_emitters ? "true" : "false");
}

}  // namespace covary
