// SPDX-License-Identifier: Apache-2.0
// Path tracing with control variates built from the sampling densities [Hua2023]. A vertex takes one light sample, one
// environment sample if there is an environment, and one direction from its BSDF. With p the sum of the densities with
// which they find a point, and r_k the fraction of technique k in it (balance heuristic), its estimate is
//
//     Σ_s f/p + Σ_k N_k β_k − Σ_s Σ_k β_k r_k(s),                                       [Hua2023] Eq. (17)
//
// see sampling/coefficient_solver.h. The second and third terms have the same expectation for any coefficients β that
// do not depend on the samples; f is the light arriving at the vertex from emitters, and what other surfaces reflect is
// left to the rest of the path. The estimate is unbiased, and can be negative.
//
// For Σ_s r_k(s) to have expectation N_k, each sample must contribute its r, whether or not it found light:
// - Σ_k r_k = 1 at every sample. A direction that fails, comes from a delta lobe, or hits no light cannot be found by
//   other techniques: its own r is 1. So is that of a delta light, and of an occluded light sample.
// - A light sample of a point that reflects or emits nothing towards the vertex needs no ray: its r is 1. A direction
//   sample that hits such a point treats it as no light; its own r is 1. That splits the point in two, one per
//   technique, neither of which adds light. The rule must depend on vertex and direction alone, or it would cause bias.
// - Σ_k N_k β_k is added where, and only where, the samples are taken: not at surfaces with delta lobes only, and not
//   for excluded path lengths.
// - Russian roulette comes after the next surface is found, the last thing a vertex needs: otherwise it would have to
//   return the remaining control of the vertices it terminates.
//
// Coefficients may be multiplied by any number that depends on the vertex alone. Scaling by the albedo lets the
// vertices of a cell share coefficients even if their surface is textured.
//
// `Parts` is what tests replace to plant bugs: controlled_parts.h.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "integrators/controlled_batch.h"
#include "integrators/controlled_parts.h"
#include "integrators/path_steps.h"
#include "integrators/primary_sample.h"
#include "sampling/coefficient_table.h"
#include "sampling/light_selection.h"
#include "sampling/light_set.h"
#include "sampling/mis.h"

namespace covary {

template <typename Parts>
class ControlledTracer {
  using Path = ControlledBatch::Path;
  static constexpr uint32_t kNoLight = ControlledSample::kNoLight;

 public:
  ControlledTracer(const Scene& scene, const ControlledScene& control, const PathLengthSettings& lengths,
                   std::span<CameraSample> samples, PathContext& context)
      : scene_(scene),
        control_(control),
        table_(*control.table),
        lengths_(lengths),
        samples_(samples),
        context_(context),
        batch_(context.state_as<ControlledBatch>()) {}

  void trace() {
    if (lengths_.max_depth <= 0) return;
    start_paths(samples_, batch_);
    context_.by_part.radiance.assign(samples_.size() * context_.by_part.n_parts, Spectrum());
    follow_paths(scene_, lengths_, samples_, batch_, context_, *this);
  }

  // The steps of follow_paths().

  /// Adds the emission of what the path's ray hit, which completes the vertex the ray came from.
  void arrive(int depth, size_t i) {
    const Path& path = batch_.paths[i];
    const SurfaceHit& hit = batch_.hits[i];
    EnvironmentLight light;
    if (depth + 1 >= lengths_.min_depth)
      if (const Emitter* emitter = emitter_met(path, hit, scene_, control_.environment, lengths_.hide_emitters))
        light = emitted_light(*emitter, path, batch_.rays[i], hit);
    ControlledVertex& vertex = batch_.vertices[path.sample];
    float r = 1;
    uint32_t cluster = kNoLight;
    if (vertex.open && !path.previous_delta && !is_black(light.radiance)) {
      float pdf_light = light.pdf_solid_angle;
      if (path.found) {
        const uint32_t number = control_.lights->number_of(hit);
        cluster = control_.cluster_of[number];
        pdf_light = (*control_.lights)[number].pmf * LightSet::pdf_solid_angle(path.previous_p, hit);
      }
      r = Parts::direction_weight(path.previous_pdf, pdf_light, !path.found);
    }
    if (!is_black(light.radiance)) add(path.sample, depth + 1, path.throughput * light.radiance * r);
    if (!vertex.open) return;
    if (!control_.light_samples_only) take(vertex, vertex.direction_weight * light.radiance * r, cluster, 1 - r);
    close(path.sample, depth + 1, false);
  }

