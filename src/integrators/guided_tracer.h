// SPDX-License-Identifier: Apache-2.0
// Path tracing that samples directions from a mixture of the BSDF and a learnt guiding field [Ruppert2020]. At a
// vertex, a fraction g of directions comes from the lobes of the field's leaf, as seen from the vertex and multiplied
// by the cosine; the density of every direction, whichever technique sampled it, is that of the mixture,
//
//     p(w) = (1 − g) p_bsdf(w) + g p_guide(w),
//
// as is the density that light samples are weighted against (balance heuristic). Hence the estimate is unbiased for any
// field. g is the fraction of guided directions times the probability of the BSDF lobes that guiding can replace:
// neither delta nor narrow lobes. Russian roulette is driven by what paths are expected to bring [Vorba2016]; before
// that is known, it uses the throughput that the path would have with BSDF sampling: guided directions of high density
// have low throughput, which is no reason to end their paths.
//
// guided_surface.h has the mixture, guided_vertex_control.h the control variates of --cv. `Parts` is what tests replace
// to plant bugs; see GuidedParts.
#pragma once

#include <span>

#include "core/in_place.h"
#include "integrators/guided_vertex_control.h"
#include "integrators/path_steps.h"
#include "sampling/mis.h"

namespace covary {

template <typename Parts>
class GuidedTracer {
  using Path = GuidedBatch::Path;

 public:
  GuidedTracer(const Scene& scene, const GuidedScene& guided, const PathLengthSettings& lengths,
               std::span<CameraSample> samples, PathContext& context)
      : scene_(scene),
        guided_(guided),
        field_(*guided.field),
        lengths_(lengths),
        samples_(samples),
        context_(context),
        batch_(context.state_as<GuidedBatch>()),
        control_(guided, guide_, samples, context, batch_) {}

  void trace() {
    if (lengths_.max_depth <= 0) return;
    start_paths(samples_, batch_);
    follow_paths(scene_, lengths_, samples_, batch_, context_, *this);
    if (batch_.recording) finish_steps();
    if (batch_.recording_control) control_.finish_steps();
  }

  // The steps of follow_paths().

  /// Adds the emission of what the path's ray hit, which completes the vertex the ray came from.
  void arrive(int depth, size_t i) {
    const Path& path = batch_.paths[i];
    if (path.recorded) batch_.last_step(path.sample).sample.inverse_distance = path.found ? 1 / batch_.hits[i].t : 0;
    float r_light = 0;
    uint32_t light = ControlledSample::kNoLight;
    add_emission(depth, i, r_light, light);
    if (!batch_.vertices[path.sample].active) return;
    control_.take_direction(path.sample, r_light, light);
    control_.close(path.sample);
  }

  /// Russian roulette; see above.
  bool goes_on(int depth, Path& path) {
    if (field_.n_leaves() > 0) {
      const SurfaceHit& hit = batch_.hits[static_cast<size_t>(&path - batch_.paths.data())];
      // Nothing is learnt about mirrors and clear glass, which bright paths may meet often: they end paths late.
      if (!(hit.bsdf_flags & kSmooth)) return depth < 4 * lengths_.rr_depth || survives(depth, path, 1);
      path.leaf = field_.find(hit.p);
      if (const float outgoing = field_.leaf(path.leaf).outgoing; outgoing > 0)
        return survives(depth, path, worth(path, outgoing));
    }
    if (depth < lengths_.rr_depth) return true;
    const float weight =
        play_roulette(roulette::Parts(), path, path.bsdf_throughput, path.last_vertex, samples_[path.sample]);
    path.throughput *= weight;
    path.bsdf_throughput *= weight;
    return weight > 0;
  }

  void sample_lights(int depth) {
    prefetch_leaves();
    const bool any_light = guided_.lights && (!guided_.lights->empty() || guided_.environment);
    connecting_ = any_light && depth + 2 >= lengths_.min_depth;
    if (connecting_) {
      choose_lights(*guided_.lights, guided_.environment, samples_, true, batch_);
      covary::sample_lights(*guided_.lights, guided_.environment, batch_);
    }
    batch_.ended.clear(), batch_.connection_parts.clear(), batch_.connection_weights.clear();
  }

