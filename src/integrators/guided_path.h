// SPDX-License-Identifier: Apache-2.0
// `guided-path`: path tracing that learns the incident light and samples it [Ruppert2020]. guided_tracer.h has the
// estimator, sampling/guiding_field.h the learning.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "integrators/control_settings.h"
#include "integrators/guided_batch.h"
#include "integrators/guided_tracer.h"
#include "passes/training.h"
#include "sampling/guiding_field.h"
#include "sampling/light_set.h"
#include "settings/settings.h"

namespace covary {

struct GuideSettings {
  static constexpr uint32_t kMaxTrainingSpp = 1u << 16;
  static constexpr uint32_t kMinLeafSamples = 200, kMaxLeafSamples = 1u << 22;

  uint32_t leaf_samples = GuidingSettings().leaf_samples;  ///< a leaf with more is split; at least kMinLeafSamples
  uint32_t train_spp = 16;                                 ///< samples per pixel to learn from
  float fraction = 0.5f;                                   ///< of guided directions, in (0, 1)
  bool nee = true;                                         ///< light samples (next-event estimation)
  ControlKind control = ControlKind::kOff;                 ///< control variates on the lobes: kOff, kRgb or kMono
  uint32_t control_train_spp = 32;  ///< samples per pixel to learn their coefficients from, after the lobes

  bool controlled() const { return control != ControlKind::kOff; }
  /// Samples per pixel of the training.
  uint32_t training_spp() const { return train_spp + (controlled() ? control_train_spp : 0); }
  CacheSettings cache() const;

  GuidingSettings field() const;
};

inline void declare(Settings& s, GuideSettings& v) {
  static constexpr std::pair<const char*, ControlKind> kControls[] = {
      {"rgb", ControlKind::kRgb}, {"mono", ControlKind::kMono}, {"off", ControlKind::kOff}};
  s.group("Integrator guided-path", OptionEffect::kSamples);
  s.whole("guiding-leaf", v.leaf_samples,
          {.low = GuideSettings::kMinLeafSamples, .high = GuideSettings::kMaxLeafSamples},
          "Samples per leaf; leaves with more are split", {.film = "leaf={}"});
  s.whole("guiding-train", v.train_spp, {.low = 1, .high = GuideSettings::kMaxTrainingSpp},
          "Training samples per pixel, included in `spp`", {.film = "train={}"});
  s.on_off("nee", v.nee, "Next-event estimation (NEE) at each vertex", {.film = "nee={}"});
  s.choice("cv", v.control, kControls, "Control variates on the lobes", {.film = "cv={}"});
  s.whole("cv-train", v.control_train_spp, {.low = 1, .high = GuideSettings::kMaxTrainingSpp},
          "Training samples per pixel for their coefficients, after those for the lobes", {.film = "cv_train={}"});
  s.only_if(v.controlled(), {"cv-train"}, "without control variates (`cv` rgb or mono)");
}

class GuidedPath : public LearningIntegrator {
 public:
  GuidedPath(const PathLengthSettings& lengths, const GuideSettings& settings)
      : lengths_(lengths), settings_(settings), field_(settings.field()) {}

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<GuidedPath>(lengths_, settings_); }
  const GuideSettings& settings() const { return settings_; }
  /// The field learnt so far, or given.
  const GuidingField& field() const { return given_ ? *given_ : field_; }
  /// The control-variate coefficients learnt so far, or given.
  const CoefficientTable& table() const { return given_table_ ? *given_table_ : cache_.table(); }
  /// What paths are traced with; valid after prepare().
  const GuidedScene& guided() const { return guided_; }
  std::string settings_text() const override;

  void prepare(const Scene& scene) override;
  std::unique_ptr<ThreadState> make_thread_state() const override { return std::make_unique<GuidedBatch>(); }
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    trace_with<GuidedParts>(scene, samples, context);
  }
  /// 0 if a field was given.
  uint32_t training_spp() const override { return given_ ? 0 : settings_.training_spp(); }
  size_t training_memory() const override { return field_.training_memory(); }
  std::unique_ptr<TrainingRecord> take_record(ThreadState& state) const override;
  void absorb(const TrainingRecord& record) override;
  bool keeps_training() const override { return true; }
  std::string trained_bytes() const override;
  void use_bytes(std::string_view bytes, const std::string& where) override;
  bool allows_negative() const override { return settings_.controlled(); }
  std::vector<std::string> blind_spots(const Scene& scene) const override;
  IntegratorReport report() const override;
  bool learns_directions() const override { return true; }
  std::optional<GuideProbe> probe(const Scene& scene, const Ray& ray, int height, uint32_t spp,
                                  uint64_t seed) const override;

 protected:
  template <typename Parts>
  void trace_with(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const {
    begin_batch(context.state_as<GuidedBatch>());
    GuidedTracer<Parts>(scene, guided_, lengths_, samples, context).trace();
  }

  void on_restart() override { field_.restart(), cache_.restart(); }
  void update() override;
  void on_freeze() override;
  uint64_t state_hash() const override;

 private:
  /// Waves that begin before this many samples train the field; later ones, if any, the control.
  bool learns_field() const { return trained_spp() < settings_.train_spp; }
  void begin_batch(GuidedBatch& batch) const;

  PathLengthSettings lengths_;
  GuideSettings settings_;
  const Scene* scene_ = nullptr;  // as passed to prepare()
  LightSet lights_;
  LightClusters clusters_;
  std::shared_ptr<const Emitter> compensated_;  // the environment as sampled, if that is not the scene's own
  GuidingField field_;
  std::optional<GuidingField> given_;
  CoefficientCache cache_;
  std::optional<CoefficientTable> given_table_;
  GuidedScene guided_{};
  size_t training_bytes_ = 0;  // of samples and mixtures at the end of the training
};

}  // namespace covary
