// SPDX-License-Identifier: Apache-2.0
#include "filters/mixture_weights.h"

#include <array>

namespace covary {

using namespace lanes;

namespace {

/// Ridge of the normal equations, relative to their mean diagonal.
constexpr float kRidge = 1e-3f;
/// Sweeps over all pairs of candidates; more sweeps change weights by less than 0.01 (mixture_test).
constexpr int kSweeps = 24;

}  // namespace

/// By exact line search along the edge between each pair of candidates. The base image, number m, has zero rows.
void solve_mixture(int m, const vfloat* sums, const float* prior, float strength, vfloat* x) {
  std::array<std::array<vfloat, kMaxCandidates>, kMaxCandidates> a;
  std::array<vfloat, kMaxCandidates> b;
  int plane = 0;
  for (int p = 0; p < m; ++p)
    for (int q = p; q < m; ++q, ++plane) a[p][q] = a[q][p] = sums[plane];
  for (int p = 0; p < m; ++p, ++plane) b[p] = sums[plane];
  vfloat ridge = {};
  for (int p = 0; p < m; ++p) ridge += max(a[p][p], vfloat{});
  ridge = (ridge * kRidge + sums[plane] * strength) / static_cast<float>(m) + 1e-30f;
  for (int p = 0; p < m; ++p) {
    a[p][p] += ridge;
    if (prior) b[p] += ridge * prior[p];
  }
  std::array<vfloat, kMaxCandidates + 1> gradient;
  for (int p = 0; p < m; ++p) {
    x[p] = splat(1.0f / static_cast<float>(m + 1));
    gradient[p] = -b[p];
    for (int q = 0; q < m; ++q) gradient[p] += a[p][q] * (1.0f / static_cast<float>(m + 1));
  }
  x[m] = splat(1.0f / static_cast<float>(m + 1));
  gradient[m] = vfloat{};
  const auto element = [&](int p, int q) { return p < m && q < m ? a[p][q] : vfloat{}; };
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int p = 0; p < m; ++p)
      for (int q = p + 1; q <= m; ++q) {
        // Moves weight `step` from q to p; along a non-convex edge, to its better end.
        const vfloat curvature = element(p, p) + element(q, q) - 2 * element(p, q);
        const vfloat slope = gradient[q] - gradient[p];
        const vfloat wanted =
            curvature > ridge ? slope / max(curvature, ridge) : (slope > 0.0f ? splat(1.0f) : splat(-1.0f));
        const vfloat step = min(max(wanted, -x[p]), x[q]);
        x[p] += step;
        x[q] -= step;
        for (int i = 0; i < m; ++i) gradient[i] = fma(step, element(i, p) - element(i, q), gradient[i]);
      }
}

}  // namespace covary
