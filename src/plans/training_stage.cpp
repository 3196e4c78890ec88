// SPDX-License-Identifier: Apache-2.0
#include "plans/training_stage.h"

#include <cmath>
#include <optional>

#include "core/stop.h"
#include "core/stopwatch.h"
#include "denoising/denoise.h"
#include "plans/pixel_importance.h"
#include "plans/training_file.h"

namespace covary {

bool train(const LoadedScene& scene, const RenderRequest& request, Integrator& integrator, TrainingSettings settings,
           RenderSeconds& seconds) {
  const Stopwatch watch;
  LearningIntegrator* learning = integrator.learning();
  settings.seed = request.seed;
  const bool by_oidn = learning && learning->pilot_by_oidn();
  if (by_oidn && request.load_training.empty()) denoiser_info({request.oidn});  // throws before rendering
  settings.importance = [&, by_oidn](const Film& film) {
    const Stopwatch surrogate;
    const std::optional<DenoiseOptions> oidn = by_oidn ? std::optional(DenoiseOptions{request.oidn}) : std::nullopt;
    std::vector<Spectrum> importance = pixel_importance(*scene.scene, settings.filter, film, oidn, settings.stop);
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

}  // namespace covary
