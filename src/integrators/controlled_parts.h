// SPDX-License-Identifier: Apache-2.0
// Input of a path tracer with control variates (controlled_tracer.h): lights, coefficients, and parts that tests
// replace to plant bugs.
#pragma once

#include <cstdint>
#include <span>

#include "sampling/coefficient_table.h"
#include "sampling/light_set.h"
#include "sampling/mis.h"

namespace covary {

/// Constant while paths are traced.
struct ControlledScene {
  const LightSet* lights;
  std::span<const uint32_t> cluster_of;  ///< cluster of each light
  const Emitter* environment;            ///< sampled separately; or null
  const CoefficientTable* table;         ///< the coefficients; without cells: no control
  /// The control covers light samples only, as if no other technique found their points [Vevoda2018]: r is 1 for each
  /// of them, and direction samples are not part of it.
  bool light_samples_only = false;
  /// Coefficients belong to pixels, for the first surface; later vertices have none.
  bool per_pixel = false;
  bool residuals = false;   ///< while learning, record the residual of each light's samples
  bool by_albedo = false;   ///< multiply coefficients by the albedo of the vertex
  bool monochrome = false;  ///< by the mean albedo over RGB
  /// Dense techniques: directions from the BSDF, then the environment.
  static constexpr uint32_t kBsdf = 0, kEnvironment = 1;
  uint32_t n_dense() const { return environment ? 2 : 1; }
};

/// The correct parts.
struct ControlledParts {
  /// Whether a failed direction counts as a sample.
  static constexpr bool kCountFailed = true;
  /// Whether to add the control of vertices at which paths end.
  static constexpr bool kCloseEnded = true;
  /// Balance weight of a direction of density `pdf` that hit light which other techniques find with `pdf_light`.
  static float direction_weight(float pdf, float pdf_light, bool /*of_environment*/) {
    return mis::balance(pdf, pdf_light);
  }
  /// Factor on the coefficients of a vertex, whether its path ends there or continues.
  static Spectrum albedo_scale(const Spectrum& scale, bool /*ended*/) { return scale; }
};

}  // namespace covary
