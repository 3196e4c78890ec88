// SPDX-License-Identifier: Apache-2.0
#include "passes/path_length_images.h"

#include <algorithm>

#include "core/error.h"
#include "passes/sample_parts.h"

namespace covary {

std::vector<Image> path_length_images(const Scene& scene, const Integrator& integrator, const PassSettings& settings,
                                      const Film& film) {
  if (!integrator.longest_path())
    throw Error(ErrorCode::kUsage, "the integrator has no images by the number of edges; controlled-path has");
  const auto n = static_cast<size_t>(std::clamp(*integrator.longest_path(), 0, kMostEdges));
  std::vector<Film> parts = films_of_parts(film, n, 1);
  trace_parts(scene, integrator, settings, film, parts);
  std::vector<Image> images;
  if (settings.stop && settings.stop->load(std::memory_order_relaxed)) return images;
  for (const Film& part : parts) images.push_back(part.mean_image());
  return images;
}

}  // namespace covary
