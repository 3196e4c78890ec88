// SPDX-License-Identifier: Apache-2.0
#include "plans/training_stage.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>

#include "core/error.h"
#include "core/stop.h"
#include "core/stopwatch.h"
#include "denoising/denoise.h"
#include "filters/joint_bilateral.h"
#include "imageio/output_file.h"
#include "integrators/aov.h"
#include "passes/training.h"
#include "sampling/training_bytes.h"

namespace covary {

bool train(const LoadedScene& scene, const RenderRequest& request, Integrator& integrator, TrainingSettings settings,
           RenderSeconds& seconds) {
  const Stopwatch watch;
  LearningIntegrator* learning = integrator.learning();
  settings.seed = request.seed;
  const bool by_oidn = learning && learning->pilot_by_oidn();
  if (by_oidn && request.load_training.empty()) denoiser_info({request.oidn});  // throws before rendering starts
  settings.importance = [&, by_oidn, features = PixelFeatures()](const Film& film) mutable {
    const Stopwatch surrogate;
    if (features.empty()) features = pixel_features(*scene.scene, settings.filter, film, settings.stop);
    const std::optional<DenoiseOptions> oidn = by_oidn ? std::optional(DenoiseOptions{request.oidn}) : std::nullopt;
    std::vector<Spectrum> importance = pixel_importance(features, film, oidn);
    seconds.surrogate += surrogate.seconds();
    return importance;
  };
  if (!request.load_training.empty()) load_training(scene.content_hash, integrator, request.load_training);
  bool trained = !learning;
  const bool whole =
      run_stoppable(settings.stop, [&] { trained = trained || train(*scene.scene, *learning, settings); });
  if (!whole || !trained) return false;
  if (!request.save_training.empty()) save_training(scene.content_hash, integrator, request.save_training);
  seconds.train = watch.seconds();
  if (learning) seconds.solve = learning->update_seconds();
  return true;
}

void add_training(const Film& film, const TrainingImage& training, int first_row, EstimatorResult& image) {
  for (int y = 0; y < image.std_error.height; ++y)
    for (int x = 0; x < image.std_error.width; ++x) {
      const double n = film.count(x, first_row + y), all = n + training.samples_at(x, first_row + y);
      for (int c = 0; c < 3; ++c) image.std_error.pixel(x, y)[c] *= static_cast<float>(std::sqrt(n / all));
    }
}

PixelFeatures pixel_features(const Scene& scene, const FilterSettings& filter, const Film& film,
                             const std::atomic<bool>* stop) {
  constexpr uint32_t kFeatureSamples = 2;
  PassSettings settings;
  settings.pass = kTrainingPass, settings.filter = filter;
  Film features(film.frame_width(), film.frame_height(), film.crop(), 1);
  render_aovs(scene, settings, kFeatureSamples, features, stop);
  if (!features.aovs.contains("N")) return {};
  return {std::move(features.aovs.at("Albedo")), std::move(features.aovs.at("N"))};
}

std::vector<Spectrum> pixel_importance(const PixelFeatures& features, const Film& film,
                                       const std::optional<DenoiseOptions>& oidn) {
  constexpr float kSmallest = 0.01f;  // as in relMSE
  if (features.empty()) return {};
  const Image value = oidn ? denoise(film.mean_image(), &features.albedo, &features.normal, *oidn)
                           : joint_bilateral(film.mean_image(), features.albedo, features.normal);
  std::vector<Spectrum> importance;
  for (int y = 0; y < value.height; ++y)
    for (int x = 0; x < value.width; ++x) {
      Spectrum weight;
      for (int c = 0; c < 3; ++c) weight[c] = 1 / std::sqrt(sqr(std::max(value.pixel(x, y)[c], 0.0f)) + kSmallest);
      importance.push_back(weight);
    }
  return importance;
}

namespace {

/// The integrator, if its training can be saved; otherwise throws.
template <typename Learning>
Learning& keeper(Learning* learning) {
  if (!learning || !learning->keeps_training())
    throw Error(ErrorCode::kUsage,
                "only the integrator controlled-path with control variates and guided-path keep a training file");
  return *learning;
}

/// Identifies what the training depends on.
std::string key(const std::string& scene_hash, const LearningIntegrator& integrator) {
  return scene_hash + "; " + integrator.settings_text();
}

}  // namespace

void save_training(const std::string& scene_hash, const Integrator& integrator, const std::string& path) {
  const LearningIntegrator& learnt = keeper(integrator.learning());
  write_text_file(path, training_file_bytes(key(scene_hash, learnt), learnt.trained_bytes()));
}

void load_training(const std::string& scene_hash, Integrator& integrator, const std::string& path) {
  LearningIntegrator& learning = keeper(integrator.learning());
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  if (file) content << file.rdbuf();
  if (!file || !content)
    throw Error(ErrorCode::kIo, "cannot read the training file '" + path + "': " + std::strerror(errno));
  const std::string bytes = content.str();
  learning.use_bytes(training_file_body(bytes, key(scene_hash, learning), path), path);
}

}  // namespace covary
