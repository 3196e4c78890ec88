// SPDX-License-Identifier: Apache-2.0
// The rendering equation and the equation of transfer as they are written, for tests: whole paths, one at a time, each
// of one colour channel, without multiple importance sampling and with random numbers read in sequence. At each vertex
// all lights are sampled; light that a path hits counts only where light samples cannot find it.
//
// With L the radiance along a ray to a surface point x, or in a medium to infinity or the first collision,
//   L(x -> w) = Le(x -> w) + integral of f(x, w, w') |cos| L(w') dw',                                 [Kajiya1986]
// where attenuation by delta tracking decides between surface and medium, and shadow rays by ratio tracking
// [Novak2018].
#pragma once

#include <cmath>

#include "passes/integrator.h"
#include "sampling/light_selection.h"

namespace covary {

/// Unbiased.
class ReferencePath final : public Integrator {
 public:
  /// Paths of at most `max_depth` edges, of which those behind null surfaces count if `null_counts`.
  explicit ReferencePath(int max_depth, bool null_counts = true) : max_depth_(max_depth), null_counts_(null_counts) {}

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<ReferencePath>(*this); }
  bool sees_media() const override { return true; }
  std::string description() const override { return "reference-path"; }
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    for (CameraSample& sample : samples)
      for (int channel = 0; channel < 3; ++channel)
        sample.radiance[channel] = Walk(*this, scene, sample, channel, context).radiance();
  }

 private:
  class Walk {
   public:
    Walk(const ReferencePath& settings, const Scene& scene, const CameraSample& sample, int channel,
         PathContext& context)
        : settings_(settings),
          scene_(scene),
          context_(context),
          c_(channel),
          ray_(sample.ray),
          medium_(scene.camera_medium()),
          random_(sample.random.subpath(Subpath::kLight, 1 + static_cast<uint32_t>(channel))) {}

    float radiance() {
      while (throughput_ > 0 && n_edges_ <= settings_.max_depth_) {
        SurfaceHit hit;
        const bool found = scene_.intersect(ray_, hit);
        if (medium_ && collides(found ? hit.t : kInfinity)) {
          scatter_in_medium();
        } else if (found) {
          if (sees_light_) add_emission(hit.emitter, hit);
          scatter_on_surface(hit);
        } else {
          if (sees_light_ && scene_.environment())
            sum_ += throughput_ * scene_.environment()->environment(ray_.d).radiance[c_];
          break;
        }
      }
      return sum_;
    }

   private:
    float number() { return random_.get_1d(n_read_++, Event::kLobe); }
    Vec2 pair() { return random_.get_2d(n_read_++, Event::kDirection); }

    void add_emission(const Emitter* emitter, const SurfaceHit& hit) {
      if (emitter) sum_ += throughput_ * emitter->surface_radiance(hit, -ray_.d)[c_];
    }

    /// Delta tracking: moves the ray to the next collision with matter before `far`, if there is one.
    bool collides(float far) {
      float t = 0;
      if (!medium_->clip(ray_, t, far)) return false;
      const float majorant = medium_->majorant()[c_];
      while ((t -= std::log1p(-number()) / majorant) < far) {
        const Medium::Coefficients here = medium_->at(ray_.at(t));
        if (medium_->emits()) sum_ += throughput_ * medium_->emission(ray_.at(t), here)[c_] / majorant;
        if (number() * majorant >= here.extinction[c_]) continue;
        throughput_ *= here.scattering[c_] / here.extinction[c_];
        ray_.o = ray_.at(t);
        return true;
      }
      return false;
    }

    void scatter_in_medium() {
      const PhaseFunction& phase = medium_->phase();
      sees_light_ = !medium_->sample_lights();
      if (!sees_light_ && n_edges_ < settings_.max_depth_)
        for (const auto& emitter : scene_.emitters()) {
          const EmitterSample light = emitter->sample_towards(ray_.o, pair(), number());
          if (light.pdf_solid_angle > 0)
            add_light(light, phase.pdf(ray_.d, light.wi), shadow_ray(ray_.o, light), medium_);
        }
      ray_ = {ray_.o, phase.sample(ray_.d, pair()), kInfinity};
      play_roulette();
    }

    void scatter_on_surface(const SurfaceHit& hit) {
      const Vec3 wo = hit.frame.to_local(-ray_.d);
      Arena arena;
      const BsdfClosure& bsdf = *hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, arena);
      if (hit.bsdf_flags & kSmooth && n_edges_ < settings_.max_depth_)
        for (const auto& emitter : scene_.emitters()) {
          const EmitterSample light = emitter->sample_towards(hit.p, pair(), number());
          if (light.pdf_solid_angle > 0)
            add_light(light, bsdf.eval(wo, hit.frame.to_local(light.wi)).value[c_], shadow_ray(hit, light),
                      medium_after(hit, light.wi, medium_));
        }
      const float u = number();
      const BsdfSample next = bsdf.sample(wo, u, pair());
      throughput_ *= next.valid() ? next.weight[c_] : 0;
      const Vec3 w = hit.frame.to_world(next.wi);
      medium_ = medium_after(hit, w, medium_);
      ray_ = {offset_origin(hit, w), w, kInfinity};
      if (next.flags & kNullTransmission) {  // as if nothing were there
        n_edges_ += settings_.null_counts_;
        return;
      }
      sees_light_ = next.is_delta();
      play_roulette();
    }

    static const Medium* medium_after(const SurfaceHit& hit, const Vec3& w, const Medium* medium) {
      return hit.shape->bounds_medium() ? hit.shape->medium_towards(hit.ng, w) : medium;
    }

    /// `value`: of the BSDF with its cosine, or of the phase function.
    void add_light(const EmitterSample& light, float value, const Ray& shadow, const Medium* medium) {
      const float unblocked = throughput_ * value * light.radiance[c_] / light.pdf_solid_angle;
      if (unblocked > 0) sum_ += unblocked * transmittance(shadow, light, medium);
    }

    float transmittance(Ray ray, const EmitterSample& light, const Medium* medium) {
      float through = 1;
      for (;;) {
        SurfaceHit hit;
        const bool found = scene_.intersect(ray, hit);
        float t = 0, far = found ? hit.t : ray.t_max;
        if (medium && medium->clip(ray, t, far)) {
          const float majorant = medium->majorant()[c_];
          while ((t -= std::log1p(-number()) / majorant) < far)  // ratio tracking
            through *= 1 - medium->at(ray.at(t)).extinction[c_] / majorant;
        }
        if (!found) return through;
        const Vec3 wo = hit.frame.to_local(-ray.d);
        Arena arena;
        through *= hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, arena)->null_passage(wo).transmittance[c_];
        if (!(through > 0)) return 0;
        medium = medium_after(hit, ray.d, medium);
        ray = shadow_ray(hit, light);
      }
    }

    /// Ends one path in five, whatever it carries.
    void play_roulette() {
      ++n_edges_, ++context_.n_rays;
      throughput_ = number() < 0.8f ? throughput_ / 0.8f : 0;
    }

    const ReferencePath& settings_;
    const Scene& scene_;
    PathContext& context_;
    const int c_;
    Ray ray_;
    const Medium* medium_;
    PathRandom random_;
    uint32_t n_read_ = 0;
    int n_edges_ = 1;  ///< from the camera to what the ray meets
    float throughput_ = 1, sum_ = 0;
    bool sees_light_ = true;  ///< no light sample could have found what the ray hits
  };

  int max_depth_;
  bool null_counts_;
};

}  // namespace covary
