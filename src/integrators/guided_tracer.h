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
  float fraction;                        ///< of guided directions
  bool learned_fraction;                 ///< each leaf has its own instead
  float min_roughness;                   ///< BSDF lobes that are less rough are not guided
  const CoefficientTable* table;         ///< coefficients of control variates; without cells: no control
  std::span<const uint32_t> cluster_of;  ///< for each light
};

/// The correct ones.
struct GuidedParts {
  /// Density of the mixture of BSDF and guide, with the share `g` of guided directions.
  static float mixture_pdf(float g, float pdf_bsdf, float pdf_guide) { return (1 - g) * pdf_bsdf + g * pdf_guide; }
  /// Whether a direction that failed counts as a sample of the control.
  static constexpr bool kCountFailed = true;
  /// The cell of the coefficients for a direction at a vertex whose Σ N β is that of `cell`.
  static uint32_t direction_cell(uint32_t cell, uint32_t /*n_cells*/) { return cell; }
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

/// The lobes of a leaf for a vertex at `p` whose normal on the side of the path is `normal`, and the fraction of
/// directions that they draw there. False where the leaf does not guide.
inline bool guide_at(const GuidedScene& guided, uint32_t leaf_number, const Vec3& p, const Vec3& normal, float share,
                     float& fraction, VmfLobes& lobes) {
  const GuidingLeaf& leaf = guided.field->leaf(leaf_number);
  if (share == 0 || leaf.mixture.lobes.n == 0) return false;
  fraction = share * (guided.learned_fraction ? leaf.fraction : guided.fraction);
  lobes = leaf.mixture.at(p).times_cosine(normal);
  return true;
}

template <typename Parts>
class GuidedTracer {
 public:
  GuidedTracer(const Scene& scene, const GuidedScene& guided, const PathLengthSettings& lengths,
               std::span<CameraSample> samples, PathContext& context)
      : scene_(scene),
        guided_(guided),
        field_(*guided.field),
        table_(*guided.table),
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
      if (batch_.recording_control) begin_control_steps();
      for (const uint32_t sample : batch_.ended) close(sample);
    }
    if (batch_.recording) finish_steps();
    if (batch_.recording_control) finish_control_steps();
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

  /// Adds the emission of what the path's ray met, which closes the vertex from which the ray came.
  void arrive(int depth, size_t i) {
    const Path& path = batch_.paths[i];
    if (path.recorded) batch_.last_step(path.sample).sample.inverse_distance = path.found ? 1 / batch_.hits[i].t : 0;
    float r_light = 0;
    uint32_t light = ControlledSample::kNoLight;
    add_emission(depth, i, r_light, light);
    if (!batch_.vertices[path.sample].active) return;
    take_direction(path.sample, r_light, light);
    close(path.sample);
  }

