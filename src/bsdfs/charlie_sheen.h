// SPDX-License-Identifier: Apache-2.0
// Sheen of cloth [EstevezKulla2017], with the parameters of the extension KHR_materials_sheen: alpha = roughness^2.
#pragma once

#include "core/vec.h"

namespace covary {

class CharlieSheen {
 public:
  /// `roughness` in [0, 1]; at least 0.07 is used.
  explicit CharlieSheen(float roughness);
  /// The model of white sheen times the cosine of i; `o`, `i` above the surface, `h` half way between them.
  float eval(const Vec3& o, const Vec3& i, const Vec3& h) const;

 private:
  float lambda(float cosine) const;
  float fit(float x) const { return a_ / (1 + b_ * std::pow(x, c_)) + d_ * x + e_; }

  float inverse_alpha_, a_, b_, c_, d_, e_, half_;
};

/// Light that white sheen reflects towards the cosine `mu`, both in [0, 1]; at most 1. Within 0.005.
float charlie_albedo(float mu, float roughness);

}  // namespace covary
