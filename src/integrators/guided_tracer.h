// SPDX-License-Identifier: Apache-2.0
// Path tracing that draws directions from a mixture of the BSDF and of what a guiding field has learnt [Ruppert2020].
// At a vertex a share g of directions comes from the lobes of the field's leaf, seen from the vertex and multiplied by
// the cosine; the density of every direction, whichever drew it, is that of the mixture,
//
//     p(w) = (1 − g) p_bsdf(w) + g p_guide(w),
//
// and so is the one that light samples are weighted against (balance heuristic). Hence the estimate is unbiased for any
// field. g is the fraction of guided directions times the probability of those BSDF lobes that guiding can replace:
// neither delta lobes nor narrow ones. Russian roulette looks at the throughput that the path would have if the BSDF
// had drawn its directions: guided ones of high density have little, and that is no reason to end their paths.
//
// `Parts` says what tests exchange to plant bugs; see GuidedParts.
#pragma once

#include <cmath>
#include <span>

#include "core/in_place.h"
#include "integrators/guided_batch.h"
#include "integrators/light_selection.h"
#include "integrators/mis.h"
#include "integrators/path_steps.h"
#include "integrators/primary_sample.h"
#include "integrators/roulette.h"
#include "sampling/light_set.h"

namespace covary {

/// What does not change while paths are traced.
struct GuidedScene {
  const LightSet* lights;      ///< sampled at each vertex; null: no light samples
  const Emitter* environment;  ///< as it is sampled, or null
  const GuidingField* field;
  float fraction;         ///< of guided directions
  bool learned_fraction;  ///< each leaf has its own instead
  float min_roughness;    ///< BSDF lobes that are less rough are not guided
};

/// The correct ones.
struct GuidedParts {
  /// Density of the mixture of BSDF and guide, with the share `g` of guided directions.
  static float mixture_pdf(float g, float pdf_bsdf, float pdf_guide) { return (1 - g) * pdf_bsdf + g * pdf_guide; }
  /// A direction of the lobes `guide` of a leaf.
  static Vec3 sample_guide(const VmfLobes& guide, const GuidingField&, uint32_t /*leaf*/, float u_lobe, Vec2 u) {
    return guide.sample(u_lobe, u);
  }
};

/// Addresses of the numbers of environment samples: those of the vertex, apart from all others.
inline constexpr uint32_t kGuidedEnvironmentVertices = 1u << 21;

/// Probability of the BSDF lobes that guiding can replace: those with a density in the mirror direction that is at most
/// that of a microfacet lobe of the given roughness α, D / (4 cos θ) <= 1 / (4 π α² cos θ) [Walter2007] Eq. (14). Delta
/// lobes have none. 0 for surfaces that transmit light other than by delta lobes.
inline float guidable_share(const BsdfClosure& bsdf, const Vec3& wo, float min_roughness) {
  if (bsdf.flags() & (kGlossyTransmission | kDiffuseTransmission)) return 0;
  float pmfs[kMaxLobes], pdfs[kMaxLobes];
  bsdf.lobe_pmfs(wo, pmfs);
  bsdf.lobe_pdfs(wo, reflect(wo), pdfs);
  const float inverse_limit = 4 * kPi * sqr(min_roughness) * std::abs(wo.z);
  float share = 0;
  for (int l = 0; l < bsdf.n_lobes(); ++l)
    if (pdfs[l] > 0 && pdfs[l] * inverse_limit <= 1) share += pmfs[l];
  return std::min(share, 1.0f);
}

template <typename Parts>
class GuidedTracer {
 public:
  GuidedTracer(const Scene& scene, const GuidedScene& guided, const PathLengthSettings& lengths,
               std::span<CameraSample> samples, PathContext& context)
      : scene_(scene),
        guided_(guided),
        field_(*guided.field),
        lengths_(lengths),
        samples_(samples),
        context_(context),
        batch_(context.state_as<GuidedBatch>()) {}

