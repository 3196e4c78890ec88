// SPDX-License-Identifier: Apache-2.0
#include "estimators/own_noise.h"

#include <array>

#include "core/parallel.h"
#include "film/groups.h"

namespace covary {
namespace {

/// Sums over the groups of a pixel of the weighted products of their deviations d from its mean.
struct Products {
  std::array<std::array<float, 3>, 3> pairs{};    ///< [c'][c]: d_c' d_c
  std::array<std::array<float, 3>, 3> triples{};  ///< [c'][c]: d_c'^2 d_c
};

Products products_at(const GroupedImage& image, const Moments& h, int x, int y) {
  const float* p = image.pixel(x, y);
  const auto count = static_cast<float>(image.count(x, y));
  Products sums;
  for (int t = 0; t < image.groups; ++t, p += 3) {
    const float weight = static_cast<float>(group_size(image.count(x, y), image.groups, t)) / count;
    float d[3];
    for (int c = 0; c < 3; ++c) d[c] = p[c] - h.mean.row(c, y)[x];
    for (int other = 0; other < 3; ++other)
      for (int c = 0; c < 3; ++c) {
        const float pair = weight * d[other] * d[c];
        sums.pairs[other][c] += pair, sums.triples[other][c] += d[other] * pair;
      }
  }
  return sums;
}

}  // namespace

OwnChanges own_changes(const GroupedImage& independent, const Moments& h, const Planes* slope, int groups, bool shared,
                       const std::vector<unsigned char>& valid) {
  const int width = independent.width, height = independent.height, n = independent.groups;
  OwnChanges changes{Planes(width, height, 3, 0, 0), Planes(width, height, 3, 0, 0)};
  if (n < 3) return changes;
  const float of_pairs = static_cast<float>(groups) / static_cast<float>(n - 1),
              of_triples = of_pairs / static_cast<float>(n - 2);
  parallel_for(height, 8, [&](int y) {
    for (int x = 0; x < width; ++x) {
      if (!valid[static_cast<size_t>(y) * width + x]) continue;
      const Products sums = products_at(independent, h, x, y);
      for (int c = 0; c < 3; ++c) {
        float error = 0, variance = 0;
        for (int other = shared ? 0 : c; other < (shared ? 3 : c + 1); ++other) {
          variance += of_triples * sums.triples[other][c];
          if (slope) error += of_pairs * slope->row(other, y)[x] * sums.pairs[other][c];
        }
        changes.errors.row(c, y)[x] = slope ? error : 0.5f * variance;
        changes.variances.row(c, y)[x] = variance;
      }
    }
  });
  return changes;
}

}  // namespace covary
