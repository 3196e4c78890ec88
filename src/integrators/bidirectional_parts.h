// SPDX-License-Identifier: Apache-2.0
// Settings of bidirectional path tracing (bidirectional_tracer.h), and its parts, which tests replace to plant bugs.
#pragma once

#include "integrators/bdpt_weights.h"
#include "integrators/light_subpaths.h"
#include "integrators/path_lengths.h"
#include "passes/light_pass.h"
#include "sampling/roulette.h"

namespace covary {

struct BidirectionalSettings {
  PathLengthSettings lengths;
  LightTracingSettings light_tracing;
};

/// The parts of `bdpt`; tests replace them like those of `path` (path_tracer.h).
struct BidirectionalParts : roulette::Parts {
  /// Maximum number of vertices of a light subpath, at least 1. Techniques with more have weight 0.
  int max_light_vertices() const { return PathLengthSettings::kUnlimited; }
  /// The quantity that light subpaths transport.
  TransportMode light_mode() const { return TransportMode::kImportance; }
  /// Factor on the scattering of a light-subpath vertex from wo to wi, in its shading frame; `ng`: its geometric normal
  /// in that frame.
  float adjoint_factor(const Vec3& wo, const Vec3& wi, const Vec3& ng) const {
    return shading_normal_factor(wo, wi, {0, 0, 1}, ng, TransportMode::kImportance);
  }
  /// Probability of starting a light subpath at this light, as used in its throughput.
  float emission_pmf(const PowerLights& lights, const Emitter& emitter) const { return lights.pmf(emitter); }
  /// Factor on connections of light subpaths to the lens.
  float splat_factor() const { return 1; }

  // For tests and images of techniques: the unweighted contribution of a technique (s, t) to the current sample, and of
  // a single light path to a pixel.
  void record(int /*s*/, int /*t*/, const Spectrum& /*value*/, double /*weight*/) const {}
  void record_splat(int /*s*/, const SplatPixel& /*pixel*/, const Spectrum& /*value*/, double /*weight*/) const {}
};

}  // namespace covary
