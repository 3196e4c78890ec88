// SPDX-License-Identifier: Apache-2.0
// Weights of multiple importance sampling [Veach1997] §9.2, for two techniques that sample the same direction.
// Densities are in one measure and include the probability that the technique was chosen. Those of the technique that
// took the sample are positive and finite; the other may be 0, where it cannot take it, or so large that its square
// leaves the range of float.
#pragma once

#include <cmath>

namespace covary::mis {

/// Balance heuristic for a sample of the technique of density `a` against one of density `b`: a / (a + b).
inline float balance(float a, float b) { return 1 / (1 + b / a); }

/// Power heuristic with exponent 2, a² / (a² + b²). A square that overflows gives the limit 0.
inline float power(float a, float b) {
  const float r = b / a;
  return 1 / (1 + r * r);
}

/// power(a, b) / a by one division, in double precision because squares of densities leave the range of float.
inline float power_over_pdf(float a, float b) {
  const double x = a, y = b;
  return static_cast<float>(x / (x * x + y * y));
}

}  // namespace covary::mis
