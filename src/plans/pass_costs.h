// SPDX-License-Identifier: Apache-2.0
// What the samples of a kept film cost: the text of the JSON file beside it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace covary {

struct PassCosts {
  uint64_t samples = 0, rays = 0;
  double seconds = 0;           ///< of rendering
  double estimate_seconds = 0;  ///< part of `seconds`: what fitting took; 0 where a pass only renders
};

/// Throws Error(kInput) where the text is not such a JSON object, or a value cannot be right.
PassCosts parse_pass_costs(std::string_view text);

/// The text that parse_pass_costs() reads; without `estimate_seconds` where that is 0.
std::string to_text(const PassCosts& costs);

}  // namespace covary
