// SPDX-License-Identifier: Apache-2.0
// Coefficients of a control variate built from the sampling densities themselves [Hua2023] (Sec. 4 and 6.2), in balance
// weights. A vertex takes samples by several techniques; technique k is expected to take N_k of them with density
// lambda_k, and p = Σ N_k lambda_k is their combined density. With r_k = N_k lambda_k / p, so that Σ_k r_k = 1 at every
// sample, the controlled estimate of F = ∫ f is
//
//     F ≈ Σ_s f/p  +  Σ_k N_k β_k − Σ_s Σ_k β_k r_k(s)              [Hua2023] Eq. (17), β_k = α_k / N_k
//     A β = b,   A_jk = Σ_s w r_j r_k,   b_k = Σ_s w (f/p) r_k      [Hua2023] Eq. (21), (25), (29)
//
// where the sums in A and b are over the samples of all vertices that share the coefficients, and w is their weight in
// the image's error. A constant β cancels: the plain estimate is one of the candidates.
//
// The first techniques are lights (or clusters of them), at most one of which could have produced a given sample, so
// that their part of A is diagonal; the others (directions by the BSDF or its lobes, the environment) form a small
// dense block.
//
// Densities of a mixture as control variates are from [OwenZhou2000]. Beyond [Hua2023], a system's solution is shrunk
// towards that of its surroundings (the *prior*), with a weight of a few samples per technique. So a technique without
// samples keeps the prior's value and does not affect the others, a singular system has a solution, and with little
// data the plain estimate remains.
#pragma once

#include <cstdint>
#include <span>

#include "core/spectrum.h"

namespace covary {

/// Layout of a system in flat arrays: one head for the cell, and one row for each light seen in it.
struct SystemLayout {
  static constexpr uint32_t kMaxDense = 64;
  uint32_t n_dense = 0;     ///< techniques of the dense block, at most kMaxDense
  bool by_channel = false;  ///< each colour channel has its own weights, and so its own matrix A

  // Head. Σ is over samples, each with the weight w of its vertex; RGB entries take three numbers.
  static constexpr uint32_t kWeight = 0;         ///< Σ w
  static constexpr uint32_t kWeightSquared = 1;  ///< Σ w²
  static constexpr uint32_t kValue = 2;          ///< Σ w f/p, RGB
  // Over held-out vertices, with plain estimate e and control c; weighted by w except for the first.
  static constexpr uint32_t kHeldOut = 5;          ///< number of vertices
  static constexpr uint32_t kHeldOutWeight = 6;    ///< Σ w
  static constexpr uint32_t kPlain = 7;            ///< Σ w e, RGB
  static constexpr uint32_t kControl = 10;         ///< Σ w c, RGB
  static constexpr uint32_t kPlainControl = 13;    ///< Σ w e c, RGB
  static constexpr uint32_t kControlSquared = 16;  ///< Σ w c², RGB
  static constexpr uint32_t kDense = 19;
  /// b_j of dense technique j, RGB.
  uint32_t dense(uint32_t j) const { return kDense + 3 * j; }
  /// A of two dense techniques.
  uint32_t matrix(uint32_t i, uint32_t j) const {
    return kDense + 3 * n_dense + (i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i);
  }
  uint32_t matrix_size() const { return n_dense * (n_dense + 1) / 2; }
  /// If by_channel: Σ w, Σ w² and the dense part of A for channel c; the entries above then use the mean weight.
  uint32_t channel(uint32_t c) const { return kDense + 3 * n_dense + matrix_size() + c * (2 + matrix_size()); }
  uint32_t head_size() const { return channel(by_channel ? 3 : 0); }

  // Row of a light k.
  static constexpr uint32_t kDiagonal = 0;  ///< A_kk
  static constexpr uint32_t kRowValue = 1;  ///< b_k, RGB
  static constexpr uint32_t kRowDense = 4;  ///< A_kj for each dense technique j
  /// If by_channel: A_kk and A_kj for channel c.
  uint32_t channel_row(uint32_t c) const { return kRowDense + n_dense + c * (1 + n_dense); }
  uint32_t row_size() const { return channel_row(by_channel ? 3 : 0); }
  bool operator==(const SystemLayout&) const = default;
};

/// The sums of one cell, not owned.
struct SystemView {
  SystemLayout layout;
  std::span<const double> head;      ///< layout.head_size() numbers
  std::span<const uint32_t> lights;  ///< lights with samples, in increasing order
  std::span<const float> rows;       ///< layout.row_size() numbers for each of them
};

/// Coefficients β of a system's lights (in the order of its rows) and dense techniques, not owned.
struct CoefficientsView {
  std::span<Spectrum> lights, dense;
};

struct SolveSettings {
  /// Strength of the prior, as if each technique had this many additional samples that no other technique could have
  /// produced (r = 1) and whose value is the prior. At least 0; with 0, the prior decides only what the samples leave
  /// undetermined, and techniques whose weights r are always small have unbounded coefficients.
  double prior_samples = 0;
  bool monochrome = false;  ///< one coefficient for all channels: the best for the mean over RGB
};

/// Solves the system in time linear in the number of lights, [Hua2023] Eq. (32) and (33). `coefficients` contains the
/// prior on entry and the solution on return.
///
/// The solution is shrunk towards the prior up to a constant: the constant that makes the mean residual of the prior
/// vanish is added to it, but is not part of the result (equal coefficients have no effect, so prior and result can be
/// compared and inherited). A technique without samples keeps its prior. A zero prior and no samples give zeros, the
/// plain estimate. The result is finite whenever the sums are. If the layout is by channel, each channel is solved with
/// its own matrix.
void solve_block_arrow(const SystemView& system, const SolveSettings& settings, CoefficientsView coefficients);

/// Same by factorising the whole matrix, with one matrix for all channels, to check the former; cubic in the number of
/// lights.
void solve_dense(const SystemView& system, const SolveSettings& settings, CoefficientsView coefficients);

/// How much of a system's control to use, per channel in [0, 1]: the fraction s for which plain + s · control had the
/// least variance over vertices not used for the coefficients: a regression with an intercept, exact if the control
/// leaves a constant. `parent` is worth `prior_vertices` vertices; without data it is the result. With `monochrome`,
/// channels share one s.
Spectrum best_fraction(const SystemView& system, const Spectrum& parent, double prior_vertices, bool monochrome);

/// Weights of a vertex's samples in the sums, per channel: (throughput · importance)². `throughput` is that of the path
/// before the vertex ([Hua2023] Eq. 29); `importance` is 1 / √(value² + 0.01) with the approximate value of the pixel
/// for the relative variance (Eq. 25), and 1 for the absolute one.
inline Spectrum variance_weights(const Spectrum& throughput, const Spectrum& importance) {
  const Spectrum factor = throughput * importance;
  return factor * factor;
}
/// Their mean, for sums shared by the channels.
inline float variance_weight(const Spectrum& throughput, const Spectrum& importance) {
  return mean(variance_weights(throughput, importance));
}

}  // namespace covary