  // All paths of the batch advance together, in short loops, as in PathTracer.
  void trace() {
    if (lengths_.max_depth <= 0) return;
    batch_.start(samples_.size());
    for (uint32_t i = 0; i < samples_.size(); ++i) batch_.rays[i] = samples_[i].ray, batch_.paths[i].sample = i;
    const bool any_light = guided_.lights && (!guided_.lights->empty() || guided_.environment);
    for (int depth = 0; !batch_.paths.empty(); ++depth) {
      find_surfaces(scene_, depth, lengths_.hide_emitters, batch_, context_);
      for (size_t i = 0; i < batch_.paths.size(); ++i) arrive(depth, i);
      if (depth + 1 >= lengths_.max_depth) break;
      keep_paths(depth);
      find_leaves();
      connecting_ = any_light && depth + 2 >= lengths_.min_depth;
      if (connecting_) choose_lights();
      scatter(depth);
      if (connecting_) trace_connections();
      if (batch_.recording) begin_steps();
    }
    if (batch_.recording) finish_steps();
  }

 private:
  using Path = GuidedBatch::Path;

  /// How directions are drawn at a vertex.
  struct Guide {
    float share = 0;     ///< probability of the BSDF lobes that guiding can replace
    float fraction = 0;  ///< g; 0: the BSDF alone
    uint32_t leaf = 0;
    VmfLobes lobes;
    float pdf(const Vec3& w) const { return fraction > 0 ? lobes.pdf(w) : 0; }
    float mixture_pdf(float pdf_bsdf, float pdf_guide) const {
      return fraction > 0 ? Parts::mixture_pdf(fraction, pdf_bsdf, pdf_guide) : pdf_bsdf;
    }
  };

  /// A direction with its densities.
  struct Direction {
    BsdfSample sample;  ///< weight and pdf are those of the mixture
    float pdf_bsdf = 0, pdf_guide = 0;
  };

  /// Adds the emission of what the path's ray met.
  void arrive(int depth, size_t i) {
    const Path& path = batch_.paths[i];
    const SurfaceHit& hit = batch_.hits[i];
    if (path.recorded) batch_.last_step(path.sample).sample.inverse_distance = path.found ? 1 / hit.t : 0;
    if (depth + 1 < lengths_.min_depth) return;
    const Emitter* emitter = path.found ? hit.emitter : guided_.environment;
    if (!emitter || (!path.found && lengths_.hide_emitters && path.only_null)) return;
    const EnvironmentLight light = path.found ? EnvironmentLight{emitter->surface_radiance(hit, -batch_.rays[i].d)}
                                              : emitter->environment(batch_.rays[i].d);
    if (is_black(light.radiance)) return;
    const Spectrum radiance = path.throughput * light.radiance;
    if (path.previous_delta || !guided_.lights) {
      samples_[path.sample].radiance += radiance;
      return;
    }
    const float pdf_light = path.found ? (*guided_.lights)[guided_.lights->number_of(hit)].pmf *
                                             LightSet::pdf_solid_angle(path.previous_p, hit)
                                       : light.pdf_solid_angle;
    samples_[path.sample].radiance += radiance * mis::balance(path.previous_pdf, pdf_light);
  }

  /// Ends paths that met no surface, and some of the others by Russian roulette.
  void keep_paths(int depth) {
    size_t n_kept = 0;
    for (size_t i = 0; i < batch_.paths.size(); ++i) {
      Path& path = batch_.paths[i];
      if (!path.found || (depth >= lengths_.rr_depth && !survives(path))) continue;
      if (n_kept != i)
        batch_.paths[n_kept] = path, batch_.rays[n_kept] = batch_.rays[i], batch_.hits[n_kept] = batch_.hits[i];
      ++n_kept;
    }
    batch_.resize(n_kept);
  }

