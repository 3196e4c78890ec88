// SPDX-License-Identifier: Apache-2.0
#include "passes/ray_costs.h"

#include <algorithm>
#include <numeric>

#include "core/parallel.h"

namespace covary {
namespace {

constexpr int kCell = 4;    // side in pixels
constexpr int kRadius = 4;  // radius in cells of the average

}  // namespace

std::vector<double> ray_costs(const Scene& scene, const Integrator& integrator, const PassSettings& settings,
                              const Film& film, const std::atomic<bool>* stop) {
  const int width = film.width(), height = film.height();
  const int columns = (width + kCell - 1) / kCell, rows = (height + kCell - 1) / kCell;
  std::vector<double> rays(static_cast<size_t>(columns) * rows);
  parallel_for(rows, [&](int j) {
    for (int i = 0; i < columns && !(stop && stop->load()); ++i) {
      const int x = std::min(kCell * i + kCell / 2, width - 1), y = std::min(kCell * j + kCell / 2, height - 1);
      rays[static_cast<size_t>(j) * columns + i] = static_cast<double>(
          replay_sample(scene, integrator, settings, film.crop().x + x, film.crop().y + y, 0).n_rays);
    }
  });
  std::vector<double> costs(static_cast<size_t>(width) * height, 1);
  const double mean = std::accumulate(rays.begin(), rays.end(), 0.0) / static_cast<double>(rays.size());
  if (!(mean > 0) || (stop && stop->load())) return costs;
  parallel_for(rows, [&](int j) {
    for (int i = 0; i < columns; ++i) {
      double sum = 0, n = 0;
      for (int b = std::max(0, j - kRadius); b <= std::min(rows - 1, j + kRadius); ++b)
        for (int a = std::max(0, i - kRadius); a <= std::min(columns - 1, i + kRadius); ++a)
          sum += rays[static_cast<size_t>(b) * columns + a], n += 1;
      for (int y = kCell * j; y < std::min(height, kCell * (j + 1)); ++y)
        for (int x = kCell * i; x < std::min(width, kCell * (i + 1)); ++x)
          costs[static_cast<size_t>(y) * width + x] = sum / n / mean;
    }
  });
  return costs;
}

}  // namespace covary
