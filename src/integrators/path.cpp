// SPDX-License-Identifier: Apache-2.0
// `path`: unidirectional path tracing. At each vertex one light sample (next-event estimation) and one BSDF sample are
// combined by multiple importance sampling with the power heuristic [Veach1997] §9.2; Russian roulette.
//
// | parameter     | type    | default | meaning                                                    |
// |---------------|---------|---------|------------------------------------------------------------|
// | max_depth     | integer | -1      | largest number of path edges; -1: no limit                 |
// | rr_depth      | integer | 5       | number of edges after which roulette may end a path        |
// | hide_emitters | boolean | false   | lights are invisible to the camera                         |
//
// The estimator is unbiased. A surface with a null lobe (mask, null) blocks light samples; light behind it is found by
// paths that pass straight through, which carry full weight because no light sample could have found it.
#include <memory>

#include "core/error.h"
#include "integrators/integrator.h"
#include "integrators/light_selection.h"

namespace covary {
namespace {

/// Power heuristic for the technique of density `a` against one of density `b`.
float mis_weight(float a, float b) {
  const float r = b / a;
  return 1 / (1 + r * r);
}

class PathIntegrator final : public Integrator {
 public:
  explicit PathIntegrator(const PathLengthSettings& lengths) : lengths_(lengths) {}

  Spectrum radiance(const Scene& scene, const Ray& camera_ray, const PathRandom& random,
                    PathContext& context) const override {
    Spectrum result, throughput(1);
    if (lengths_.max_depth <= 0) return result;
    Ray ray = camera_ray;
    float eta = 1;                 // product of relative indices, undoes the radiance scaling in roulette
    Vec3 previous_p;               // where the last BSDF sample started
    float previous_pdf = 1;        // its density per unit solid angle
    bool previous_delta = true;    // it came from a delta lobe or the camera
    bool only_null = true;         // nothing but null surfaces met so far

    for (int depth = 0;; ++depth) {
      // Edges of the path that ends at what this ray meets: depth + 1.
      const bool counts = depth + 1 >= lengths_.min_depth;
      SurfaceHit hit;
      ++context.n_rays;
      bool found = scene.intersect(ray, hit);
      if (lengths_.hide_emitters && depth == 0) found = skip_area_lights(scene, ray, hit, found, context);

      if (!found) {
        const Emitter* environment = scene.environment();
        if (environment && counts && !(lengths_.hide_emitters && only_null)) {
          const float weight =
              previous_delta ? 1
                             : mis_weight(previous_pdf, light_pmf(scene) * environment->environment_pdf_solid_angle(ray.d));
          result += throughput * environment->environment_radiance(ray.d) * weight;
        }
        break;
      }
      if (hit.emitter && counts) {
        const Spectrum emitted = hit.emitter->surface_radiance(hit, -ray.d);
        if (!is_black(emitted)) {
          const float weight =
              previous_delta ? 1
                             : mis_weight(previous_pdf, light_pmf(scene) * hit.emitter->pdf_solid_angle(previous_p, hit));
          result += throughput * emitted * weight;
        }
      }
      if (depth + 1 >= lengths_.max_depth) break;

      const uint32_t vertex = static_cast<uint32_t>(depth) + 1;
      const Vec3 wo = hit.frame.to_local(-ray.d);
      context.arena.reset();
      const BsdfClosure* bsdf = hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, context.arena);

      if ((bsdf->flags() & kSmooth) && depth + 2 >= lengths_.min_depth)
        result += throughput * light_sample(scene, hit, wo, *bsdf, random, vertex, context);

      const BsdfSample sample =
          bsdf->sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
      if (!sample.valid() || is_black(sample.weight)) break;
      throughput *= sample.weight;
      eta *= sample.eta;
      if (!(sample.flags & kNullTransmission)) only_null = false;

      if (depth + 1 >= lengths_.rr_depth) {
        const float survival = std::min(max_component(throughput) * eta * eta, 0.95f);
        if (random.get_1d(vertex, Event::kRoulette) >= survival) break;
        throughput *= 1 / survival;
      }
      const Vec3 wi = hit.frame.to_world(sample.wi);
      previous_p = hit.p;
      previous_pdf = sample.pdf;
      previous_delta = sample.is_delta();
      ray = {offset_origin(hit.p, hit.ng, wi), wi, kInfinity};
    }
    return result;
  }

  std::string description() const override { return "path " + lengths_.text(); }

 private:
  /// Next-event estimation at a vertex: f cos L / pdf, weighted against BSDF sampling.
  static Spectrum light_sample(const Scene& scene, const SurfaceHit& hit, const Vec3& wo, const BsdfClosure& bsdf,
                               const PathRandom& random, uint32_t vertex, PathContext& context) {
    const Emitter* emitter = select_light(scene, random.get_1d(vertex, Event::kLightChoice));
    if (!emitter) return {};
    const EmitterSample light = emitter->sample_towards(hit.p, random.get_2d(vertex, Event::kLightPosition),
                                                        random.get_1d(vertex, Event::kLightPrimitive));
    if (!(light.pdf_solid_angle > 0) || is_black(light.radiance)) return {};
    const BsdfValue f = bsdf.eval(wo, hit.frame.to_local(light.wi));
    if (is_black(f.value)) return {};
    ++context.n_rays;
    if (scene.occluded(shadow_ray(hit, light))) return {};
    const float pdf = light_pmf(scene) * light.pdf_solid_angle;
    const float weight = light.is_delta ? 1 : mis_weight(pdf, f.pdf_solid_angle);
    return f.value * light.radiance * (weight / pdf);
  }

  /// Follows `ray` past area lights; true when something else was hit.
  static bool skip_area_lights(const Scene& scene, Ray& ray, SurfaceHit& hit, bool found, PathContext& context) {
    while (found && hit.emitter) {
      ray.o = offset_origin(hit.p, hit.ng, ray.d);
      ray.t_max -= hit.t;
      ++context.n_rays;
      found = scene.intersect(ray, hit);
    }
    return found;
  }

  PathLengthSettings lengths_;
};

}  // namespace

std::shared_ptr<Integrator> make_path(Parameters&, const PathLengthSettings& lengths) {
  return std::make_shared<PathIntegrator>(lengths);
}

}  // namespace covary