  bool survives(Path& path) {
    CameraSample& sample = samples_[path.sample];
    const float survival = roulette::survival_probability(path.bsdf_throughput, path.eta, sample.random.sampling());
    if (sample.random.get_1d(path.last_vertex, Event::kRoulette) < survival) {
      path.throughput *= roulette::survivor_weight(survival);
      path.bsdf_throughput *= roulette::survivor_weight(survival);
      return true;
    }
    if (std::isnan(survival)) sample.radiance = path.throughput;  // a bad sample, not a black one
    return false;
  }

  /// The leaves in which the vertices lie, before they are read.
  void find_leaves() {
    if (field_.n_leaves() == 0) return;
    for (size_t i = 0; i < batch_.paths.size(); ++i) {
      if (!(batch_.hits[i].bsdf_flags & kSmooth)) continue;
      batch_.leaves[i] = field_.find(batch_.hits[i].p);
      const GuidingLeaf& leaf = field_.leaf(batch_.leaves[i]);
      for (size_t line = 0; line < sizeof leaf; line += 64)
        __builtin_prefetch(reinterpret_cast<const char*>(&leaf) + line);
    }
  }

  /// What each vertex is to sample. All choices come first, so that memory answers to one while the others are made.
  void choose_lights() {
    for (size_t i = 0; i < batch_.paths.size(); ++i) {
      GuidedBatch::LightChoice& choice = batch_.choices[i];
      choice.open = batch_.hits[i].bsdf_flags & kSmooth;
      if (!choice.open) continue;
      const PathRandom& random = samples_[batch_.paths[i].sample].random;
      const uint32_t vertex = kFirstSurfaceVertex + batch_.paths[i].n_smooth;
      if (!guided_.lights->empty()) {
        choice.light = guided_.lights->select(random.get_1d(vertex, Event::kLightChoice));
        choice.u = random.get_2d(vertex, Event::kLightPosition);
        choice.u_primitive = random.get_1d(vertex, Event::kLightPrimitive);
      }
      if (!guided_.environment) continue;
      choice.u_environment = random.get_2d(kGuidedEnvironmentVertices + vertex, Event::kLightPosition);
      guided_.environment->prefetch(choice.u_environment, PrefetchStep::kTable);
    }
    if (guided_.environment)
      for (size_t i = 0; i < batch_.paths.size(); ++i)
        if (batch_.choices[i].open)
          guided_.environment->prefetch(batch_.choices[i].u_environment, PrefetchStep::kValues);
    for (size_t i = 0; i < batch_.paths.size(); ++i) sample_lights(i);
  }

  void sample_lights(size_t i) {
    const GuidedBatch::LightChoice& choice = batch_.choices[i];
    batch_.lights[i].pdf_solid_angle = batch_.environments[i].pdf_solid_angle = 0;
    if (!choice.open) return;
    const Vec3& p = batch_.hits[i].p;
    if (!guided_.lights->empty())
      make_in_place(batch_.lights[i],
                    [&] { return guided_.lights->sample(choice.light, p, choice.u, choice.u_primitive); });
    if (guided_.environment)
      make_in_place(batch_.environments[i],
                    [&] { return guided_.environment->sample_towards(p, choice.u_environment, 0); });
  }

