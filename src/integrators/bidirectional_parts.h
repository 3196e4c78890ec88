// SPDX-License-Identifier: Apache-2.0
// Settings of bidirectional path tracing (bidirectional_tracer.h), and its parts, which tests exchange to plant bugs.
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
  Heuristic heuristic = Heuristic::kPower;
};

/// The parts of `bdpt`; tests exchange them as those of `path` (path_tracer.h).
struct BidirectionalParts : roulette::Parts {
  /// Largest number of vertices of a light subpath, at least 1. Techniques with more have weight 0.
  int max_light_vertices() const { return PathLengthSettings::kUnlimited; }
  /// What light subpaths carry.
  TransportMode light_mode() const { return TransportMode::kImportance; }
  /// Factor on what a vertex of a light subpath reflects from wo to wi, in its shading frame; `ng`: its geometric
  /// normal there.
  float adjoint_factor(const Vec3& wo, const Vec3& wi, const Vec3& ng) const {
    return shading_normal_factor(wo, wi, {0, 0, 1}, ng, TransportMode::kImportance);
  }
  /// Probability that a light subpath starts at this light, as its throughput counts it.
  float emission_pmf(const PowerLights& lights, const Emitter& emitter) const { return lights.pmf(emitter); }
  /// Factor on what joins a light subpath to the lens.
  float splat_factor() const { return 1; }

  // For tests and images of techniques: what a technique (s, t) adds, before its weight, to the sample that is traced,
  // and to a pixel by a single light path.
  void record(int /*s*/, int /*t*/, const Spectrum& /*value*/, double /*weight*/) const {}
  void record_splat(int /*s*/, const SplatPixel& /*pixel*/, const Spectrum& /*value*/, double /*weight*/) const {}
};

}  // namespace covary