  /// Sets `r_light` and `light` where a light sample could have found what was met.
  void add_emission(int depth, size_t i, float& r_light, uint32_t& light_cluster) {
    const Path& path = batch_.paths[i];
    const SurfaceHit& hit = batch_.hits[i];
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
    float pdf_light = light.pdf_solid_angle;
    if (path.found) {
      const uint32_t number = guided_.lights->number_of(hit);
      pdf_light = (*guided_.lights)[number].pmf * LightSet::pdf_solid_angle(path.previous_p, hit);
      light_cluster = guided_.cluster_of[number];
    }
    const float r = mis::balance(path.previous_pdf, pdf_light);
    r_light = 1 - r;
    samples_[path.sample].radiance += radiance * r;
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
    batch_.alive.clear(), batch_.ended.clear(), batch_.connection_parts.clear();
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
      open(path);
      if (connecting_ && batch_.choices[i].open) {
        if (!guided_.lights->empty())
          connect(path, hit, wo, *bsdf, batch_.lights[i], (*guided_.lights)[batch_.choices[i].light].pmf,
                  guided_.cluster_of[batch_.choices[i].light]);
        if (guided_.environment) connect(path, hit, wo, *bsdf, batch_.environments[i], 1, ControlledSample::kNoLight);
      }

      const Direction direction = sample_direction(hit, wo, *bsdf, random, path.last_vertex);
      const BsdfSample& next = direction.sample;
      path.recorded = false;
      const bool ends = !next.valid() || is_black(next.weight);
      if (batch_.vertices[path.sample].active) keep_direction(path.sample, hit, direction, !ends);
      if (ends) {
        if (!batch_.vertices[path.sample].active) continue;
        if (Parts::kCountFailed) take_direction(path.sample, 0, ControlledSample::kNoLight);
        batch_.ended.push_back(path.sample);
        continue;
      }
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
    if (field_.n_leaves() == 0) return;
    guide_.leaf = batch_.leaves[i];
    guide_at(guided_, guide_.leaf, hit.p, wo.z > 0 ? hit.frame.n : -hit.frame.n, guide_.share, guide_.fraction,
             guide_.lobes);
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

  /// Next-event estimation: f cos L / p, if nothing lies between. `pmf`: with which the light of `cluster` was chosen;
  /// kNoLight: the environment.
  void connect(const Path& path, const SurfaceHit& hit, const Vec3& wo, const BsdfClosure& bsdf,
               const EmitterSample& light, float pmf, uint32_t cluster) {
    const bool active = batch_.vertices[path.sample].active;
    if (light.pdf_solid_angle > 0 && !is_black(light.radiance)) {
      const BsdfValue f = bsdf.eval(wo, hit.frame.to_local(light.wi));
      if (!is_black(f.value)) {
        GuidedBatch::ConnectionParts parts;
        float pdf_direction = 0;
        if (!light.is_delta) {
          if (active) {
            pdf_direction = densities(f.pdf_solid_angle, light.wi);
            parts.direction = weighted_coefficients(path.sample, pdf_direction);
          } else {
            pdf_direction = guide_.mixture_pdf(f.pdf_solid_angle, guide_.pdf(light.wi));
          }
        }
        const float pdf = pmf * light.pdf_solid_angle;
        const Spectrum value = f.value * light.radiance * (1 / (pdf + pdf_direction));
        const size_t n = batch_.n_connections++;
        const auto place = static_cast<uint32_t>(batch_.connection_parts.size());
        make_in_place(batch_.connections[n], [&] {
          return GuidedBatch::Connection{path.throughput * value, path.sample, place};
        });
        make_in_place(batch_.shadow_rays[n], [&] { return shadow_ray(hit, light); });
        if (!active) return;
        parts.value = value, parts.light = cluster, parts.r_light = mis::balance(pdf, pdf_direction);
        if (batch_.recording_control)
          for (uint32_t k = 0; k < GuidedTechnique::kCount; ++k)
            parts.r[k] = pdf_direction > 0 ? densities_[k] / (pdf + pdf_direction) : 0;
        batch_.connection_parts.push_back(parts);
        return;
      }
    }
    if (active) take_light(path.sample, {{}, cluster, 1, {}, {}});
  }

  /// Adds the light samples that nothing hides.
  void trace_connections() {
    const size_t n = batch_.n_connections;
    scene_.occluded(std::span(batch_.shadow_rays).first(n), batch_.blocked);
    context_.n_rays += n;
    for (size_t i = 0; i < n; ++i) {
      const GuidedBatch::Connection& connection = batch_.connections[i];
      if (!batch_.blocked[i]) samples_[connection.sample].radiance += connection.radiance;
      if (!batch_.vertices[connection.sample].active) continue;
      const GuidedBatch::ConnectionParts& parts = batch_.connection_parts[connection.place];
      take_light(connection.sample,
                 batch_.blocked[i] ? GuidedBatch::ConnectionParts{{}, parts.light, 1, {}, {}} : parts);
    }
    batch_.n_connections = 0;
  }

  /// Begins the control of a vertex: Σ N β. Only directions that are guided have one.
  void open(const Path& path) {
    ControlledVertexState& vertex = batch_.vertices[path.sample];
    vertex.active = false;
    const bool learns = batch_.recording_control && batch_.control_steps.size() < kMaxControlSteps * samples_.size();
    if (guide_.fraction == 0 || (guided_.lights && !connecting_) || (!learns && table_.n_cells() == 0)) return;
    const CellKey key = control_key(guide_.leaf);
    vertex.cell = table_.n_cells() > 0 ? table_.find(key) : CoefficientTable::kNone;
    if (!learns && (vertex.cell == CoefficientTable::kNone || is_black(table_.scale(vertex.cell)))) return;
    vertex.active = true;
    vertex.throughput = path.throughput;
    vertex.control = Spectrum();
    if (vertex.cell != CoefficientTable::kNone) {
      const GuidingLeaf& leaf = field_.leaf(guide_.leaf);
      vertex.control = table_.dense(vertex.cell, GuidedTechnique::kBsdf) * (1 - guide_.fraction);
      for (int k = 0; k < guide_.lobes.n; ++k)
        vertex.control +=
            table_.dense(vertex.cell, GuidedTechnique::of(leaf, k)) * (guide_.fraction * guide_.lobes.weight[k]);
      if (guided_.lights) {
        vertex.control += table_.light_sum(vertex.cell);
        if (guided_.environment) vertex.control += table_.dense(vertex.cell, GuidedTechnique::kEnvironment);
      }
    }
    vertex.step = ~0u;
    if (!learns) return;
    vertex.step = static_cast<uint32_t>(batch_.control_steps.size());
    ControlStep& step = batch_.control_steps.emplace_back();
    batch_.control_samples.push_back(path.sample);
    const Spectrum importance = context_.importance.empty() ? Spectrum(1) : context_.importance[path.sample];
    step.cell = batch_.sums.cell(key);
    step.weight = variance_weight(path.throughput, importance);
    step.throughput = path.throughput;
    step.held_out = vertex.cell != CoefficientTable::kNone;
  }

  /// Sets densities_ to N λ of the techniques that draw directions; returns their sum.
  float densities(float pdf_bsdf, const Vec3& w) {
    alignas(32) float parts[VmfLobes::kMax];
    const float pdf_guide = guide_.lobes.pdfs(w, parts);
    densities_.fill(0);
    densities_[GuidedTechnique::kBsdf] = (1 - guide_.fraction) * pdf_bsdf;
    const GuidingLeaf& leaf = field_.leaf(guide_.leaf);
    for (int k = 0; k < guide_.lobes.n; ++k) densities_[GuidedTechnique::of(leaf, k)] += guide_.fraction * parts[k];
    return (1 - guide_.fraction) * pdf_bsdf + guide_.fraction * pdf_guide;
  }

  /// Σ β N λ / Σ N λ over densities_, whose sum is `pdf`.
  Spectrum weighted_coefficients(uint32_t sample, float pdf) const {
    Spectrum sum;
    if (batch_.vertices[sample].cell == CoefficientTable::kNone || !(pdf > 0)) return sum;
    const uint32_t cell = Parts::direction_cell(batch_.vertices[sample].cell, table_.n_cells());
    for (uint32_t k = 0; k <= GuidedTechnique::kBsdf; ++k)
      if (densities_[k] > 0) sum += table_.dense(cell, k) * (densities_[k] / pdf);
    return sum;
  }

  /// Keeps what the control of the direction sample needs; it is taken when the next surface is found.
  void keep_direction(uint32_t sample, const SurfaceHit& hit, const Direction& direction, bool followed) {
    float pdf = 1;
    if (direction.sample.valid() && !direction.sample.is_delta()) {
      pdf = densities(direction.pdf_bsdf, hit.frame.to_world(direction.sample.wi));
    } else {  // nothing else finds it
      densities_.fill(0);
      densities_[GuidedTechnique::kBsdf] = 1;
    }
    ControlledVertexState& vertex = batch_.vertices[sample];
    vertex.direction = weighted_coefficients(sample, pdf);
    if (vertex.step == ~0u) return;
    ControlStep& step = batch_.control_steps[vertex.step];
    for (uint32_t k = 0; k < GuidedTechnique::kCount; ++k) step.r[k] = densities_[k] / pdf;
    step.followed = followed;
  }

  /// β of a cluster of lights, or of the environment.
  Spectrum light_coefficient(uint32_t cell, uint32_t cluster) const {
    return cluster == ControlledSample::kNoLight ? table_.dense(cell, GuidedTechnique::kEnvironment)
                                                 : table_.light(cell, cluster);
  }

  /// Subtracts Σ β r of the direction sample, which light samples of `cluster` find with balance weight `r_light`.
  void take_direction(uint32_t sample, float r_light, uint32_t cluster) {
    ControlledVertexState& vertex = batch_.vertices[sample];
    if (vertex.cell != CoefficientTable::kNone) {
      Spectrum sum = vertex.direction * (1 - r_light);
      if (r_light > 0) sum += light_coefficient(vertex.cell, cluster) * r_light;
      vertex.control = vertex.control - sum;
    }
    if (vertex.step == ~0u) return;
    ControlStep& step = batch_.control_steps[vertex.step];
    for (float& r : step.r) r *= 1 - r_light;
    step.light = cluster, step.r_light = r_light;
  }

  /// The same of a light sample.
  void take_light(uint32_t sample, const GuidedBatch::ConnectionParts& parts) {
    ControlledVertexState& vertex = batch_.vertices[sample];
    if (vertex.cell != CoefficientTable::kNone)
      vertex.control = vertex.control - (light_coefficient(vertex.cell, parts.light) * parts.r_light +
                                         parts.direction * (1 - parts.r_light));
    if (vertex.step == ~0u) return;
    ControlStep& step = batch_.control_steps[vertex.step];
    step.plain += parts.value;
    add_to_sums(step, parts.value, parts.light, parts.r_light, parts.r);
  }

  void add_to_sums(const ControlStep& step, const Spectrum& value, uint32_t light, float r_light,
                   TechniqueDensities r) {
    const bool of_light = light != ControlledSample::kNoLight && r_light > 0;
    if (!of_light && r_light > 0) r[GuidedTechnique::kEnvironment] = r_light;
    batch_.sums.add(step.cell, step.weight,
                    {value, of_light ? light : ControlledSample::kNoLight, of_light ? r_light : 0, r});
  }

  /// Ends the control of a vertex.
  void close(uint32_t sample) {
    ControlledVertexState& vertex = batch_.vertices[sample];
    vertex.active = false;
    if (vertex.cell == CoefficientTable::kNone) return;
    const Spectrum own = vertex.throughput * table_.scale(vertex.cell) * vertex.control;
    samples_[sample].radiance += own;
    if (vertex.step == ~0u) return;
    batch_.control_steps[vertex.step].own = own;
    batch_.control_steps[vertex.step].control = vertex.control;
  }

  /// Like begin_steps().
  void begin_control_steps() {
    for (const Path& path : batch_.paths)
      if (const ControlledVertexState& vertex = batch_.vertices[path.sample]; vertex.active && vertex.step != ~0u)
        batch_.control_steps[vertex.step].before = samples_[path.sample].radiance;
  }

  /// Adds the direction samples to the sums: what the path gained behind each of them, without the vertex's control.
  void finish_control_steps() {
    for (size_t i = 0; i < batch_.control_steps.size(); ++i) {
      ControlStep& step = batch_.control_steps[i];
      Spectrum value;
      if (step.followed) {
        const Spectrum gained = samples_[batch_.control_samples[i]].radiance - step.before - step.own;
        for (int c = 0; c < 3; ++c) value[c] = step.throughput[c] > 0 ? gained[c] / step.throughput[c] : 0;
      }
      add_to_sums(step, value, step.light, step.r_light, step.r);
      if (step.held_out) batch_.sums.add_held_out(step.cell, step.weight, step.plain + value, step.control);
    }
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
  const CoefficientTable& table_;
  const PathLengthSettings& lengths_;
  std::span<CameraSample> samples_;
  PathContext& context_;
  GuidedBatch& batch_;
  static constexpr size_t kMaxControlSteps = 16;  // of a path, in the mean over a batch
  bool connecting_ = false;                       // vertices take light samples
  Guide guide_;                                   // of the vertex at hand
  TechniqueDensities densities_{};                // of the direction at hand
};

}  // namespace covary
