// SPDX-License-Identifier: Apache-2.0
#include "integrators/medium_path.h"

#include <cmath>

#include "integrators/primary_sample.h"
#include "sampling/roulette.h"

namespace covary {
namespace {

/// Null transmission of the surface hit by a ray along `d`.
NullPassage null_passage(const SurfaceHit& hit, const Vec3& d) {
  const Vec3 wo = hit.frame.to_local(-d);
  Arena arena;  // the path's own arena still holds the closure at its vertex
  return hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, arena)->null_passage(wo);
}

}  // namespace

MediumPath::MediumPath(const Scene& scene, const PathLengthSettings& lengths, CameraSample& sample,
                       PathContext& context, const LightParts* parts, uint32_t number)
    : scene_(scene),
      lengths_(lengths),
      sample_(sample),
      context_(context),
      parts_(parts),
      number_(number),
      lights_(scene),
      channel_(channel_of(sample.random)),
      numbers_(sample.random, 0),
      ray_(sample.ray),
      medium_(scene.camera_medium()) {}

/// Traces one ray, to the next surface or collision. False if the path ends.
bool MediumPath::advance() {
  SurfaceHit hit;
  ++context_.n_rays;
  const bool found = scene_.intersect(ray_, hit);
  if (context_.stopped()) return false;
  if (medium_) {
    const float far = found ? hit.t : ray_.t_max;
    Spectrum glow;
    const bool glows = medium_->emits() && depth_ + 1 >= lengths_.min_depth;
    const float t =
        sample_flight(*medium_, ray_, far, channel_, numbers_, weights_, context_.stop, glows ? &glow : nullptr);
    if (glows) add_glow(glow);
    if (t < kInfinity) return scatter_in_medium(ray_.at(t));
  }
  if (!found) {
    const bool seen = only_null_ && scene_.background();
    if (const Emitter* light = seen ? scene_.background() : scene_.environment()) add_emission(*light, nullptr);
    return false;
  }
  const bool hidden = hit.emitter && lengths_.hide_emitters && only_null_;
  if (hit.emitter && !hidden) add_emission(*hit.emitter, &hit);
  if (!hidden && !is_boundary(hit)) return scatter_on_surface(hit);
  if (!hidden) weights_.throughput *= null_passage(hit, ray_.d).transmittance;
  go_through(hit, ray_.d);
  return true;
}

void MediumPath::go_through(const SurfaceHit& hit, const Vec3& w) {
  if (hit.shape->bounds_medium()) medium_ = hit.shape->medium_towards(hit.ng, w);
  ray_ = Ray{offset_origin(hit, w), w, kInfinity};
}

bool MediumPath::scatter_in_medium(const Vec3& p) {
  only_null_ = false;
  if (depth_ + 1 >= lengths_.max_depth) return false;
  const uint32_t vertex = kFirstSurfaceVertex + n_smooth_;
  const PhaseFunction& phase = medium_->phase();
  if (medium_->sample_lights() && depth_ + 2 >= lengths_.min_depth && !lights_.empty()) {
    const Emitter& emitter = choose_light(vertex);
    const EmitterSample light = sample_light(emitter, p, vertex);
    if (light.pdf_solid_angle > 0) {
      const float value = phase.pdf(ray_.d, light.wi);
      connect(light, emitter, shadow_ray(p, light), medium_, Spectrum(value), value);
    }
  }
  const Vec3 w = phase.sample(ray_.d, sample_.random.get_2d(vertex, Event::kDirection));
  weights_.pdf_light = weights_.pdf_path * (1 / phase.pdf(ray_.d, w));
  only_direction_ = !medium_->sample_lights();
  previous_p_ = p;
  ray_ = Ray{p, w, kInfinity};
  ++depth_, ++n_smooth_;
  start_flight();
  return play_roulette(vertex);
}

bool MediumPath::scatter_on_surface(const SurfaceHit& hit) {
  const bool last = depth_ + 1 >= lengths_.max_depth;
  const bool smooth = hit.bsdf_flags & kSmooth;
  if (last && !(hit.bsdf_flags & kNullTransmission)) return false;
  const uint32_t vertex = smooth ? kFirstSurfaceVertex + n_smooth_ : kDeltaVertices + n_delta_++;
  const PathRandom& random = sample_.random;
  const Vec3 wo = hit.frame.to_local(-ray_.d);
  context_.arena.reset();
  const BsdfClosure* bsdf = hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, context_.arena);
  if (smooth && !last && depth_ + 2 >= lengths_.min_depth && !lights_.empty()) {
    const Emitter& emitter = choose_light(vertex);
    const EmitterSample light = sample_light(emitter, hit.p, vertex);
    if (light.pdf_solid_angle > 0) {
      const BsdfValue f = bsdf->eval(wo, hit.frame.to_local(light.wi));
      const Medium* medium = hit.shape->bounds_medium() ? hit.shape->medium_towards(hit.ng, light.wi) : medium_;
      connect(light, emitter, shadow_ray(hit, light), medium, f.value, f.pdf_solid_angle);
    }
  }
  const BsdfSample next =
      bsdf->sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
  if (!next.valid() || is_black(next.weight)) return false;
  const bool passes = next.flags & kNullTransmission;
  if (last && !passes) return false;
  weights_.throughput *= next.weight;
  eta_ *= next.eta;
  if (passes) {  // continue with the state of the previous direction; a light sample passes with certainty
    weights_.pdf_light *= 1 / bsdf->null_passage(wo).pmf;
  } else if (next.is_delta()) {
    only_direction_ = true;
  } else {
    weights_.pdf_light = weights_.pdf_path * (1 / next.pdf);
    only_direction_ = false;
    previous_p_ = hit.p;
  }
  if (smooth) ++n_smooth_, start_flight();
  go_through(hit, hit.frame.to_world(next.wi));
  if (passes) return true;
  only_null_ = false;
  ++depth_;
  return play_roulette(vertex);
}

