// SPDX-License-Identifier: Apache-2.0
// `guided-path`: path tracing that learns where light comes from and samples there [Ruppert2020]. guided_tracer.h has
// the estimator, sampling/guiding_field.h the learning.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "integrators/guide_settings.h"
#include "integrators/guided_batch.h"
#include "integrators/guided_tracer.h"
#include "passes/training.h"
#include "sampling/light_set.h"

namespace covary {

class GuidedPath : public LearningIntegrator {
 public:
  GuidedPath(const PathLengthSettings& lengths, const GuideSettings& settings)
      : lengths_(lengths), settings_(settings), field_(settings.field()) {}

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<GuidedPath>(lengths_, settings_); }
  const GuideSettings& settings() const { return settings_; }
  /// What was learnt so far, or given.
  const GuidingField& field() const { return given_ ? *given_ : field_; }
  /// Coefficients of control variates that were learnt so far, or given.
  const CoefficientTable& table() const { return given_table_ ? *given_table_ : cache_.table(); }
  /// What paths are traced with; after prepare().
  const GuidedScene& guided() const { return guided_; }
  std::string settings_text() const override;

  void prepare(const Scene& scene) override;
  std::unique_ptr<ThreadState> make_thread_state() const override { return std::make_unique<GuidedBatch>(); }
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    trace_with<GuidedParts>(scene, samples, context);
  }
  /// 0 once a field was given.
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
  /// Waves that begin with so many samples teach the field; those behind, if any, the control.
  bool learns_field() const { return trained_spp() < settings_.train_spp; }
  void begin_batch(GuidedBatch& batch) const;

  PathLengthSettings lengths_;
  GuideSettings settings_;
  const Scene* scene_ = nullptr;  // that of prepare()
  LightSet lights_;
  LightClusters clusters_;
  std::shared_ptr<const Emitter> compensated_;  // the environment as it is sampled, where it is not the scene's own
  GuidingField field_;
  std::optional<GuidingField> given_;
  CoefficientCache cache_;
  std::optional<CoefficientTable> given_table_;
  GuidedScene guided_{};
  size_t training_bytes_ = 0;  // of samples and mixtures at the end of the training
};

}  // namespace covary
