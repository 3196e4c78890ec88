// SPDX-License-Identifier: Apache-2.0
// Reference bidirectional path tracer: one sample at a time, whole paths, with explicit densities and contributions of
// all vertices. It uses the random numbers of `bdpt`, so each technique must find the same path with the same value and
// weight. Without Russian roulette.
//
// Vertices of a whole path run from the light, x[0], to the lens, x[k].
#pragma once

#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/arena.h"
#include "integrators/primary_sample.h"
#include "passes/light_pass.h"
#include "sampling/light_selection.h"
#include "scene/scene.h"

namespace covary::reference_bdpt {

/// The unweighted contribution of a technique (s, t), and its MIS weight.
struct Contribution {
  Spectrum value;
  double weight = 0;
};
using Contributions = std::map<std::pair<int, int>, Contribution>;

struct Settings {
  int max_depth = 5;
  double exponent = 2;
  bool hide_emitters = false;
  double light_paths_per_spp = 0;  ///< 0: no light tracing
};

struct Vertex {
  SurfaceHit hit;                  // for surfaces; p and ng also for a point on a light
  const Emitter* light = nullptr;  // x[0] only
  Vec3 to_light;                   // x[0] at infinity: direction towards it
  bool on_surface = false;         // neither the lens nor only a light
  // The event to the next vertex, if a walk sampled one.
  std::optional<BsdfSample> event;
  bool from_camera = false;
};

inline Vec3 local(const Vertex& v, const Vec3& w) { return v.hit.frame.to_local(w); }

class Sampler {
 public:
  Sampler(const Scene& scene, const Settings& settings)
      : scene_(scene), settings_(settings), nee_(scene), emission_(scene) {}

  Contributions camera_sample(const CameraSample& sample) const {
    Contributions result;
    const std::vector<Vertex> camera = camera_walk(sample);
    const std::vector<Vertex> light = light_walk(sample.random.subpath(Subpath::kLight));
    uint32_t n_smooth = 0;
    for (size_t i = 1; i < camera.size(); ++i) {  // t = i + 1
      if (const auto hit = hit_light(camera, i)) keep(result, 0, *hit);
      if (!camera[i].on_surface || !(camera[i].hit.bsdf_flags & kSmooth)) continue;
      const uint32_t vertex = kFirstSurfaceVertex + n_smooth++;
      if (!scene_.emitters().empty())
        if (const auto path = to_light(camera, i, sample.random, vertex)) keep(result, 1, *path);
      for (size_t j = 1; j < light.size(); ++j)
        if (const auto path = join(light, j, camera, i)) keep(result, static_cast<int>(j) + 1, *path);
    }
    return result;
  }

  /// The techniques (s, 1) of a light path, by pixel; box filter.
  std::map<int, std::pair<Vec2, Contribution>> light_path(const PathRandom& random) const {
    std::map<int, std::pair<Vec2, Contribution>> result;
    const std::vector<Vertex> light = light_walk(random.subpath(Subpath::kLight));
    uint32_t n_smooth = 0;
    for (size_t j = 1; j < light.size(); ++j) {
      if (!(light[j].hit.bsdf_flags & kSmooth)) continue;
      const uint32_t vertex = kFirstSurfaceVertex + n_smooth++;
      if (settings_.hide_emitters && light[j].hit.emitter) continue;
      const LensSample lens = scene_.camera().sample_towards(light[j].hit.p, random.get_2d(vertex, Event::kLens));
      if (!(lens.pdf_solid_angle > 0) || !sees_lens(light[j], lens)) continue;
      std::vector<Vertex> path(light.begin(), light.begin() + static_cast<long>(j) + 1);
      path.back().event.reset();
      path.push_back(lens_vertex(lens.p));
      const Contribution c = evaluate(path, static_cast<int>(j) + 1);
      if (!is_black(c.value) && static_cast<int>(j) + 1 <= settings_.max_depth)
        result[static_cast<int>(j) + 1] = {lens.film, c};
    }
    return result;
  }