  bool scatter(int /*depth*/, uint32_t i, const PathVertex& at) {
    Path& path = batch_.paths[i];
    const SurfaceHit& hit = at.hit;
    path.last_vertex = at.address;
    make_guide(hit, at.wo, at.bsdf, i);
    control_.open(path, connecting_);
    if (connecting_ && batch_.choices[i].open) {
      if (!guided_.lights->empty())
        add_light(at, path, batch_.lights[i], (*guided_.lights)[batch_.choices[i].light].pmf,
                  guided_.cluster_of[batch_.choices[i].light]);
      if (guided_.environment) add_light(at, path, batch_.environments[i], 1, ControlledSample::kNoLight);
    }

    const GuidedDirection direction = guide_.sample(field_, hit, at.wo, at.bsdf, at.sample.random, at.address);
    const BsdfSample& next = direction.sample;
    path.recorded = false;
    const bool ends = !next.valid() || is_black(next.weight);
    if (batch_.vertices[path.sample].active) control_.keep_direction(path.sample, direction, !ends);
    if (ends) {
      if (!batch_.vertices[path.sample].active) return false;
      if (Parts::kCountFailed) control_.take_direction(path.sample, 0, ControlledSample::kNoLight);
      batch_.ended.push_back(path.sample);
      return false;
    }
    const Spectrum arriving = path.throughput;
    scatter_path(path, next);
    path.bsdf_throughput *= next.weight * (direction.pdf_bsdf > 0 ? next.pdf / direction.pdf_bsdf : 1);
    const Vec3 wi = hit.frame.to_world(next.wi);
    continue_path(path, batch_.rays[i], hit, next, wi);
    if (batch_.recording && !next.is_delta() && guide_.guidable > 0) record(path, arriving, hit.p, wi, next.pdf);
    return true;
  }

  /// Completes the light samples, and the vertices of paths that have ended.
  void connect(int /*depth*/) {
    if (connecting_) trace_connections();
    if (batch_.recording) begin_steps();
    if (batch_.recording_control) control_.begin_steps();
    for (const uint32_t sample : batch_.ended) control_.close(sample);
  }

 private:
  /// Survival probability of adjoint-driven roulette [Vorba2016] (Sec. 5), not limited: the expected contribution,
  /// throughput times the learnt radiance `outgoing` of the leaf, relative to that at the path's first vertex.
  float worth(Path& path, float outgoing) const {
    const float value = max_component(path.throughput) * outgoing;
    if (path.first_value == 0) path.first_value = value;
    const float ratio = kSurvivalRatio * value / path.first_value;
    // The root is that of roulette.h.
    return samples_[path.sample].random.sampling() == Sampling::kCrn ? std::sqrt(std::sqrt(ratio)) : ratio;
  }

  bool survives(int depth, Path& path, float survival) {
    survival = std::max(survival, kMinSurvival);
    if (depth >= lengths_.rr_depth) survival = std::min(survival, 0.95f);  // every path ends
    if (survival >= 1) return true;
    if (!(samples_[path.sample].random.get_1d(path.last_vertex, Event::kRoulette) < survival)) return false;
    const float weight = Parts::survivor_weight(survival);
    path.throughput *= weight, path.bsdf_throughput *= weight;
    return true;
  }

