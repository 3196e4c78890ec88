// SPDX-License-Identifier: Apache-2.0
#include "passes/sample_parts.h"

#include <algorithm>
#include <functional>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {
namespace {

constexpr size_t kBatch = 256;  // samples traced together

/// Per-thread state.
struct Worker {
  explicit Worker(const Integrator& integrator) : context(integrator) {}
  PathContext context;
  std::vector<CameraSample> samples;
  std::vector<int> pixels;  // of these samples, in the row
};

class PartTracer {
 public:
  PartTracer(const Scene& scene, const Integrator& integrator, const PassSettings& settings, const Film& film,
             std::span<Film> parts)
      : scene_(scene), integrator_(integrator), settings_(settings), film_(film), parts_(parts) {}

  void trace() {
    PerThread<Worker> workers;
    parallel_for(film_.height(), [&](int y) { trace_row(y, workers.local(integrator_)); });
  }

 private:
  bool stopped() const { return settings_.stop && settings_.stop->load(std::memory_order_relaxed); }

  void trace_row(int y, Worker& worker) {
    worker.context.stop = settings_.stop;
    for (int x = 0; x < film_.width(); ++x)
      for (uint32_t s = parts_[0].count(x, y), n = film_.count(x, y); s < n && !stopped(); ++s) {
        worker.samples.push_back(camera_sample(scene_, settings_, film_.crop().x + x, film_.crop().y + y, s));
        worker.pixels.push_back(x);
        if (worker.samples.size() == kBatch) trace_batch(y, worker);
      }
    trace_batch(y, worker);
  }

  void trace_batch(int y, Worker& worker) {
    worker.context.by_part.n_parts = parts_.size();
    if (!stopped() && !worker.samples.empty()) integrator_.trace(scene_, worker.samples, worker.context);
    for (size_t s = 0; s < worker.samples.size() && !stopped(); ++s) {
      const float weight =
          enters(worker.samples[s].radiance) ? film_weight(settings_.filter, worker.samples[s].random) : 0;
      for (size_t i = 0; i < parts_.size(); ++i) {
        const Spectrum& part = worker.context.by_part.radiance[s * parts_.size() + i];
        parts_[i].add(worker.pixels[s], y, weight != 0 ? scene_.on_film(part) * weight : Spectrum());
      }
    }
    worker.samples.clear(), worker.pixels.clear();
  }

  bool enters(const Spectrum& value) const {
    return is_finite(value) && ((value.r >= 0 && value.g >= 0 && value.b >= 0) || integrator_.allows_negative());
  }

  const Scene& scene_;
  const Integrator& integrator_;
  const PassSettings& settings_;
  const Film& film_;
  const std::span<Film> parts_;
};

}  // namespace

void trace_parts(const Scene& scene, const Integrator& integrator, const PassSettings& settings, const Film& film,
                 std::span<Film> parts) {
  if (!parts.empty()) PartTracer(scene, integrator, settings, film, parts).trace();
}

std::vector<Film> films_of_parts(const Film& film, size_t n_parts, int groups) {
  return std::vector(n_parts, Film(film.frame_width(), film.frame_height(), film.crop(), groups));
}

std::vector<std::string> light_groups(const Scene& scene) {
  std::vector<std::string> groups;
  for (const auto& light : scene.emitters())
    if (!light->group().empty() && std::find(groups.begin(), groups.end(), light->group()) == groups.end())
      groups.push_back(light->group());
  return groups;
}

void trace_direct_light(const Scene& scene, const Integrator& direct_light, const PassSettings& settings,
                        const Film& film, Film& direct) {
  PassSettings same = settings;
  same.spp = SampleTarget(film.counts());
  same.limit = UINT32_MAX;
  same.seconds = 0;
  same.checkpoint = nullptr;
  render_pass(scene, direct_light, same, direct);
}

Film indirect_light(const Film& film, const Film& direct) {
  COVARY_CHECK(film.counts() == direct.counts() && film.groups() == direct.groups(), "both hold the same samples");
  Film result = film;
  std::transform(film.data().begin(), film.data().end(), direct.data().begin(), result.data().begin(), std::minus<>());
  return result;
}

std::vector<Image> path_length_images(const Scene& scene, const Integrator& integrator, const PassSettings& settings,
                                      const Film& film) {
  if (!integrator.longest_path())
    throw Error(ErrorCode::kUsage, "the integrator has no images for each path length; controlled-path has");
  const auto n = static_cast<size_t>(std::clamp(*integrator.longest_path(), 0, kMaxEdges));
  std::vector<Film> parts = films_of_parts(film, n, 1);
  trace_parts(scene, integrator, settings, film, parts);
  std::vector<Image> images;
  if (settings.stop && settings.stop->load(std::memory_order_relaxed)) return images;
  for (const Film& part : parts) images.push_back(part.mean_image());
  return images;
}

}  // namespace covary