 private:
  using Path = std::vector<Vertex>;

  static Vertex lens_vertex(const Vec3& p) {
    Vertex lens;
    lens.hit.p = p;
    return lens;
  }

  void keep(Contributions& result, int s, const Path& path) const {
    const int k = static_cast<int>(path.size()) - 1;
    if (k > settings_.max_depth) return;
    const Contribution c = evaluate(path, s);
    if (!is_black(c.value)) result[{s, k + 1 - s}] = c;
  }

  // --- walks -------------------------------------------------------------------------------------------------------

  /// camera[0] is the lens; the last vertex may be a light at infinity.
  Path camera_walk(const CameraSample& sample) const {
    const Transform to_camera = scene_.camera().settings().to_world.inverse();
    Ray ray = sample.ray;
    const float near_t = scene_.camera().settings().near_clip / to_camera.vector(ray.d).z;
    Path path = {lens_vertex(ray.o - ray.d * near_t)};
    uint32_t n_smooth = 0;
    bool only_null = true;
    for (uint32_t depth = 0; static_cast<int>(depth) < settings_.max_depth; ++depth) {
      Vertex v;
      bool found = scene_.intersect(ray, v.hit);
      while (depth == 0 && settings_.hide_emitters && found && v.hit.emitter) {
        ray = {offset_origin(v.hit, ray.d), ray.d, ray.t_max - v.hit.t};
        found = scene_.intersect(ray, v.hit);
      }
      v.from_camera = true;
      if (!found) {
        v.light = scene_.environment();
        v.to_light = ray.d;
        if (v.light && !(settings_.hide_emitters && only_null)) path.push_back(v);
        return path;
      }
      v.on_surface = true;
      const uint32_t vertex = v.hit.bsdf_flags & kSmooth ? kFirstSurfaceVertex + n_smooth++ : kDeltaVertices + depth;
      if (!step(v, -ray.d, TransportMode::kRadiance, sample.random, vertex, ray)) {
        path.push_back(v);
        return path;
      }
      if (!(v.event->flags & kNullTransmission)) only_null = false;
      path.push_back(v);
    }
    return path;
  }

  Path light_walk(const PathRandom& random) const {
    if (emission_.empty()) return {};
    Vertex origin;
    const Emitter& emitter = emission_.select(random.get_1d(0, Event::kLightChoice));
    const EmissionSample from =
        emitter.sample_emission(random.get_2d(0, Event::kLightPosition), random.get_2d(0, Event::kLightDirection),
                                random.get_1d(0, Event::kLightPrimitive));
    if (!(from.pdf_position * from.pdf_direction > 0) || is_black(from.radiance)) return {};
    origin.light = &emitter;
    origin.hit = point_on_light(from.ray.o, from.n, from.uv);
    origin.to_light = -from.ray.d;
    Path path = {origin};
    Ray ray = {from.ray.o, from.ray.d, kInfinity};
    ray.o = offset_origin(ray.o, from.n, from.offset, ray.d);
    uint32_t n_smooth = 0;
    for (uint32_t depth = 0; static_cast<int>(depth) + 1 < settings_.max_depth; ++depth) {
      Vertex v;
      if (!scene_.intersect(ray, v.hit)) return path;
      v.on_surface = true;
      const uint32_t vertex = v.hit.bsdf_flags & kSmooth ? kFirstSurfaceVertex + n_smooth++ : kDeltaVertices + depth;
      const bool more = step(v, -ray.d, TransportMode::kImportance, random, vertex, ray);
      path.push_back(v);
      if (!more) return path;
    }
    return path;
  }

