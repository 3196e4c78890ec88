// SPDX-License-Identifier: Apache-2.0
// Path tracing through participating media: `path` in scenes that have any. One path at a time.
//
// At each vertex, on a surface or in a medium, a light sample and a direction sample are combined by the balance
// heuristic over both techniques and the colour channel [Miller2019]. Both pass through surfaces that let light pass
// straight (boundaries with bsdf `null`, masks, panes): light samples by transmittance, directions by chance. Such
// crossings are not counted as path edges, as in Mitsuba's `volpath`.
#pragma once

#include "integrators/light_parts.h"
#include "integrators/medium_flight.h"
#include "integrators/path_lengths.h"
#include "passes/integrator.h"
#include "sampling/light_selection.h"

namespace covary {

class MediumPath {
 public:
  /// `parts` may be null; `number`: index of the sample in the batch.
  MediumPath(const Scene& scene, const PathLengthSettings& lengths, CameraSample& sample, PathContext& context,
             const LightParts* parts = nullptr, uint32_t number = 0);
  /// Sets the radiance of the sample.
  void trace() {
    while (advance()) {
    }
  }

 private:
  bool advance();
  bool scatter_in_medium(const Vec3& p);
  bool scatter_on_surface(const SurfaceHit& hit);
  bool play_roulette(uint32_t vertex);
  void add_emission(const Emitter& emitter, const SurfaceHit* hit);
  void start_flight() { numbers_ = FlightNumbers(sample_.random, n_smooth_); }
  void go_through(const SurfaceHit& hit, const Vec3& w);

  const Emitter& choose_light(uint32_t vertex) const;
  EmitterSample sample_light(const Emitter& emitter, const Vec3& p, uint32_t vertex) const;
  void connect(const EmitterSample& light, const Emitter& emitter, const Ray& shadow, const Medium* medium,
               const Spectrum& value, float pdf_direction);
  void add(const Emitter& light, const Spectrum& radiance) {
    sample_.radiance += radiance;
    if (parts_) parts_->add(light, number_, radiance, context_);
  }
  /// The light of media belongs to no group.
  void add_glow(const Spectrum& radiance) {
    sample_.radiance += radiance;
    if (parts_) parts_->add_ungrouped(number_, radiance, context_);
  }
  bool light_arrives(Ray ray, const EmitterSample& light, const Medium* medium, SpectralWeights& weights);

  const Scene& scene_;
  const PathLengthSettings& lengths_;
  CameraSample& sample_;
  PathContext& context_;
  const LightParts* parts_;
  const uint32_t number_;
  UniformLights lights_;
  int channel_;
  FlightNumbers numbers_;

  Ray ray_;
  const Medium* medium_;
  SpectralWeights weights_;
  float eta_ = 1;
  int depth_ = 0;  // edges so far
  uint32_t n_smooth_ = 0, n_delta_ = 0;
  Vec3 previous_p_;             // where the last direction was sampled
  bool only_direction_ = true;  // no light sample could have found what the ray hits
  bool only_null_ = true;       // no scattering so far
};

/// Whether light passes a surface as if it were absent.
inline bool is_boundary(const SurfaceHit& hit) { return hit.bsdf_flags == kNullTransmission; }

}  // namespace covary
