// SPDX-License-Identifier: Apache-2.0
// `controlled-path`: path tracing with control variates built from the sampling densities, learnt in spatial cells
// [Hua2023]. controlled_tracer.h has the estimator, sampling/coefficient_cache.h the learning.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "integrators/control_settings.h"
#include "integrators/controlled_batch.h"
#include "integrators/controlled_tracer.h"
#include "passes/training.h"
#include "sampling/light_set.h"

namespace covary {

class ControlledPath : public LearningIntegrator {
 public:
  ControlledPath(const PathLengthSettings& lengths, const ControlSettings& settings)
      : lengths_(lengths), settings_(settings) {}

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<ControlledPath>(lengths_, settings_); }
  const ControlSettings& settings() const { return settings_; }
  const CoefficientCache& cache() const { return cache_; }
  std::string settings_text() const override;
  /// The coefficients in use.
  const CoefficientTable& table() const { return given_ ? *given_ : cache_.table(); }
  /// Uses previously learnt coefficients instead of training; call after prepare() and before training.
  void use(CoefficientTable table);
  const LightSet& lights() const { return lights_; }

  void prepare(const Scene& scene) override;
  std::unique_ptr<ThreadState> make_thread_state() const override { return std::make_unique<ControlledBatch>(); }
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    trace_with<ControlledParts>(scene, samples, context);
  }
  bool allows_negative() const override { return settings_.on(); }
  std::optional<int> longest_path() const override { return lengths_.max_depth; }
  IntegratorReport report() const override;
  /// Whether light probabilities were learnt.
  bool selects_by_learning() const { return !table().selection().empty(); }
  WaveWeights wave_weights() const override {
    return settings_.paper || settings_.per_pixel() ? WaveWeights::kSamples : WaveWeights::kVariance;
  }
  /// 0 if coefficients were given.
  uint32_t training_spp() const override { return given_ ? 0 : settings_.training_spp(); }
  uint32_t pilot_spp() const override { return settings_.pilot_spp(); }
  bool pilot_goes_on() const override { return !settings_.solves_once(); }
  bool pilot_by_oidn() const override { return settings_.variance == VarianceKind::kRelativeByOidn && pilot_spp() > 0; }
  size_t training_memory() const override { return settings_.learns() ? kSolving * settings_.memory_limit() : 0; }
  std::unique_ptr<TrainingRecord> take_record(ThreadState& state) const override;
  void absorb(const TrainingRecord& record) override;
  bool keeps_training() const override { return settings_.on(); }
  std::string trained_bytes() const override;
  void use_bytes(std::string_view bytes, const std::string& where) override;

 protected:
  template <typename Parts>
  void trace_with(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const {
    begin_batch(context.state_as<ControlledBatch>());
    ControlledTracer<Parts>(scene, controlled_, lengths_, samples, context).trace();
  }

  void on_restart() override;
  void update() override;
  void on_freeze() override {
    training_bytes_ = cache_.bytes();
    cache_.freeze();
  }
  uint64_t state_hash() const override;

 private:
  void begin_batch(ControlledBatch& batch) const;
  void select(const std::vector<float>& clusters);
  uint32_t resolution() const;

  PathLengthSettings lengths_;
  ControlSettings settings_;
  const Scene* scene_ = nullptr;  // as passed to prepare()
  LightSet lights_;
  LightClusters clusters_;
  std::shared_ptr<const Emitter> compensated_;  // the environment as sampled, if that is not the scene's own
  CoefficientCache cache_;
  std::optional<CoefficientTable> given_;
  ControlledScene controlled_{};
  /// Memory of solving relative to that of sums and coefficients: a sorted copy of both, and the threads' sums; at most
  /// 2.9 times as much was measured.
  static constexpr size_t kSolving = 3;
  size_t training_bytes_ = 0;  // of sums and coefficients at the end of the training
};

}  // namespace covary
