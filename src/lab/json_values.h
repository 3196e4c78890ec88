// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

#include "lab/suite.h"

namespace covary::lab {

/// JSON has no NaN and no infinity: null.
inline nlohmann::ordered_json json_number(double value) {
  if (!std::isfinite(value)) return nullptr;
  return value;
}

inline nlohmann::ordered_json json_of(const Budget& budget) {
  if (budget.spp) return {{"spp", budget.spp}};
  return {{"seconds", budget.seconds}};
}

}  // namespace covary::lab