  /// Samples the event at v and the ray that leaves it.
  static bool step(Vertex& v, const Vec3& wo_world, TransportMode mode, const PathRandom& random, uint32_t vertex,
                   Ray& ray) {
    const Vec3 wo = local(v, wo_world);
    Arena arena;
    const BsdfClosure* bsdf = v.hit.bsdf->bind(v.hit, wo.z > 0, mode, arena);
    const BsdfSample next =
        bsdf->sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
    if (!next.valid() || is_black(next.weight)) return false;
    v.event = next;
    const Vec3 wi = v.hit.frame.to_world(next.wi);
    ray = {offset_origin(v.hit, wi), wi, kInfinity};
    return true;
  }

  // --- techniques --------------------------------------------------------------------------------------------------

  static void append_reversed(Path& path, const Path& camera, size_t i) {
    for (size_t n = i + 1; n-- > 0;) path.push_back(camera[n]);
  }

  std::optional<Path> hit_light(const Path& camera, size_t i) const {
    const Vertex& end = camera[i];
    const Emitter* emitter = end.on_surface ? end.hit.emitter : end.light;
    if (!emitter) return {};
    Path path;
    append_reversed(path, camera, i);
    path[0].light = emitter;
    path[0].event.reset();
    return path;
  }

  std::optional<Path> to_light(const Path& camera, size_t i, const PathRandom& random, uint32_t vertex) const {
    const Emitter& emitter = nee_.select(random.get_1d(vertex, Event::kLightChoice));
    const EmitterSample light = emitter.sample_towards(camera[i].hit.p, random.get_2d(vertex, Event::kLightPosition),
                                                       random.get_1d(vertex, Event::kLightPrimitive));
    if (!(light.pdf_solid_angle > 0) || scene_.occluded(shadow_ray(camera[i].hit, light))) return {};
    Vertex origin;
    origin.light = &emitter;
    origin.hit = point_on_light(light.p, light.n, light.uv);
    origin.to_light = light.wi;
    Path path = {origin};
    append_reversed(path, camera, i);
    path[1].event.reset();
    return path;
  }

  std::optional<Path> join(const Path& light, size_t j, const Path& camera, size_t i) const {
    const SurfaceHit &a = camera[i].hit, &b = light[j].hit;
    if (!(b.bsdf_flags & kSmooth)) return {};
    const Vec3 w = normalize(b.p - a.p);
    const Vec3 target = offset_target(b.p, b.ng, b.offset, w, length(b.p - a.p));
    if (scene_.occluded(ray_between(offset_origin(a, w), target))) return {};
    Path path(light.begin(), light.begin() + static_cast<long>(j) + 1);
    path[j].event.reset();
    append_reversed(path, camera, i);
    path[j + 1].event.reset();
    return path;
  }

  bool sees_lens(const Vertex& v, const LensSample& lens) const {
    Vec3 o = offset_origin(v.hit, lens.wi);
    SurfaceHit hit;
    while (scene_.intersect({o, normalize(lens.near_p - o), length(lens.near_p - o)}, hit)) {
      if (!settings_.hide_emitters || !hit.emitter) return false;
      o = offset_origin(hit, lens.wi);
    }
    return true;
  }

  // --- densities and contributions -----------------------------------------------------------------------------------

  /// Densities of each vertex, sampled from the light and from the camera, per unit area (a light at infinity: per unit
  /// solid angle); after a delta event, both are relative to the same Dirac delta.
  struct Densities {
    std::vector<double> from_light, from_camera;
    double direct = 0;  // density of x[0] as a light sample
  };

  static bool infinite(const Vertex& v) { return v.light && v.light->is_infinite(); }
  /// Unit direction from a to b.
  static Vec3 towards(const Vertex& a, const Vertex& b) {
    if (infinite(b)) return b.to_light;
    if (infinite(a)) return -a.to_light;
    return normalize(b.hit.p - a.hit.p);
  }
  static double cosine(const Vertex& v, const Vec3& w) { return std::abs(static_cast<double>(dot(v.hit.ng, w))); }
  static double distance2(const Vertex& a, const Vertex& b) { return length_squared(b.hit.p - a.hit.p); }

