// SPDX-License-Identifier: Apache-2.0
#include "passes/path_length_images.h"

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {
namespace {

constexpr uint32_t kBatch = 256;  // samples of a pixel traced together

/// One thread's.
struct Worker {
  explicit Worker(const Integrator& integrator) : context(integrator) {}
  PathContext context;
  std::vector<CameraSample> samples;
  std::vector<double> sums;  // RGB of each length
};

class PathLengths {
 public:
  PathLengths(const Scene& scene, const Integrator& integrator, const PassSettings& settings, const Film& film)
      : scene_(scene), integrator_(integrator), settings_(settings), film_(film) {
    const auto n = static_cast<size_t>(std::clamp(*integrator.longest_path(), 0, kMostEdges));
    images_.assign(n, Image(film.width(), film.height(), 3));
  }

  std::vector<Image> render() {
    PerThread<Worker> workers;
    parallel_for(film_.height(), [&](int y) {
      for (int x = 0; x < film_.width() && !stopped(); ++x) trace_pixel(x, y, workers.local(integrator_));
    });
    if (stopped()) images_.clear();
    return std::move(images_);
  }

 private:
  bool stopped() const { return settings_.stop && settings_.stop->load(std::memory_order_relaxed); }

  void trace_pixel(int x, int y, Worker& worker) {
    RadianceByLength& by_length = worker.context.by_length;
    worker.context.stop = settings_.stop;
    by_length.n_lengths = images_.size();
    worker.sums.assign(3 * images_.size(), 0);
    const uint32_t n = film_.count(x, y);
    for (uint32_t first = 0; first < n; first += kBatch) {
      worker.samples.clear();
      for (uint32_t s = first; s < std::min(n, first + kBatch); ++s)
        worker.samples.push_back(camera_sample(scene_, settings_, film_.crop().x + x, film_.crop().y + y, s));
      integrator_.trace(scene_, worker.samples, worker.context);
      if (stopped()) return;
      for (size_t s = 0; s < worker.samples.size(); ++s) {
        if (!is_finite(worker.samples[s].radiance)) continue;  // black in the film, too
        for (size_t i = 0; i < images_.size(); ++i)
          for (int c = 0; c < 3; ++c)
            worker.sums[3 * i + static_cast<size_t>(c)] += by_length.radiance[s * images_.size() + i][c];
      }
    }
    for (size_t i = 0; n > 0 && i < images_.size(); ++i)
      for (size_t c = 0; c < 3; ++c) images_[i].pixel(x, y)[c] = static_cast<float>(worker.sums[3 * i + c] / n);
  }

  const Scene& scene_;
  const Integrator& integrator_;
  const PassSettings& settings_;
  const Film& film_;
  std::vector<Image> images_;
};

}  // namespace

std::vector<Image> path_length_images(const Scene& scene, const Integrator& integrator, const PassSettings& settings,
                                      const Film& film) {
  if (!integrator.longest_path())
    throw Error(ErrorCode::kUsage, "the integrator has no images by the number of edges; controlled-path has");
  return PathLengths(scene, integrator, settings, film).render();
}

}  // namespace covary
