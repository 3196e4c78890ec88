// SPDX-License-Identifier: Apache-2.0
#include "integrators/probe_guide.h"

#include "core/parallel.h"

namespace covary {
namespace {

/// PassSettings::pass of probes, so that they share no numbers with renders.
constexpr uint32_t kProbePass = 1u << 28;

/// What the surface does with directions.
class Surface {
 public:
  Surface(const GuidedPath& integrator, const SurfaceHit& hit, const Vec3& to_viewer)
      : guided_(integrator.guided()), hit_(hit), wo_(hit.frame.to_local(to_viewer)) {
    bsdf_ = hit.bsdf->bind(hit, wo_.z > 0, TransportMode::kRadiance, arena_);
    guide_.leaf = guided_.field->find(hit.p);
    if (guide_.leaf == GuidingField::kNone) return;
    guide_.guidable = guidable_fraction(*bsdf_, wo_, guided_.min_roughness);
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

std::optional<GuideProbe> probe_guide(const Scene& scene, const GuidedPath& integrator, Ray ray, int height,
                                      uint32_t spp, uint64_t seed) {
  SurfaceHit hit;
  if (!scene.intersect(ray, hit)) return {};
  const int width = 2 * height;
  GuideProbe probe{hit.p, Image(width, height, 3), Image(width, height, 3), Image(width, height, 3)};
  const Surface surface(integrator, hit, -ray.d);
  parallel_for(height, [&](int y) {
    PathContext context(integrator);
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
      integrator.trace(scene, samples, context);
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

}  // namespace covary