  const BsdfClosure* bind(const Vertex& v, const Vec3& wo, TransportMode mode) const {
    arena_.reset();
    return v.hit.bsdf->bind(v.hit, wo.z > 0, mode, arena_);
  }

  /// Density of the direction to `next` at v, arriving from `previous`; per unit solid angle.
  double direction_pdf(const Vertex& previous, const Vertex& v, const Vertex& next, bool from_camera) const {
    const Vec3 wo = local(v, towards(v, previous)), wi = local(v, towards(v, next));
    const TransportMode mode = from_camera ? TransportMode::kRadiance : TransportMode::kImportance;
    if (!v.event || !v.event->is_delta()) return bind(v, wo, mode)->eval(wo, wi).pdf_solid_angle;
    double pdf = v.event->pdf;
    if (v.from_camera != from_camera) {
      // The other side sampled the event, for wi.
      const TransportMode other = from_camera ? TransportMode::kImportance : TransportMode::kRadiance;
      pdf = bind(v, wi, other)->reverse_pmf(wi, *v.event);
    }
    if (from_camera || v.event->eta == 1) return pdf;
    // d(omega on the light's side) / d(omega on the camera's side), the ratio of both sides' Dirac deltas.
    const double eta = v.from_camera ? v.event->eta : 1 / v.event->eta;  // light's side over camera's
    return pdf * std::abs(wi.z / (wo.z * eta * eta));
  }

  Densities densities(const Path& x) const {
    const size_t k = x.size() - 1;
    Densities d;
    d.from_light.assign(k + 1, 0), d.from_camera.assign(k + 1, 0);
    const Emitter& light = *x[0].light;
    const Vec3 w = towards(x[0], x[1]);
    const EmissionPdf emission = light.pdf_emission(x[0].hit, w);
    double pdf_direct = 1;
    if (light.is_environment())
      pdf_direct = light.environment(-w).pdf_solid_angle;
    else if (!light.is_delta())
      pdf_direct = light.pdf_solid_angle(x[1].hit.p, x[0].hit);
    if (light.is_infinite()) {
      d.from_light[0] = double{emission_.pmf(light)} * emission.direction;
      d.from_light[1] = emission.position * cosine(x[1], w);
      d.direct = nee_.pmf(light) * pdf_direct;
    } else {
      d.from_light[0] = double{emission_.pmf(light)} * emission.position;
      d.from_light[1] = emission.direction * area_factor(x[0], x[1]);
      d.direct = nee_.pmf(light) * pdf_direct * (light.is_delta_position() ? 1 : area_factor(x[1], x[0]));
    }
    for (size_t i = 2; i < k; ++i)
      d.from_light[i] = direction_pdf(x[i - 2], x[i - 1], x[i], false) * area_factor(x[i - 1], x[i]);
    d.from_camera[k] = scene_.camera().pdf_position();
    d.from_camera[k - 1] = scene_.camera().pdf_direction(towards(x[k], x[k - 1])) * area_factor(x[k], x[k - 1]);
    for (size_t i = k - 1; i-- > 0;)
      d.from_camera[i] = direction_pdf(x[i + 2], x[i + 1], x[i], true) * area_factor(x[i + 1], x[i]);
    return d;
  }
  /// Converts a density per unit solid angle at a to one per unit area at b.
  double area_factor(const Vertex& a, const Vertex& b) const {
    return infinite(b) ? 1 : cosine(b, towards(a, b)) / distance2(a, b);
  }

