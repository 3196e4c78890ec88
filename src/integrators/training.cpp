// SPDX-License-Identifier: Apache-2.0
#include "integrators/training.h"

#include "core/content_hash.h"

namespace covary {

void LearningIntegrator::restart() {
  on_restart();
  trained_spp_ = 0;
  frozen_ = false;
}

void LearningIntegrator::end_wave(uint32_t spp) {
  COVARY_CHECK(!frozen_, "a frozen integrator cannot learn");
  update();
  trained_spp_ = spp;
}

void LearningIntegrator::freeze() {
  on_freeze();
  hash_ = state_hash();
  frozen_ = true;
}

std::string LearningIntegrator::description() const {
  return settings_text() + (frozen_ ? " training=" + hash_text(hash_) : " untrained");
}

bool train(const Scene& scene, LearningIntegrator& integrator, const TrainingSettings& settings) {
  integrator.restart();
  if (integrator.training_spp() > 0) {
    PassSettings pass;
    pass.seed = integrator.training_seed(), pass.pass = kTrainingPass, pass.spp = integrator.training_spp();
    pass.filter = settings.filter, pass.stop = settings.stop, pass.progress = settings.progress;
    pass.learner = &integrator;
    Film film(scene.camera().width(), scene.camera().height(), settings.window, 1);
    std::vector<Spectrum> importance;
    pass.checkpoint = [&] {
      if (!settings.importance || integrator.trained_spp() != integrator.pilot_spp()) return;
      importance = settings.importance(film);
      pass.importance = importance;
    };
    render_pass(scene, integrator, pass, film);
    if (integrator.trained_spp() != integrator.training_spp()) return false;
  }
  integrator.freeze();
  return true;
}

}  // namespace covary
