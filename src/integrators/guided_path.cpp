// SPDX-License-Identifier: Apache-2.0
// `guided-path`: see guided_path.h.
#include "integrators/guided_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "core/content_hash.h"
#include "core/parallel.h"
#include "sampling/training_bytes.h"

namespace covary {
namespace {

constexpr uint32_t kMaxClusters = 5000;

/// What the samples of one tile contribute to training.
struct SamplesRecord final : TrainingRecord {
  std::vector<GuidingSample> samples;
  SystemSums sums;
};

}  // namespace

GuidingSettings GuideSettings::field() const {
  GuidingSettings settings;
  settings.leaf_samples = leaf_samples;
  return settings;
}

CacheSettings GuideSettings::cache() const {
  CacheSettings settings;
  settings.pyramid = false;  // lobes of different leaves are unrelated
  settings.monochrome = control == ControlKind::kMono;
  settings.memory_limit = std::numeric_limits<size_t>::max();  // leaves cannot be widened
  return settings;
}

void GuidedPath::prepare(const Scene& scene) {
  if (scene_ == &scene) return;
  scene_ = &scene;
  lights_ = settings_.nee ? LightSet(scene, LightSelection::kPower) : LightSet();
  compensated_ = settings_.nee && scene.environment() ? scene.environment()->mis_compensated() : nullptr;
  guided_ = {settings_.nee ? &lights_ : nullptr,
             compensated_ ? compensated_.get() : scene.environment(),
             &field(),
             settings_.fraction,
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
  return {fmt::format("without NEE (`nee` off), point, directional and hidden lights are invisible: {} of {}", n,
                      scene.emitters().size())};
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

namespace {

/// PassSettings::pass of probes, so that they share no random numbers with renders.
constexpr uint32_t kProbePass = 1u << 28;

/// Directional scattering of the surface.
class Surface {
 public:
  Surface(const GuidedPath& integrator, const SurfaceHit& hit, const Vec3& to_viewer)
      : guided_(integrator.guided()), hit_(hit), wo_(hit.frame.to_local(to_viewer)) {
    bsdf_ = hit.bsdf->bind(hit, wo_.z > 0, TransportMode::kRadiance, arena_);
    guide_.leaf = guided_.field->find(hit.p);
    if (guide_.leaf == GuidingField::kNone) return;
    guide_.guidable = guidable_fraction(*bsdf_, wo_, kMinGuidedRoughness);
    guide_.see(guided_, hit, wo_);
    if (guide_.lobes.n > 0 && guided_.table->n_cells() > 0) cell_ = guided_.table->find(control_key(guide_.leaf));
  }

  float density(const Vec3& w) const {
    const float pdf = bsdf_->eval(wo_, hit_.frame.to_local(w)).pdf_solid_angle;
    return guide_.fraction > 0 ? guide_.mixture_pdf(pdf, guide_.lobes.pdf(w)) : pdf;
  }

  Spectrum control(const Vec3& w) const {
    if (cell_ == CoefficientTable::kNone) return {};
    const CoefficientTable& table = *guided_.table;
    const float pdf = bsdf_->eval(wo_, hit_.frame.to_local(w)).pdf_solid_angle;
    Spectrum sum = table.dense(cell_, GuidedTechnique::kBsdf) * ((1 - guide_.fraction) * pdf);
    alignas(32) float parts[VmfLobes::kMax];
    guide_.lobes.pdfs(w, parts);
    const GuidingLeaf& leaf = guided_.field->leaf(guide_.leaf);
    for (int k = 0; k < guide_.lobes.n; ++k)
      sum += table.dense(cell_, GuidedTechnique::of(leaf, k)) * (guide_.fraction * parts[k]);
    return sum * table.scale(cell_);
  }

 private:
  const GuidedScene& guided_;
  const SurfaceHit& hit_;
  Vec3 wo_;
  Arena arena_;
  const BsdfClosure* bsdf_;
  uint32_t cell_ = CoefficientTable::kNone;
  Guide<GuidedParts> guide_;
};

void set(Image& image, int x, int y, const Spectrum& value) {
  for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = value[c];
}

}  // namespace

std::optional<GuideProbe> GuidedPath::probe(const Scene& scene, const Ray& ray, int height, uint32_t spp,
                                            uint64_t seed) const {
  SurfaceHit hit;
  if (!scene.intersect(ray, hit)) return {};
  const int width = 2 * height;
  GuideProbe probe{hit.p, Image(width, height, 3), Image(width, height, 3), Image(width, height, 3)};
  const Surface surface(*this, hit, -ray.d);
  parallel_for(height, [&](int y) {
    PathContext context(*this);
    std::vector<CameraSample> samples;
    for (int x = 0; x < width; ++x) {
      samples.clear();
      const auto pixel = static_cast<uint64_t>(y) * static_cast<uint64_t>(width) + static_cast<uint64_t>(x);
      for (uint32_t s = 0; s < spp; ++s) {
        const PathRandom random(Sampling::kIndependent, seed, kProbePass, pixel, s);
        const Vec2 u = random.get_2d(0, Event::kPixel);
        const Vec3 w = probe_direction((static_cast<float>(x) + u.x) / static_cast<float>(width),
                                       (static_cast<float>(y) + u.y) / static_cast<float>(height));
        samples.push_back({{offset_origin(hit, w), w, kInfinity}, random, {}});
      }
      trace(scene, samples, context);
      Spectrum sum;
      for (const CameraSample& sample : samples) sum += sample.radiance;
      set(probe.radiance, x, y, sum / static_cast<float>(spp));
      const Vec3 centre = probe_direction((static_cast<float>(x) + 0.5f) / static_cast<float>(width),
                                          (static_cast<float>(y) + 0.5f) / static_cast<float>(height));
      set(probe.density, x, y, Spectrum(surface.density(centre)));
      set(probe.control, x, y, surface.control(centre));
    }
  });
  return probe;
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