  /// Plays Russian roulette.
  bool goes_on(int depth, Path& path) {
    if (depth < lengths_.rr_depth) return true;
    const float weight =
        play_roulette(roulette::Parts(), path, path.throughput, path.last_vertex, samples_[path.sample]);
    path.throughput *= weight;
    return weight > 0;
  }

  void sample_lights(int depth) {
    const bool any_light = !control_.lights->empty() || control_.environment;
    choose_lights(*control_.lights, control_.environment, samples_, depth + 2 >= lengths_.min_depth && any_light,
                  batch_);
    choose_cells(depth);
    covary::sample_lights(*control_.lights, control_.environment, batch_);
    find_cells();
    batch_.ended.clear();
  }

  bool scatter(int /*depth*/, uint32_t i, const PathVertex& at) {
    Path& path = batch_.paths[i];
    const SurfaceHit& hit = at.hit;
    const ControlledBatch::LightChoice& choice = batch_.choices[i];
    path.last_vertex = at.address;
    ControlledVertex& vertex = batch_.vertices[path.sample];
    vertex.open = choice.open;
    if (vertex.open) {
      open(vertex, path, hit, choice);
      if (!control_.lights->empty())
        add_light(at, path, batch_.lights[i], control_.cluster_of[choice.light], (*control_.lights)[choice.light].pmf);
      if (control_.environment) add_light(at, path, batch_.environments[i], kNoLight, 1);
    }

    const PathRandom& random = at.sample.random;
    const BsdfSample next =
        at.bsdf.sample(at.wo, random.get_1d(at.address, Event::kLobe), random.get_2d(at.address, Event::kDirection));
    if (!next.valid() || is_black(next.weight)) {
      if (!vertex.open) return false;
      if (Parts::kCountFailed && !control_.light_samples_only) take(vertex, Spectrum(), kNoLight, 0);
      batch_.ended.push_back(path.sample);
      return false;
    }
    vertex.direction_weight = next.weight;
    scatter_path(path, next);
    continue_path(path, batch_.rays[i], hit, next, hit.frame.to_world(next.wi));
    return true;
  }

  /// Completes the light samples, and the vertices of paths that have ended.
  void connect(int depth) {
    trace_connections(depth + 2);
    if constexpr (Parts::kCloseEnded)
      for (const uint32_t sample : batch_.ended) close(sample, depth + 2, true);
  }

 private:
  /// Computes the cells of the vertices.
  void choose_cells(int depth) {
    for (size_t i = 0; i < batch_.paths.size(); ++i) {
      ControlledBatch::LightChoice& choice = batch_.choices[i];
      if (!choice.open) continue;
      choice.in_cell = uses_cells() && (depth == 0 || !control_.per_pixel);
      if (!choice.in_cell) continue;
      choice.key = key_of(batch_.rays[i], batch_.hits[i]);
      table_.prefetch(choice.key);
    }
  }

  /// Looks up their coefficients; each loop prefetches what the next one reads.
  void find_cells() {
    const auto of_each_vertex = [this](const auto& visit) {
      for (size_t i = 0; i < batch_.paths.size(); ++i)
        if (ControlledBatch::LightChoice& choice = batch_.choices[i]; choice.open) visit(choice);
    };
    of_each_vertex([this](ControlledBatch::LightChoice& choice) {
      choice.cell = choice.in_cell ? table_.find(choice.key) : CoefficientTable::kNone;
      if (choice.cell != CoefficientTable::kNone) table_.prefetch_cell(choice.cell);
    });
    if (control_.lights->empty()) return;
    of_each_vertex([this](const ControlledBatch::LightChoice& choice) {
      if (choice.cell != CoefficientTable::kNone) table_.prefetch_light(choice.cell, control_.cluster_of[choice.light]);
    });
  }

