// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "integrators/guided_batch.h"
#include "integrators/guided_surface.h"
#include "sampling/light_selection.h"

namespace covary {

/// The control variates of the vertices of a batch (guided_batch.h): opened at a vertex, closed once its direction and
/// light samples are complete; and the training data of each vertex.
template <typename Parts>
class GuidedVertexControl {
 public:
  /// `guide`: that of the current vertex; read by open() and, with the parts of its last pdf(), by densities(),
  /// weighted_coefficients(), balance_weights() and keep_direction().
  GuidedVertexControl(const GuidedScene& guided, const Guide<Parts>& guide, std::span<CameraSample> samples,
                      PathContext& context, GuidedBatch& batch)
      : guided_(guided),
        guide_(guide),
        field_(*guided.field),
        table_(*guided.table),
        samples_(samples),
        context_(context),
        batch_(batch) {}

  /// Begins the control of a vertex with Σ N β. Only vertices with guided directions have one.
  void open(const GuidedBatch::Path& path, bool connecting) {
    ControlledVertexState& vertex = batch_.vertices[path.sample];
    vertex.active = false;
    const bool learns = batch_.recording_control && batch_.control_steps.size() < kMaxControlSteps * samples_.size();
    if (guide_.fraction == 0 || (guided_.lights && !connecting) || (!learns && table_.n_cells() == 0)) return;
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

  /// Stores N λ of the techniques that sample directions, for the direction of the guide's last pdf(); returns their
  /// sum.
  float densities(float pdf_bsdf, float pdf_guide) {
    n_lobes_ = guide_.lobes.n;
    bsdf_density_ = (1 - guide_.fraction) * pdf_bsdf;
    return bsdf_density_ + guide_.fraction * pdf_guide;
  }

  /// Σ β N λ / Σ N λ over the techniques of densities(), whose sum is `pdf`.
  Spectrum weighted_coefficients(uint32_t sample, float pdf) const {
    Spectrum sum;
    if (batch_.vertices[sample].cell == CoefficientTable::kNone || !(pdf > 0)) return sum;
    const uint32_t cell = Parts::direction_cell(batch_.vertices[sample].cell, table_.n_cells());
    const GuidingLeaf& leaf = field_.leaf(guide_.leaf);
    for (int k = 0; k < n_lobes_; ++k) sum += table_.dense(cell, GuidedTechnique::of(leaf, k)) * guide_.parts[k];
    sum = sum * guide_.fraction + table_.dense(cell, GuidedTechnique::kBsdf) * bsdf_density_;
    return sum * (1 / pdf);
  }

  /// N λ / `sum` for each technique that samples directions.
  TechniqueDensities balance_weights(float sum) const {
    TechniqueDensities r{};
    if (!(sum > 0)) return r;
    r[GuidedTechnique::kBsdf] = bsdf_density_ / sum;
    const GuidingLeaf& leaf = field_.leaf(guide_.leaf);
    for (int k = 0; k < n_lobes_; ++k) r[GuidedTechnique::of(leaf, k)] += guide_.fraction * guide_.parts[k] / sum;
    return r;
  }

  /// Stores what the control needs about the direction sample, the guide's last one; it is applied when the next
  /// surface is found.
  void keep_direction(uint32_t sample, const GuidedDirection& direction, bool followed) {
    float pdf = 1;
    if (direction.sample.valid() && !direction.sample.is_delta())
      pdf = densities(direction.pdf_bsdf, direction.pdf_guide);
    else  // no other technique finds it
      n_lobes_ = 0, bsdf_density_ = 1;
    ControlledVertexState& vertex = batch_.vertices[sample];
    vertex.direction = weighted_coefficients(sample, pdf);
    if (vertex.step == ~0u) return;
    ControlStep& step = batch_.control_steps[vertex.step];
    step.r = balance_weights(pdf);
    step.followed = followed;
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

  /// Same for a light sample; `r`: balance weights of the techniques that sample directions.
  void take_light(uint32_t sample, const GuidedBatch::ConnectionParts& parts, const TechniqueDensities& r) {
    ControlledVertexState& vertex = batch_.vertices[sample];
    if (vertex.cell != CoefficientTable::kNone)
      vertex.control = vertex.control - (light_coefficient(vertex.cell, parts.light) * parts.r_light +
                                         parts.direction * (1 - parts.r_light));
    if (vertex.step == ~0u) return;
    ControlStep& step = batch_.control_steps[vertex.step];
    step.plain += parts.value;
    add_to_sums(step, parts.value, parts.light, parts.r_light, r);
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

  /// The vertices' light samples are complete: contributions from now on arrive along their directions.
  void begin_steps() {
    for (const GuidedBatch::Path& path : batch_.paths)
      if (const ControlledVertexState& vertex = batch_.vertices[path.sample]; vertex.active && vertex.step != ~0u)
        batch_.control_steps[vertex.step].before = samples_[path.sample].radiance;
  }

  /// Adds the direction samples to the sums: the path's later contributions, without the vertex's own control.
  void finish_steps() {
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

 private:
  /// β of a cluster of lights, or of the environment.
  Spectrum light_coefficient(uint32_t cell, uint32_t cluster) const {
    return cluster == ControlledSample::kNoLight ? table_.dense(cell, GuidedTechnique::kEnvironment)
                                                 : table_.light(cell, cluster);
  }

  void add_to_sums(const ControlStep& step, const Spectrum& value, uint32_t light, float r_light,
                   TechniqueDensities r) {
    const bool of_light = light != ControlledSample::kNoLight && r_light > 0;
    if (!of_light && r_light > 0) r[GuidedTechnique::kEnvironment] = r_light;
    batch_.sums.add(step.cell, step.weight,
                    {value, of_light ? light : ControlledSample::kNoLight, of_light ? r_light : 0, r});
  }

  static constexpr size_t kMaxControlSteps = 16;  // per path, on average over a batch
  const GuidedScene& guided_;
  const Guide<Parts>& guide_;
  const GuidingField& field_;
  const CoefficientTable& table_;
  std::span<CameraSample> samples_;
  PathContext& context_;
  GuidedBatch& batch_;
  int n_lobes_ = 0;         // with densities from the guide's last pdf(); others have none
  float bsdf_density_ = 0;  // N λ of the BSDF there
};

}  // namespace covary
