// SPDX-License-Identifier: Apache-2.0
// Multiple importance sampling weights [Veach1997] §9.2, for two techniques that sample the same direction. Densities
// are in the same measure and include the probability of choosing the technique. That of the technique that took the
// sample is positive and finite; the other may be 0, if it cannot take the sample, or so large that its square
// overflows float.
#pragma once

#include <cmath>

namespace covary::mis {

/// Balance heuristic for a sample from the technique with density `a` against one with density `b`: a / (a + b).
inline float balance(float a, float b) { return 1 / (1 + b / a); }

/// Power heuristic with exponent 2, a² / (a² + b²). An overflowing square gives the limit 0.
inline float power(float a, float b) {
  const float r = b / a;
  return 1 / (1 + r * r);
}

/// power(a, b) / a with one division, in double precision because squares of densities exceed the range of float.
inline float power_over_pdf(float a, float b) {
  const double x = a, y = b;
  return static_cast<float>(x / (x * x + y * y));
}

}  // namespace covary::mis
