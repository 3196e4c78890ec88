// SPDX-License-Identifier: Apache-2.0
// `guided-path`: see guided_path.h.
#include "integrators/guided_path.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/content_hash.h"
#include "integrators/probe_guide.h"
#include "sampling/training_bytes.h"

namespace covary {
namespace {

constexpr uint32_t kMaxClusters = 5000;

/// What the samples of one tile taught.
struct SamplesRecord final : TrainingRecord {
  std::vector<GuidingSample> samples;
  SystemSums sums;
};

}  // namespace

void GuidedPath::prepare(const Scene& scene) {
  if (scene_ == &scene) return;
  scene_ = &scene;
  lights_ = settings_.nee ? LightSet(scene, LightSelection::kPower) : LightSet();
  compensated_ = settings_.nee && scene.environment() ? scene.environment()->mis_compensated() : nullptr;
  guided_ = {settings_.nee ? &lights_ : nullptr,
             compensated_ ? compensated_.get() : scene.environment(),
             &field(),
             settings_.fraction,
             settings_.learns_fraction(),
             settings_.roughness,
             &table(),
             {}};
  if (!settings_.controlled() && !settings_.nee) return;
  clusters_ = cluster_light_set(lights_, scene.bounds(), settings_.controlled() ? kMaxClusters : ~0u);
  guided_.cluster_of = clusters_.cluster_of;
  if (settings_.controlled())
    cache_ = CoefficientCache(scene.bounds(), expected_samples(clusters_, lights_), GuidedTechnique::kCount,
                              settings_.cache());
}

void GuidedPath::begin_batch(GuidedBatch& batch) const {
  batch.recording = !frozen() && learns_field();
  batch.recording_control = !frozen() && !learns_field() && settings_.controlled();
  if (batch.recording_control && batch.sums.n_cells() == 0) batch.sums = cache_.new_sums();
}

std::string GuidedPath::trained_bytes() const {
  const std::string body = field().body();
  std::string bytes;
  append_bytes(bytes, uint64_t{body.size()});
  return bytes + body + table().body();
}

void GuidedPath::use_bytes(std::string_view bytes, const std::string& where) {
  ByteReader reader(bytes, where);
  const std::string_view field = reader.take(reader.read<uint64_t>());
  given_ = GuidingField::from_body(field, where);
  given_table_ = CoefficientTable::from_body(reader.rest(), where);
  reader.check(given_table_->n_cells() == 0 || (given_table_->n_dense() == GuidedTechnique::kCount &&
                                                given_table_->n_lights() == cache_.table().n_lights()));
  guided_.field = &*given_, guided_.table = &*given_table_;
}

uint64_t GuidedPath::state_hash() const { return combine64(field().hash(), table().hash()); }

void GuidedPath::update() {
  if (learns_field())
    field_.update();
  else
    cache_.update();
}

std::unique_ptr<TrainingRecord> GuidedPath::take_record(ThreadState& state) const {
  GuidedBatch& batch = static_cast<GuidedBatch&>(state);
  if (batch.records.empty() && batch.sums.n_cells() == 0) return nullptr;
  auto record = std::make_unique<SamplesRecord>();
  record->samples.swap(batch.records);
  std::swap(record->sums, batch.sums);
  return record;
}

void GuidedPath::absorb(const TrainingRecord& record) {
  const auto& learnt = static_cast<const SamplesRecord&>(record);
  field_.add(learnt.samples);
  if (learnt.sums.n_cells() > 0) cache_.absorb(learnt.sums);
}

void GuidedPath::on_freeze() {
  training_bytes_ = field_.bytes() + cache_.bytes();
  field_.freeze(), cache_.freeze();
}

std::vector<std::string> GuidedPath::blind_spots(const Scene& scene) const {
  const auto n = std::ranges::count_if(scene.emitters(), [](const auto& light) { return light->is_delta(); });
  if (settings_.nee || n == 0) return {};
  return {fmt::format("without light samples (`nee` off), lights at a point or in one direction are not seen: {} of {}",
                      n, scene.emitters().size())};
}

IntegratorReport GuidedPath::report() const {
  const GuidingField& used = field();
  const double millions = 1e-6 * static_cast<double>(used.n_fitted());
  IntegratorReport report{"guiding",
                          {{"leaves", uint64_t{used.n_leaves()}},
                           {"lobes", uint64_t{used.n_lobes()}},
                           {"samples", uint64_t{used.n_samples()}},
                           {"samples_left_out", uint64_t{used.n_rejected()}},
                           {"fit_seconds", used.fit_seconds()},
                           {"fit_seconds_per_million_samples", millions > 0 ? used.fit_seconds() / millions : 0.0},
                           {"training_memory_bytes", uint64_t{training_bytes_}},
                           {"memory_bytes", uint64_t{used.bytes() + table().bytes()}},
                           {"controlled_leaves", uint64_t{table().n_cells()}},
                           {"controlled_leaves_switched_off", uint64_t{table().n_switched_off()}}},
                          fmt::format("guiding by {} lobes in {} leaves, from {} samples per pixel", used.n_lobes(),
                                      used.n_leaves(), training_spp()),
                          {}};
  if (const uint64_t n = used.n_rejected(); n > 0)
    report.warnings.push_back(fmt::format("{} samples of the training were not finite and are left out", n));
  return report;
}

std::optional<GuideProbe> GuidedPath::probe(const Scene& scene, const Ray& ray, int height, uint32_t spp,
                                            uint64_t seed) const {
  return probe_guide(scene, *this, ray, height, spp, seed);
}

std::string GuidedPath::settings_text() const {
  return "guided-path " + lengths_.text() + " " + film_text_of(settings_);
}

std::shared_ptr<Integrator> make_guided_path(Settings& settings, const PathLengthSettings& lengths) {
  GuideSettings own;
  declare(settings, own);
  return std::make_shared<GuidedPath>(lengths, own);
}

}  // namespace covary