  /// Sets `r_light` and `light_cluster` if a light sample could have found the same point.
  void add_emission(int depth, size_t i, float& r_light, uint32_t& light_cluster) {
    const Path& path = batch_.paths[i];
    const SurfaceHit& hit = batch_.hits[i];
    if (depth + 1 < lengths_.min_depth) return;
    const Emitter* emitter = emitter_met(path, hit, scene_, guided_.environment, lengths_.hide_emitters);
    if (!emitter) return;
    const EnvironmentLight light = emitted_light(*emitter, path, batch_.rays[i], hit);
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

  /// Prefetches the leaves of the vertices, which goes_on() has found.
  void prefetch_leaves() {
    if (field_.n_leaves() == 0) return;
    for (size_t i = 0; i < batch_.paths.size(); ++i) {
      if (!(batch_.hits[i].bsdf_flags & kSmooth)) continue;
      const GuidingLeaf& leaf = field_.leaf(batch_.paths[i].leaf);
      for (size_t line = 0; line < sizeof leaf; line += 64)
        __builtin_prefetch(reinterpret_cast<const char*>(&leaf) + line);
    }
  }

  /// Sets guide_ for the vertex of path i.
  void make_guide(const SurfaceHit& hit, const Vec3& wo, const BsdfClosure& bsdf, uint32_t i) {
    guide_.fraction = guide_.guidable = 0;
    if (!(hit.bsdf_flags & kSmooth) || (field_.n_leaves() == 0 && !batch_.recording)) return;
    guide_.guidable = guidable_fraction(bsdf, wo, kMinGuidedRoughness);
    if (field_.n_leaves() == 0) return;
    guide_.leaf = batch_.paths[i].leaf;
    guide_.see(guided_, hit, wo);
  }

  /// Next-event estimation: f cos L / p, if unoccluded. `pmf`: selection probability of the light of `cluster`;
  /// kNoLight: the environment.
  void add_light(const PathVertex& at, const Path& path, const EmitterSample& light, float pmf, uint32_t cluster) {
    const bool active = batch_.vertices[path.sample].active;
    if (light.pdf_solid_angle > 0 && !is_black(light.radiance)) {
      const BsdfValue f = at.bsdf.eval(at.wo, at.hit.frame.to_local(light.wi));
      if (!is_black(f.value)) {
        GuidedBatch::ConnectionParts parts;
        float pdf_direction = 0;
        if (!light.is_delta) {
          const float pdf_guide = guide_.pdf(light.wi);
          if (active) {
            pdf_direction = control_.densities(f.pdf_solid_angle, pdf_guide);
            parts.direction = control_.weighted_coefficients(path.sample, pdf_direction);
          } else {
            pdf_direction = guide_.mixture_pdf(f.pdf_solid_angle, pdf_guide);
          }
        }
        const float pdf = pmf * light.pdf_solid_angle;
        const Spectrum value = f.value * light.radiance * (1 / (pdf + pdf_direction));
        const size_t n = batch_.n_connections++;
        const auto place = static_cast<uint32_t>(batch_.connection_parts.size());
        make_in_place(batch_.connections[n], [&] {
          return GuidedBatch::Connection{path.throughput * value, path.sample, place};
        });
        make_in_place(batch_.shadow_rays[n], [&] { return shadow_ray(at.hit, light); });
        if (!active) return;
        parts.value = value, parts.light = cluster, parts.r_light = mis::balance(pdf, pdf_direction);
        batch_.connection_parts.push_back(parts);
        if (!batch_.recording_control) return;
        batch_.connection_weights.push_back(pdf_direction > 0 ? control_.balance_weights(pdf + pdf_direction)
                                                              : TechniqueDensities{});
        return;
      }
    }
    if (active) control_.take_light(path.sample, {{}, cluster, 1, {}}, kNoWeights);
  }

  /// Adds the unoccluded light samples.
  void trace_connections() {
    visit_connections(scene_, batch_, context_, [&](const GuidedBatch::Connection& connection, bool hidden) {
      if (!hidden) samples_[connection.sample].radiance += connection.radiance;
      if (!batch_.vertices[connection.sample].active) return;
      const GuidedBatch::ConnectionParts& parts = batch_.connection_parts[connection.place];
      if (hidden || !batch_.recording_control)
        control_.take_light(connection.sample, hidden ? GuidedBatch::ConnectionParts{{}, parts.light, 1, {}} : parts,
                            kNoWeights);
      else
        control_.take_light(connection.sample, parts, batch_.connection_weights[connection.place]);
    });
  }

  /// Records a direction sample of the path.
  void record(Path& path, const Spectrum& arriving, const Vec3& p, const Vec3& wi, float pdf) {
    uint32_t& n = batch_.n_steps[path.sample];
    if (n == GuidedBatch::kMaxSteps) return;
    ++n;
    path.recorded = true;
    GuidedBatch::Step& step = batch_.last_step(path.sample);
    step.throughput = path.throughput;
    step.arriving = arriving, step.on_arrival = samples_[path.sample].radiance;
    step.sample = {.position = p, .direction = wi, .pdf = pdf};
  }

  /// The vertices' own light samples are complete: contributions from now on arrive along the recorded directions.
  void begin_steps() {
    for (const Path& path : batch_.paths)
      if (path.recorded) batch_.last_step(path.sample).before = samples_[path.sample].radiance;
  }

  /// Computes the radiance that arrived along each recorded direction, and that its vertex sent along the path: the
  /// path's later contributions over its throughput.
  void finish_steps() {
    for (uint32_t i = 0; i < samples_.size(); ++i)
      for (uint32_t n = 0; n < batch_.n_steps[i]; ++n) {
        GuidedBatch::Step& step = batch_.steps[i * GuidedBatch::kMaxSteps + n];
        const auto since = [&](const Spectrum& before, const Spectrum& throughput) {
          const Spectrum gained = samples_[i].radiance - before;
          float radiance = 0;
          for (int c = 0; c < 3; ++c)
            if (throughput[c] > 0) radiance += std::max(gained[c], 0.0f) / throughput[c] * (1.0f / 3);
          return radiance;
        };
        step.sample.weight = since(step.before, step.throughput) / step.sample.pdf;
        step.sample.outgoing = since(step.on_arrival, step.arriving);
        batch_.records.push_back(step.sample);
      }
  }

  /// Before `rr_depth`, roulette ends no path that is expected to bring more than 1 / kSurvivalRatio of what it was at
  /// its first vertex, so that few survivors get large weights (docs/notes/guiding.md).
  static constexpr float kSurvivalRatio = 8, kMinSurvival = 0.1f;
  static constexpr TechniqueDensities kNoWeights{};
  const Scene& scene_;
  const GuidedScene& guided_;
  const GuidingField& field_;
  const PathLengthSettings& lengths_;
  std::span<CameraSample> samples_;
  PathContext& context_;
  GuidedBatch& batch_;
  bool connecting_ = false;  // vertices take light samples
  Guide<Parts> guide_;       // of the current vertex
  GuidedVertexControl<Parts> control_;
};

}  // namespace covary
