// SPDX-License-Identifier: Apache-2.0
#include "passes/training.h"

#include "core/content_hash.h"
#include "core/stopwatch.h"
#include "core/trigonometry.h"

namespace covary {

std::optional<GuideProbe> LearningIntegrator::probe(const Scene&, const Ray&, int, uint32_t, uint64_t) const {
  throw Error(ErrorCode::kInternal, "the integrator learns no functions of directions");
}

void LearningIntegrator::restart() {
  on_restart();
  trained_spp_ = 0, update_seconds_ = 0;
  frozen_ = false;
}

void LearningIntegrator::end_wave(uint32_t spp) {
  COVARY_CHECK(!frozen_, "a frozen integrator cannot learn");
  const Stopwatch watch;
  update();
  update_seconds_ += watch.seconds();
  trained_spp_ = spp;
}

void LearningIntegrator::freeze() {
  on_freeze();
  hash_ = state_hash();
  frozen_ = true;
}

std::string LearningIntegrator::description() const {
  return settings_text() + (frozen_ ? " training=" : " ") + training_text();
}

std::string LearningIntegrator::training_text() const { return frozen_ ? hash_text(hash_) : "untrained"; }

namespace {

/// Whether to compute the importance of pixels from the current image, for the remaining waves.
bool asks_for_importance(const LearningIntegrator& integrator) {
  const uint32_t now = integrator.trained_spp(), pilot = integrator.pilot_spp();
  return now == pilot || (pilot > 0 && now > pilot && now < integrator.training_spp() && integrator.pilot_goes_on());
}

}  // namespace

bool train(const Scene& scene, LearningIntegrator& integrator, const TrainingSettings& settings) {
  integrator.restart();
  if (integrator.training_spp() > 0) {
    PassSettings pass;
    pass.seed = settings.seed, pass.pass = kTrainingPass,
    pass.spp = one_in_each_square(settings.window, settings.stride, integrator.training_spp());
    pass.filter = settings.filter, pass.stop = settings.stop, pass.progress = settings.progress;
    pass.learner = &integrator;
    Film film(scene.camera().width(), scene.camera().height(), settings.window, settings.image ? 2 : 1);
    WaveCombination waves(integrator.wave_weights());
    std::vector<Spectrum> importance;
    const auto make_importance = [&] {
      importance = settings.importance(film);
      pass.importance = importance;
    };
    pass.checkpoint = [&] {
      const bool asks = settings.importance && asks_for_importance(integrator), first = importance.empty();
      if (asks && first) make_importance();
      // Except for the first, a wave's variance is weighted by an importance that does not depend on it.
      if (settings.image) waves.add(film, importance);
      if (asks && !first) make_importance();
    };
    render_pass(scene, integrator, pass, film);
    if (integrator.trained_spp() != integrator.training_spp()) return false;
    if (settings.image) *settings.image = waves.result();
  }
  integrator.freeze();
  return true;
}

Vec3 probe_direction(float x, float y) {
  const SinCos polar = sincos_turns(0.5f * y), turn = sincos_turns(x);
  return {polar.sin * turn.cos, polar.cos, polar.sin * turn.sin};
}

}  // namespace covary