  /// Density of the path for technique s; 0 if it cannot find the path.
  double density(const Path& x, const Densities& d, int s) const {
    const int k = static_cast<int>(x.size()) - 1, t = k + 1 - s;
    const auto smooth = [&](int i) { return !x[i].event || !x[i].event->is_delta(); };
    if (t < 1 || (t == 1 && (k == 1 || !(settings_.light_paths_per_spp > 0)))) return 0;
    if (s == 0 && x[0].light->is_delta()) return 0;
    if (s == 1 && !smooth(1)) return 0;
    if (s > 1 && (!smooth(s - 1) || (t > 1 && !smooth(s)))) return 0;
    double p = t == 1 ? settings_.light_paths_per_spp : 1;
    for (int i = 0; i <= k; ++i) p *= i >= s ? d.from_camera[i] : s == 1 ? d.direct : d.from_light[i];
    return p;
  }

  /// Measurement contribution of the whole path, per product of areas, without visibility.
  Spectrum contribution(const Path& x) const {
    const size_t k = x.size() - 1;
    const Emitter& light = *x[0].light;
    const Vec3 w = towards(x[0], x[1]);
    Spectrum value;
    double geometry = 1;
    if (light.is_environment()) {
      value = light.environment(-w).radiance;
    } else if (light.is_delta()) {  // intensity, or irradiance across the direction
      const EmitterSample sample = light.sample_towards(x[1].hit.p, {0.5f, 0.5f}, 0.5f);
      value = sample.radiance;
      if (light.is_delta_position()) geometry *= distance2(x[0], x[1]);
    } else {
      value = light.surface_radiance(x[0].hit, w);
      geometry *= cosine(x[0], w);
    }
    for (size_t i = 0; i < k; ++i) {  // the edge from x[i] to x[i + 1]: its length, and the cosine at x[i + 1]
      const Vec3 edge = towards(x[i], x[i + 1]);
      if (!infinite(x[i])) geometry /= distance2(x[i], x[i + 1]);
      if (i + 1 == k) break;
      const Vertex& v = x[i + 1];
      const Vec3 to_light = -edge, to_camera = towards(v, x[i + 2]);
      value *= scattered(v, to_camera, to_light) * static_cast<float>(cosine(v, to_camera));
      // scattered() includes the cosine on the light's side.
    }
    const Vec3 out = towards(x[k], x[k - 1]);
    // Importance times the cosine at the lens is the density of directions over the film.
    return value * static_cast<float>(geometry) * (scene_.camera().pdf_direction(out) * scene_.camera().pdf_position());
  }

  /// f |cos| towards the light for radiance; for a delta event its weight times its probability.
  Spectrum scattered(const Vertex& v, const Vec3& to_camera, const Vec3& to_light) const {
    const Vec3 wo = local(v, to_camera), wi = local(v, to_light);
    const BsdfClosure* bsdf = bind(v, wo, TransportMode::kRadiance);
    if (!v.event || !v.event->is_delta()) return bsdf->eval(wo, wi).value;
    if (v.from_camera) return v.event->weight * v.event->pdf;
    for (int i = 0; i < 1024; ++i) {  // the lobe as the camera's side samples it
      const BsdfSample s = bsdf->sample(wo, (static_cast<float>(i) + 0.5f) / 1024, {0.5f, 0.5f});
      if (s.valid() && s.is_delta() && s.lobe == v.event->lobe && length_squared(s.wi - wi) < 1e-4f)
        return s.weight * s.pdf;
    }
    return {};
  }

  Contribution evaluate(const Path& x, int s) const {
    const Densities d = densities(x);
    const double p = density(x, d, s);
    if (!(p > 0)) return {};
    double sum = 0;
    for (int i = 0; i < static_cast<int>(x.size()); ++i) sum += std::pow(density(x, d, i) / p, settings_.exponent);
    const double per_sample = s + 1 == static_cast<int>(x.size()) ? p / settings_.light_paths_per_spp : p;
    return {contribution(x) * static_cast<float>(1 / per_sample), 1 / sum};
  }

  const Scene& scene_;
  Settings settings_;
  UniformLights nee_;
  PowerLights emission_;
  mutable Arena arena_;
};

}  // namespace covary::reference_bdpt
