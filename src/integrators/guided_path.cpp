// SPDX-License-Identifier: Apache-2.0
// `guided-path`: see guided_path.h.
//
// | parameter       | type          | default | meaning                                                             |
// |-----------------|---------------|---------|---------------------------------------------------------------------|
// | max_depth       | integer       | -1      | largest number of path edges; -1: no limit                          |
// | rr_depth        | integer       | 5       | number of edges after which roulette may end a path                 |
// | hide_emitters   | boolean       | false   | lights are invisible to the camera                                  |
// | guide_lobes     | integer       | 16      | lobes of a leaf at first, 1 to 32; splitting makes up to twice many |
// | guide_train     | integer       | 16      | samples per pixel to learn from                                     |
// | guide_fraction  | string        | 0.5     | fraction of guided directions, or `learned`                         |
// | guide_roughness | number        | 0.1     | lobes of BSDFs that are less rough are not guided                   |
// | nee             | boolean       | true    | light samples (next-event estimation)                               |
#include "integrators/guided_path.h"

namespace covary {
namespace {

/// What the samples of one tile taught.
struct SamplesRecord final : TrainingRecord {
  std::vector<GuidingSample> samples;
};

}  // namespace

void GuidedPath::change(const GuideOptions& options) {
  settings_ = settings_.with(options);
  field_ = GuidingField(settings_.field());
}

void GuidedPath::prepare(const Scene& scene) {
  lights_ = settings_.nee ? LightSet(scene, LightSelection::kPower) : LightSet();
  compensated_ = settings_.nee && scene.environment() ? scene.environment()->mis_compensated() : nullptr;
  guided_ = {settings_.nee ? &lights_ : nullptr,
             compensated_ ? compensated_.get() : scene.environment(),
             &field(),
             settings_.fraction.value,
             settings_.fraction.learned,
             settings_.roughness};
}

void GuidedPath::use(GuidingField field) {
  given_ = std::move(field);
  guided_.field = &*given_;
}

std::unique_ptr<TrainingRecord> GuidedPath::take_record(ThreadState& state) const {
  std::vector<GuidingSample>& samples = static_cast<GuidedBatch&>(state).records;
  if (samples.empty()) return nullptr;
  auto record = std::make_unique<SamplesRecord>();
  record->samples.swap(samples);
  return record;
}

void GuidedPath::absorb(const TrainingRecord& record) { field_.add(static_cast<const SamplesRecord&>(record).samples); }

void GuidedPath::on_freeze() {
  training_bytes_ = field_.bytes();
  field_.freeze();
}

std::string GuidedPath::settings_text() const { return "guided-path " + lengths_.text() + " " + settings_.text(); }

std::shared_ptr<Integrator> make_guided_path(Parameters& parameters, const PathLengthSettings& lengths) {
  return std::make_shared<GuidedPath>(lengths, GuideSettings().with(GuideOptions::from(parameters)));
}

}  // namespace covary