  /// The cell of a surface hit by a ray, by its normal on the side of the ray.
  CellKey key_of(const Ray& ray, const SurfaceHit& hit) const {
    if (!control_.per_pixel) return table_.grid().key(hit.p, dot(hit.frame.n, ray.d) < 0 ? hit.frame.n : -hit.frame.n);
    const Camera& camera = scene_.camera();
    const Vec2 film = camera.project(hit.p, ray.d);
    const auto pixel = [this](float x, int size) {
      return static_cast<uint32_t>(std::clamp(x, 0.0f, static_cast<float>(size - 1))) >> table_.grid().level();
    };
    return {pixel(film.x, camera.width()), pixel(film.y, camera.height()), 0, CellGrid::kEveryNormal,
            table_.grid().level()};
  }

  bool uses_cells() const { return batch_.recording || table_.n_cells() > 0; }

  /// Begins the estimate of a vertex with Σ N β of its control.
  void open(ControlledVertex& vertex, const Path& path, const SurfaceHit& hit,
            const ControlledBatch::LightChoice& choice) {
    vertex.throughput = path.throughput;
    vertex.recorded = choice.in_cell && batch_.recording;
    vertex.cell = choice.cell;
    if (vertex.cell != CoefficientTable::kNone) {
      if (!batch_.recording && is_black(table_.scale(vertex.cell)))
        vertex.cell = CoefficientTable::kNone;
      else
        begin_control(vertex);
    }
    const bool controlled = vertex.recorded || vertex.cell != CoefficientTable::kNone;
    vertex.albedo_scale = control_.by_albedo && controlled ? albedo_scale_of(hit) : Spectrum(1);
    if (!vertex.recorded) return;
    vertex.weights = weights_of(path, vertex.albedo_scale);
    vertex.weight = mean(vertex.weights);
    vertex.sums_cell = batch_.sums.cell(choice.key);
    vertex.plain = Spectrum();
  }

  /// Weights of a vertex's samples in the sums, by channel.
  Spectrum weights_of(const Path& path, const Spectrum& albedo_scale) const {
    const Spectrum importance = context_.importance.empty() ? Spectrum(1) : context_.importance[path.sample];
    return variance_weights(path.throughput * albedo_scale, importance);
  }

  /// The albedo of a surface; never zero, since a black surface can have highlights.
  Spectrum albedo_scale_of(const SurfaceHit& hit) const {
    constexpr float kMin = 0.02f;
    Spectrum albedo = hit.bsdf->albedo(hit);
    if (control_.monochrome) albedo = Spectrum(mean(albedo));
    for (int c = 0; c < 3; ++c) albedo[c] = std::clamp(albedo[c], kMin, 1.0f);
    return albedo;
  }

  void begin_control(ControlledVertex& vertex) {
    vertex.control = table_.light_sum(vertex.cell);
    if (control_.environment) vertex.control += table_.dense(vertex.cell, ControlledScene::kEnvironment);
    if (!control_.light_samples_only) vertex.control += table_.dense(vertex.cell, ControlledScene::kBsdf);
  }

  /// β of a light's cluster, or of the environment for kNoLight.
  Spectrum coefficient(uint32_t cell, uint32_t cluster) const {
    return cluster == kNoLight ? table_.dense(cell, ControlledScene::kEnvironment) : table_.light(cell, cluster);
  }

  /// Accounts for one sample of a vertex with value f/p and balance weights: `r_light` of a light's cluster, or of the
  /// environment for kNoLight, and 1 − r_light of the BSDF.
  void take(ControlledVertex& vertex, const Spectrum& value, uint32_t cluster, float r_light) {
    Spectrum control(0);
    if (vertex.cell != CoefficientTable::kNone) {
      Spectrum sum = table_.dense(vertex.cell, ControlledScene::kBsdf) * (1 - r_light);
      if (r_light > 0) sum += coefficient(vertex.cell, cluster) * r_light;
      vertex.control = vertex.control - sum;  // − Σ_k β_k r_k(s), [Hua2023] Eq. (17)
      control = sum * table_.scale(vertex.cell);
    }
    if (!vertex.recorded) return;
    const Spectrum scaled = value / vertex.albedo_scale;
    record(vertex, scaled, cluster, r_light);
    if (control_.residuals && cluster != kNoLight && r_light > 0)
      batch_.sums.add_residual(cluster, vertex.weight, scaled - control);
  }

