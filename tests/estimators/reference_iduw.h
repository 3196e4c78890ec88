// SPDX-License-Identifier: Apache-2.0
// Input-dependent uncorrelated weighting (Back et al. 2023; estimators/iduw.h) as a plain double-precision loop.
#pragma once

#include "estimators/reference_control_variates.h"

namespace covary::reference {

inline int reflect(int i, int n) {
  if (n == 1) return 0;
  while (i < 0 || i >= n) i = i < 0 ? -i : 2 * (n - 1) - i;
  return i;
}

struct Iduw {
  const GroupedImage &crn, &independent;
  int window, samples;

  /// y + 1 / (W - 1) sum w ((z_c - z_i) - (y_c - y_i)) with the means y, z of the groups first, first + step, … and
  /// weights from the groups a, a + ab_step, … and b, b + ab_step, …
  double at(int x, int y, int c, double gamma, int first, int step, int a, int b, int ab_step) const {
    double sum = 0;
    for (int dy = -window / 2; dy <= window / 2; ++dy)
      for (int dx = -window / 2; dx <= window / 2; ++dx) {
        const int qx = reflect(x + dx, crn.width), qy = reflect(y + dy, crn.height);
        const auto change = [&](const GroupedImage& image, int t0, int s) {
          return mean(image, x, y, t0, s)[c] - mean(image, qx, qy, t0, s)[c];
        };
        const double d = change(crn, a, ab_step) - change(crn, b, ab_step);
        // The target pixel contributes zero.
        sum += std::exp(-gamma * samples * d * d) * (change(crn, first, step) - change(independent, first, step));
      }
    return mean(independent, x, y, first, step)[c] + sum / (window * window - 1);
  }
  double result(int x, int y, int c, double gamma) const { return at(x, y, c, gamma, 0, 1, 0, 1, 2); }
  double loss(double gamma) const {
    double total = 0;
    for (int y = 0; y < crn.height; ++y)
      for (int x = 0; x < crn.width; ++x)
        for (int c = 0; c < 3; ++c) {
          const double d = at(x, y, c, gamma, 0, 2, 0, 2, 4) - at(x, y, c, gamma, 1, 2, 1, 3, 4);
          double box = 0;
          for (int dy = -window / 2; dy <= window / 2; ++dy)
            for (int dx = -window / 2; dx <= window / 2; ++dx)
              box += mean(independent, reflect(x + dx, crn.width), reflect(y + dy, crn.height))[c] / (window * window);
          total += d * d / (box * box + 0.01) / (3.0 * crn.width * crn.height);
        }
    return total;
  }
};

}  // namespace covary::reference