bool MediumPath::play_roulette(uint32_t vertex) {
  if (depth_ < lengths_.rr_depth) return true;
  const Spectrum throughput = weights_.throughput * (1 / mean(weights_.pdf_path));
  const float survival = roulette::survival_probability(throughput, eta_, sample_.random.sampling());
  if (sample_.random.get_1d(vertex, Event::kRoulette) < survival) {
    weights_.throughput *= roulette::survivor_weight(survival);
    return true;
  }
  if (std::isnan(survival)) sample_.radiance = throughput;  // a bad sample instead of a black one
  return false;
}

/// Adds light hit by the ray, on a surface or, without `hit`, at infinity.
void MediumPath::add_emission(const Emitter& emitter, const SurfaceHit* hit) {
  const bool background = &emitter == scene_.background();
  if (depth_ + 1 < lengths_.min_depth || (!hit && lengths_.hide_emitters && only_null_ && !background)) return;
  const EnvironmentLight light =
      hit ? EnvironmentLight{emitter.surface_radiance(*hit, -ray_.d)} : emitter.environment(ray_.d);
  const Spectrum radiance = weights_.throughput * light.radiance;
  if (is_black(radiance)) return;
  Spectrum pdf = weights_.pdf_path;
  if (!only_direction_ && !background) {
    const float pdf_light = hit ? emitter.pdf_solid_angle(previous_p_, *hit) : light.pdf_solid_angle;
    pdf += weights_.pdf_light * (lights_.pmf(emitter) * pdf_light);
  }
  add(emitter, radiance * (1 / mean(pdf)));
}

const Emitter& MediumPath::choose_light(uint32_t vertex) const {
  return lights_.select(sample_.random.get_1d(vertex, Event::kLightChoice));
}

EmitterSample MediumPath::sample_light(const Emitter& emitter, const Vec3& p, uint32_t vertex) const {
  const PathRandom& random = sample_.random;
  return emitter.sample_towards(p, random.get_2d(vertex, Event::kLightPosition),
                                random.get_1d(vertex, Event::kLightPrimitive));
}

/// Adds a light sample. `value`: of the BSDF with its cosine, or of the phase function; `pdf_direction`: density with
/// which that samples the direction.
void MediumPath::connect(const EmitterSample& light, const Emitter& emitter, const Ray& shadow, const Medium* medium,
                         const Spectrum& value, float pdf_direction) {
  const Spectrum unblocked = weights_.throughput * value * light.radiance;
  if (is_black(unblocked)) return;
  SpectralWeights weights;
  if (!light_arrives(shadow, light, medium, weights)) return;
  Spectrum pdf = weights.pdf_light * (lights_.pmf(emitter) * light.pdf_solid_angle);
  if (!light.is_delta) pdf += weights.pdf_path * pdf_direction;
  add(emitter, unblocked * weights.throughput * (1 / mean(weights_.pdf_path * pdf)));
}

/// Follows a shadow ray through boundaries and media; false if nothing arrives.
bool MediumPath::light_arrives(Ray ray, const EmitterSample& light, const Medium* medium, SpectralWeights& weights) {
  FlightNumbers numbers(sample_.random, n_smooth_);
  SurfaceHit hit;
  while (!context_.stopped()) {
    ++context_.n_rays;
    const bool found = scene_.intersect(ray, hit);
    if (found && !(hit.bsdf_flags & kNullTransmission)) return false;
    if (medium) attenuate(*medium, ray, found ? hit.t : ray.t_max, channel_, numbers, weights, context_.stop);
    if (!found || is_black(weights.throughput)) return !is_black(weights.throughput);
    const NullPassage passage = null_passage(hit, ray.d);
    weights.throughput *= passage.transmittance, weights.pdf_path *= passage.pmf;
    if (hit.shape->bounds_medium()) medium = hit.shape->medium_towards(hit.ng, ray.d);
    ray = shadow_ray(hit, light);
    if (dot(ray.d, light.wi) < 0) return true;  // beyond the light by rounding
  }
  return false;
}

}  // namespace covary