  void record(ControlledVertex& vertex, const Spectrum& value, uint32_t cluster, float r_light) {
    const bool of_light = cluster != kNoLight;
    const float r_dense[2] = {1 - r_light, of_light ? 0 : r_light};
    const ControlledSample sample{
        value, r_light > 0 ? cluster : kNoLight, of_light ? r_light : 0, {r_dense, control_.n_dense()}};
    if (batch_.sums.layout().by_channel)
      batch_.sums.add_by_channel(vertex.sums_cell, vertex.weights, sample);
    else
      batch_.sums.add(vertex.sums_cell, vertex.weight, sample);
    vertex.plain += value;
  }

  /// Next-event estimation: f cos L / p, if unoccluded. `pmf`: selection probability of the light.
  void add_light(const PathVertex& at, const Path& path, const EmitterSample& light, uint32_t cluster, float pmf) {
    if (light.pdf_solid_angle > 0 && !is_black(light.radiance)) {
      const BsdfValue f = at.bsdf.eval(at.wo, at.hit.frame.to_local(light.wi));
      if (!is_black(f.value)) {
        const float pdf = pmf * light.pdf_solid_angle, pdf_direction = light.is_delta ? 0 : f.pdf_solid_angle;
        const size_t n = batch_.n_connections++;
        make_in_place(batch_.connections[n], [&] {
          return ControlledBatch::Connection{f.value * light.radiance * (1 / (pdf + pdf_direction)), path.sample,
                                             cluster, mis::balance(pdf, pdf_direction)};
        });
        make_in_place(batch_.shadow_rays[n], [&] { return shadow_ray(at.hit, light); });
        return;
      }
    }
    take(batch_.vertices[path.sample], Spectrum(), cluster, 1);
  }

  /// Completes the light samples, once occlusion is known.
  void trace_connections(int edges) {
    visit_connections(scene_, batch_, context_, [&](const ControlledBatch::Connection& connection, bool hidden) {
      ControlledVertex& vertex = batch_.vertices[connection.sample];
      if (hidden) return take(vertex, Spectrum(), connection.cluster, 1);
      add(connection.sample, edges, vertex.throughput * connection.value);
      take(vertex, connection.value, connection.cluster, control_.light_samples_only ? 1 : connection.r_technique);
    });
  }

  /// Adds a contribution of paths with `edges` edges to the radiance of a sample.
  void add(uint32_t sample, int edges, const Spectrum& value) {
    samples_[sample].radiance += value;
    const auto place = static_cast<size_t>(edges - 1);
    RadianceByPart& by_part = context_.by_part;
    if (place < by_part.n_parts) [[unlikely]]
      by_part.radiance[sample * by_part.n_parts + place] += value;
  }

  /// Ends the estimate of a vertex, which belongs to paths with `edges` edges.
  void close(uint32_t sample, int edges, bool ended) {
    ControlledVertex& vertex = batch_.vertices[sample];
    vertex.open = false;
    if (vertex.cell == CoefficientTable::kNone) return;
    const Spectrum scale = Parts::albedo_scale(vertex.albedo_scale, ended);
    add(sample, edges, vertex.throughput * table_.scale(vertex.cell) * vertex.control * scale);
    if (vertex.recorded) batch_.sums.add_held_out(vertex.sums_cell, vertex.weight, vertex.plain, vertex.control);
  }

  const Scene& scene_;
  const ControlledScene& control_;
  const CoefficientTable& table_;
  const PathLengthSettings& lengths_;
  std::span<CameraSample> samples_;
  PathContext& context_;
  ControlledBatch& batch_;
};

}  // namespace covary