  /// Evaluates the surfaces: connections to the light samples, and the next rays. Paths that end are removed.
  void scatter(int depth) {
    batch_.alive.clear();
    for (uint32_t i = 0; i < batch_.paths.size(); ++i) {
      Path& path = batch_.paths[i];
      const SurfaceHit& hit = batch_.hits[i];
      const PathRandom& random = samples_[path.sample].random;
      const Vec3 wo = hit.frame.to_local(-batch_.rays[i].d);
      const bool smooth = hit.bsdf_flags & kSmooth;
      path.last_vertex = smooth ? kFirstSurfaceVertex + path.n_smooth++ : kDeltaVertices + depth;
      context_.arena.reset();
      const BsdfClosure* bsdf = hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, context_.arena);
      make_guide(hit, wo, *bsdf, smooth, i);
      if (connecting_ && batch_.choices[i].open) {
        if (!guided_.lights->empty())
          connect(path, hit, wo, *bsdf, batch_.lights[i], (*guided_.lights)[batch_.choices[i].light].pmf);
        if (guided_.environment) connect(path, hit, wo, *bsdf, batch_.environments[i], 1);
      }

      const Direction direction = sample_direction(hit, wo, *bsdf, random, path.last_vertex);
      const BsdfSample& next = direction.sample;
      path.recorded = false;
      if (!next.valid() || is_black(next.weight)) continue;
      path.throughput *= next.weight;
      path.bsdf_throughput *= next.weight * (direction.pdf_bsdf > 0 ? next.pdf / direction.pdf_bsdf : 1);
      path.eta *= next.eta;
      if (!(next.flags & kNullTransmission)) path.only_null = false;
      const Vec3 wi = hit.frame.to_world(next.wi);
      path.previous_p = hit.p;
      path.previous_pdf = next.pdf;
      path.previous_delta = next.is_delta();
      make_in_place(batch_.rays[i], [&] { return Ray{offset_origin(hit.p, hit.ng, wi), wi, kInfinity}; });
      if (batch_.recording && !next.is_delta() && guide_.share > 0) record(path, hit.p, wi, direction);
      batch_.alive.push_back(i);
    }
    for (size_t n = 0; n < batch_.alive.size(); ++n)
      if (const uint32_t i = batch_.alive[n]; i != n)
        batch_.paths[n] = batch_.paths[i], batch_.rays[n] = batch_.rays[i];
    batch_.resize(batch_.alive.size());
  }

  /// Sets guide_ for the vertex of path i.
  void make_guide(const SurfaceHit& hit, const Vec3& wo, const BsdfClosure& bsdf, bool smooth, uint32_t i) {
    guide_.fraction = guide_.share = 0;
    if (!smooth || (field_.n_leaves() == 0 && !batch_.recording)) return;
    guide_.share = guidable_share(bsdf, wo, guided_.min_roughness);
    if (field_.n_leaves() == 0 || guide_.share == 0) return;
    const GuidingLeaf& leaf = field_.leaf(batch_.leaves[i]);
    if (leaf.mixture.lobes.n == 0) return;
    guide_.leaf = batch_.leaves[i];
    guide_.fraction = guide_.share * (guided_.learned_fraction ? leaf.fraction : guided_.fraction);
    guide_.lobes = leaf.mixture.at(hit.p).times_cosine(wo.z > 0 ? hit.frame.n : -hit.frame.n);
  }

  Direction sample_direction(const SurfaceHit& hit, const Vec3& wo, const BsdfClosure& bsdf, const PathRandom& random,
                             uint32_t vertex) const {
    const float g = guide_.fraction;
    Direction direction;
    BsdfSample& next = direction.sample;
    const float u = g > 0 ? random.get_1d(vertex, Event::kTechnique) : 1;
    if (u < g) {
      const Vec3 wi = Parts::sample_guide(guide_.lobes, field_, guide_.leaf, std::min(u / g, kOneMinusEpsilon),
                                          random.get_2d(vertex, Event::kGuide));
      next.wi = hit.frame.to_local(wi);
      const BsdfValue f = bsdf.eval(wo, next.wi);
      direction.pdf_bsdf = f.pdf_solid_angle, direction.pdf_guide = guide_.pdf(wi);
      next.flags = kDiffuseReflection;
      next.pdf = guide_.mixture_pdf(direction.pdf_bsdf, direction.pdf_guide);
      if (next.pdf > 0) next.weight = f.value * (1 / next.pdf);
      return direction;
    }
    next = bsdf.sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
    direction.pdf_bsdf = next.pdf;
    if (g == 0 || !next.valid()) return direction;
    if (!next.is_delta()) direction.pdf_guide = guide_.pdf(hit.frame.to_world(next.wi));
    next.pdf = guide_.mixture_pdf(direction.pdf_bsdf, direction.pdf_guide);
    next.weight *= direction.pdf_bsdf / next.pdf;
    return direction;
  }

