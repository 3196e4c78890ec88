// SPDX-License-Identifier: Apache-2.0
// `controlled-path`: see controlled_path.h.
#include "integrators/controlled_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/content_hash.h"
#include "sampling/training_bytes.h"

namespace covary {
namespace {

/// What the samples of one tile contribute to training.
struct SumsRecord final : TrainingRecord {
  SystemSums sums;
};

}  // namespace

void ControlledPath::prepare(const Scene& scene) {
  if (scene_ == &scene) return;
  scene_ = &scene;
  lights_ = LightSet(scene, settings_.lights);
  compensated_ = scene.environment() ? scene.environment()->mis_compensated() : nullptr;
  const Emitter* environment = compensated_ ? compensated_.get() : scene.environment();
  controlled_ = {&lights_,
                 {},
                 environment,
                 &table(),
                 settings_.kind == ControlKind::kVevoda,
                 settings_.per_pixel(),
                 settings_.lights == LightSelection::kLearned,
                 settings_.by_albedo(),
                 settings_.kind == ControlKind::kMono};
  clusters_ = cluster_light_set(lights_, scene.bounds(), settings_.learns() ? settings_.max_clusters() : ~0u);
  controlled_.cluster_of = clusters_.cluster_of;
  if (settings_.learns())
    cache_ = CoefficientCache(scene.bounds(), expected_samples(clusters_, lights_), controlled_.n_dense(),
                              settings_.cache(resolution()));
}

/// With per-pixel coefficients, the longer side of the frame. Otherwise from what the camera sees: cells as wide as 8
/// pixels on average over the image, clamped to 32 to 256 cells; 64 if it sees nothing.
uint32_t ControlledPath::resolution() const {
  if (settings_.per_pixel())
    return static_cast<uint32_t>(std::max(scene_->camera().width(), scene_->camera().height()));
  if (settings_.grid != ControlSettings::kAutomaticGrid) return settings_.grid;
  constexpr int kSide = 16;
  const Camera& camera = scene_->camera();
  double sum = 0;
  int n = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Vec2 at = {(static_cast<float>(i % kSide) + 0.5f) / kSide * static_cast<float>(camera.width()),
                     (static_cast<float>(i / kSide) + 0.5f) / kSide * static_cast<float>(camera.height())};
    const Ray ray = camera.ray(at, {0.5f, 0.5f}), next = camera.ray({at.x + 1, at.y}, {0.5f, 0.5f});
    SurfaceHit hit;
    if (!scene_->intersect(ray, hit)) continue;
    sum += length(ray.o + ray.d * hit.t - next.o - next.d * hit.t), ++n;
  }
  if (!(sum > 0)) return 64;
  const Vec3 size = scene_->bounds().upper - scene_->bounds().lower;
  return static_cast<uint32_t>(std::clamp(max_component(size) / (8 * sum / n), 32.0, 256.0));
}

/// Selects clusters with these relative probabilities, and lights within clusters as before.
void ControlledPath::select(const std::vector<float>& clusters) {
  const std::vector<float> counts = expected_samples(clusters_, lights_);
  std::vector<double> weights;
  for (uint32_t i = 0; i < lights_.size(); ++i) {
    const uint32_t cluster = clusters_.cluster_of[i];
    weights.push_back(counts[cluster] > 0 ? double{clusters[cluster]} * lights_[i].pmf / counts[cluster] : 0);
  }
  lights_.change(weights);
}

void ControlledPath::use(CoefficientTable table) {
  COVARY_CHECK(scene_ && settings_.on(), "coefficients belong to a scene and to control variates");
  if (!table.selection().empty()) select(table.selection());
  given_ = std::move(table);
  controlled_.table = &*given_;
}

std::string ControlledPath::trained_bytes() const { return table().body(); }

void ControlledPath::use_bytes(std::string_view bytes, const std::string& where) {
  use(CoefficientTable::from_body(bytes, where));
}

uint64_t ControlledPath::state_hash() const { return table().hash(); }

void ControlledPath::begin_batch(ControlledBatch& batch) const {
  batch.recording = !frozen() && settings_.learns() && trained_spp() >= pilot_spp();
  if (!batch.recording || batch.sums.n_cells() > 0) return;
  batch.sums = cache_.new_sums();
  batch.sums.reserve(batch.last_cells, batch.last_rows);
}

std::unique_ptr<TrainingRecord> ControlledPath::take_record(ThreadState& state) const {
  auto& batch = static_cast<ControlledBatch&>(state);
  SystemSums& sums = batch.sums;
  if (sums.n_cells() == 0) return nullptr;
  batch.last_cells = sums.n_cells(), batch.last_rows = sums.n_rows();
  auto record = std::make_unique<SumsRecord>();
  std::swap(record->sums, sums);
  return record;
}

void ControlledPath::absorb(const TrainingRecord& record) {
  cache_.absorb(static_cast<const SumsRecord&>(record).sums);
}

void ControlledPath::on_restart() {
  if (given_) return;
  if (selects_by_learning()) lights_ = LightSet(*scene_, settings_.lights);
  if (settings_.learns()) cache_.select(expected_samples(clusters_, lights_));
  cache_.restart();
}

void ControlledPath::update() {
  if (trained_spp() < pilot_spp()) return;
  const std::vector<float> selection = cache_.table().selection();
  const uint32_t end = std::min(training_spp(), wave_end(trained_spp(), 1));
  const bool solve = end == training_spp() || !settings_.solves_once();
  if (settings_.on() && solve) cache_.update();
  // Switch to the learnt light selection once half of the samples have been taken: the other half then trains the
  // coefficients for this selection.
  std::vector<float> best;
  if (controlled_.residuals && selection.empty() && settings_.ends_selection(end)) best = cache_.best_selection();
  cache_.forget_residuals();
  if (!best.empty()) {
    select(best);
    cache_.select(expected_samples(clusters_, lights_));
  }
  cache_.set_selection(best.empty() ? selection : best);
}

IntegratorReport ControlledPath::report() const {
  if (!settings_.on()) return {};
  const CoefficientTable& used = table();
  IntegratorReport report{
      "control_variates",
      {{"lights", uint64_t{lights_.size()}},
       {"clusters", uint64_t{clusters_.n_clusters}},
       {"cells", uint64_t{used.n_cells()}},
       {"cells_switched_off", uint64_t{used.n_switched_off()}},
       {"grid", uint64_t{used.grid().resolution()}},
       {"times_coarsened", uint64_t{cache_.n_coarsened()}},
       {"samples_not_finite", uint64_t{cache_.n_rejected()}},
       {"memory_bytes", uint64_t{training_bytes_}}},
      fmt::format("control variates in {} cells, {} of them switched off, from {} samples per pixel", used.n_cells(),
                  used.n_switched_off(), training_spp()),
      {}};
  if (const uint32_t n = cache_.n_coarsened(); n > 0)
    report.warnings.push_back(fmt::format("{} MiB for control variates were reached; cells are {} times as wide",
                                          settings_.memory_limit() >> 20, uint64_t{1} << n));
  if (const uint64_t n = cache_.n_rejected(); n > 0)
    report.warnings.push_back(fmt::format("{} samples of the training were not finite and are left out", n));
  return report;
}

std::string ControlledPath::settings_text() const {
  return "controlled-path " + lengths_.text() + " " + film_text_of(settings_);
}

std::shared_ptr<Integrator> make_controlled_path(Settings& settings, const PathLengthSettings& lengths) {
  ControlSettings own;
  declare(settings, own);
  return std::make_shared<ControlledPath>(lengths, own);
}

}  // namespace covary
