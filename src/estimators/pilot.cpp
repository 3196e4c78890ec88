// SPDX-License-Identifier: Apache-2.0
#include "estimators/pilot.h"

#include "filters/window_sums.h"

namespace covary {
namespace {

using namespace lanes;

struct Rgb {
  vfloat r, g, b;
};

Rgb load_rgb(const Planes& p, int x, int y) {
  return {load(p.row(0, y) + x), load(p.row(1, y) + x), load(p.row(2, y) + x)};
}

/// Cross-bilateral mean, and the fraction of its weights that the pixel itself has.
struct GuidedMean {
  Rgb mean;
  vfloat own;
};

/// Mean of `image` around (x + lane, y), weighted by `counts` unless null.
template <bool kCounted>
GuidedMean guided_mean(const Moments& g, const Planes& image, const Planes* counts, int radius, int x, int y) {
  const Rgb variance = load_rgb(g.variance_of_mean, x, y), own = load_rgb(g.mean, x, y);
  const vfloat centre[3] = {own.r, own.g, own.b};
  vfloat weights = {};
  Rgb sum = {};
  // w_j of [YM2025] Eq. (11)
  add_alike({g.mean, 0, radius}, x, y, centre, variance.r + variance.g + variance.b, [&](vfloat w, int qx, int qy) {
    const Rgb v = load_rgb(image, qx, qy);
    if constexpr (kCounted) w *= load(counts->row(0, qy) + qx);
    weights += w;
    sum.r = fma(w, v.r, sum.r);
    sum.g = fma(w, v.g, sum.g);
    sum.b = fma(w, v.b, sum.b);
  });
  const vfloat inverse = 1.0f / weights;  // the pixel itself has weight 1, or its count
  GuidedMean result{{sum.r * inverse, sum.g * inverse, sum.b * inverse}, inverse};
  if constexpr (kCounted) result.own *= load(counts->row(0, y) + x);
  return result;
}

/// Stores the first n lanes of `values` at row y, from column x on.
void store_rgb(Planes& planes, int x, int y, int n, const Rgb& values) {
  const vfloat* v[3] = {&values.r, &values.g, &values.b};
  for (int c = 0; c < 3; ++c) {
    float* row = planes.row(c, y) + x;
    if (n == kLanes)
      store(row, *v[c]);
    else
      for (int l = 0; l < n; ++l) row[l] = (*v[c])[l];
  }
}

}  // namespace

Planes pilot_error(const Moments& g, const Moments& h, int window, int border, Planes* slope) {
  const int radius = window / 2, width = h.mean.width(), height = h.mean.height();
  const Planes* counts = h.relative_count ? &*h.relative_count : nullptr;
  Planes squares(width, height, 3, border, kUseless);
  for_each_batch(width, height, [&](int x, int y, int n) {
    const auto [pilot, own] = counts ? guided_mean<true>(g, h.mean, counts, radius, x, y)
                                     : guided_mean<false>(g, h.mean, nullptr, radius, x, y);
    const Rgb value = load_rgb(h.mean, x, y);
    const vfloat r = pilot.r - value.r, gg = pilot.g - value.g, b = pilot.b - value.b;
    // [YM2025] Eq. (11) without its factor n, which belongs to the groups (control_variates.h).
    store_rgb(squares, x, y, n, {r * r, gg * gg, b * b});
    const vfloat less = own - 1.0f;
    if (slope) store_rgb(*slope, x, y, n, {less * r, less * gg, less * b});
  });
  return squares;
}

}  // namespace covary