  /// Next-event estimation: f cos L / p, if nothing lies between. `pmf`: with which the light was chosen.
  void connect(const Path& path, const SurfaceHit& hit, const Vec3& wo, const BsdfClosure& bsdf,
               const EmitterSample& light, float pmf) {
    if (!(light.pdf_solid_angle > 0) || is_black(light.radiance)) return;
    const BsdfValue f = bsdf.eval(wo, hit.frame.to_local(light.wi));
    if (is_black(f.value)) return;
    const float pdf_direction = light.is_delta ? 0 : guide_.mixture_pdf(f.pdf_solid_angle, guide_.pdf(light.wi));
    const float pdf = pmf * light.pdf_solid_angle;
    const size_t n = batch_.n_connections++;
    make_in_place(batch_.connections[n], [&] {
      return GuidedBatch::Connection{path.throughput * f.value * light.radiance * (1 / (pdf + pdf_direction)),
                                     path.sample};
    });
    make_in_place(batch_.shadow_rays[n], [&] { return shadow_ray(hit, light); });
  }

  /// Adds the light samples that nothing hides.
  void trace_connections() {
    const size_t n = batch_.n_connections;
    scene_.occluded(std::span(batch_.shadow_rays).first(n), batch_.blocked);
    context_.n_rays += n;
    for (size_t i = 0; i < n; ++i)
      if (!batch_.blocked[i]) samples_[batch_.connections[i].sample].radiance += batch_.connections[i].radiance;
    batch_.n_connections = 0;
  }

  /// Appends a direction sample to the path's trail.
  void record(Path& path, const Vec3& p, const Vec3& wi, const Direction& direction) {
    uint32_t& n = batch_.n_steps[path.sample];
    if (n == GuidedBatch::kMaxSteps) return;
    ++n;
    path.recorded = true;
    GuidedBatch::Step& step = batch_.last_step(path.sample);
    step.throughput = path.throughput;
    step.sample = {.position = p,
                   .direction = wi,
                   .pdf = direction.sample.pdf,
                   .pdf_bsdf = direction.pdf_bsdf,
                   .pdf_guide = direction.pdf_guide,
                   .share = guide_.share};
  }

  /// The light samples of their own vertices are taken: what is added from now on came along the directions recorded.
  void begin_steps() {
    for (const Path& path : batch_.paths)
      if (path.recorded) batch_.last_step(path.sample).before = samples_[path.sample].radiance;
  }

  /// The radiance that arrived along each direction recorded: what the path gained behind it, over its throughput.
  void finish_steps() {
    for (uint32_t i = 0; i < samples_.size(); ++i)
      for (uint32_t n = 0; n < batch_.n_steps[i]; ++n) {
        GuidedBatch::Step& step = batch_.steps[i * GuidedBatch::kMaxSteps + n];
        const Spectrum gained = samples_[i].radiance - step.before;
        float radiance = 0;
        for (int c = 0; c < 3; ++c)
          if (step.throughput[c] > 0) radiance += std::max(gained[c], 0.0f) / step.throughput[c] * (1.0f / 3);
        step.sample.weight = radiance / step.sample.pdf;
        batch_.records.push_back(step.sample);
      }
  }

  const Scene& scene_;
  const GuidedScene& guided_;
  const GuidingField& field_;
  const PathLengthSettings& lengths_;
  std::span<CameraSample> samples_;
  PathContext& context_;
  GuidedBatch& batch_;
  bool connecting_ = false;  // vertices take light samples
  Guide guide_;              // of the vertex at hand
};

}  // namespace covary
