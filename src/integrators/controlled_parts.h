// SPDX-License-Identifier: Apache-2.0
// What a path tracer with control variates (controlled_tracer.h) is given: lights, coefficients, and parts that tests
// exchange to plant bugs.
#pragma once

#include <cstdint>
#include <span>

#include "sampling/coefficient_table.h"
#include "sampling/light_set.h"
#include "sampling/mis.h"

namespace covary {

/// What does not change while paths are traced.
struct ControlledScene {
  const LightSet* lights;
  std::span<const uint32_t> cluster_of;  ///< for each light
  const Emitter* environment;            ///< sampled apart; or null
  const CoefficientTable* table;         ///< the coefficients; without cells: no control
  bool prefix = true;                    ///< samples are weighed by the throughput before them
  /// The control knows light samples alone, as if no other technique found their points [Vevoda2018]: r is 1 for each
  /// of them, and direction samples have no part in it.
  bool light_samples_only = false;
  /// Coefficients belong to pixels, those into which the camera sees the first surface; later vertices have none.
  bool per_pixel = false;
  bool residuals = false;   ///< while learning, what is left of each light's samples is recorded
  bool by_albedo = false;   ///< coefficients are multiplied by the albedo of the vertex
  bool monochrome = false;  ///< by its mean over RGB
  /// Coefficients of the bins of directions, for the light that other surfaces reflect; or null: no control of it.
  const CoefficientTable* indirect = nullptr;
  /// Dense techniques: directions by the BSDF, then the environment.
  static constexpr uint32_t kBsdf = 0, kEnvironment = 1;
  uint32_t n_dense() const { return environment ? 2 : 1; }
};

/// The correct ones.
struct ControlledParts {
  /// Whether a direction that failed counts as a sample.
  static constexpr bool kCountFailed = true;
  /// Whether the control of vertices at which paths end is added.
  static constexpr bool kCloseEnded = true;
  /// Balance weight of a direction of density `pdf` that met light that other techniques find with `pdf_light`.
  static float direction_weight(float pdf, float pdf_light, bool /*of_environment*/) {
    return mis::balance(pdf, pdf_light);
  }
  /// What multiplies the coefficients of a vertex, whether its path ends there or goes on.
  static Spectrum albedo_scale(const Spectrum& scale, bool /*ended*/) { return scale; }
};

}  // namespace covary
