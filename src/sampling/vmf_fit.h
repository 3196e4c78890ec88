// SPDX-License-Identifier: Apache-2.0
// Fits mixtures of von Mises-Fisher lobes to weighted directions: expectation maximisation (EM) with priors, splitting
// and merging of lobes [Ruppert2020] (Sec. 4 and 5; settings of the Open PGL library).
//
// Unlike there, weights are scaled to sum to the effective number of samples (Σ w)² / Σ w², so that priors prevail if a
// few samples have all the weight; the concentration is the exact maximum, so that an EM step never lowers the
// penalised likelihood.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sampling/vmf_mixture.h"

namespace covary {

/// Light arriving at `position`.
struct GuidingSample {
  Vec3 position;
  Vec3 direction;              ///< unit vector towards the light's origin
  float inverse_distance = 0;  ///< 1 / distance to the next surface in that direction; 0: infinitely far
  float weight = 0;            ///< radiance / pdf, at least 0
  float pdf = 1;               ///< density with which the direction was sampled, per unit solid angle, positive
  float outgoing = 0;  ///< radiance that `position` sends along the path, estimated by the rest of the path, at least 0
};

struct VmfFitSettings {
  int n_lobes = 16;    ///< initially, 1 to VmfLobes::kMax
  int max_lobes = 32;  ///< after splitting, n_lobes to VmfLobes::kMax
  float initial_kappa = 5;
  double weight_prior = 0.01;      ///< pseudo-samples added to each lobe
  double mean_cosine_prior = 0.2;  ///< pseudo-samples of mean cosine 0 added to each lobe
  int max_steps = 100;             ///< EM steps between rounds of splitting and merging
  double tolerance = 0.001;        ///< ends EM: change in penalised log-likelihood per sample
  double split_above = 0.5;        ///< contribution of a lobe to the χ² divergence between samples and mixture
  double merge_below = 0.025;      ///< χ² divergence of two lobes from the lobe that would replace them
  int max_rounds = 2;              ///< rounds of splitting and merging
};

/// `n_lobes` equal lobes, evenly distributed over the sphere.
VmfMixture uniform_lobes(int n_lobes, float kappa, const Vec3& pivot);

/// Sums and EM steps for one set of samples, which must outlive it. Accounts for parallax: a sample's direction is that
/// from the pivot to the origin of its light.
class VmfFit {
 public:
  /// Samples of weight 0 count only in the number of samples.
  VmfFit(std::span<const GuidingSample> samples, const Vec3& pivot, const VmfFitSettings& settings);
  /// Whether any sample has weight.
  bool has_light() const { return !directions_.empty(); }
  /// The effective number of samples.
  double effective_samples() const { return scaled_sum_; }

  /// One step of expectation and maximisation. Returns the penalised log-likelihood of the mixture before the step,
  /// divided by effective_samples(); never decreases between steps except by rounding.
  double step(VmfMixture& mixture) const;
  /// Iterates until the likelihood converges. Returns the number of steps.
  int converge(VmfMixture& mixture) const;
  /// Merges pairs of lobes that one lobe describes as well. Returns their number.
  int merge(VmfMixture& mixture) const;
  /// Splits lobes that describe their samples poorly, worst first. Returns their number.
  int split(VmfMixture& mixture) const;
  /// The whole fit, starting from `start` (with its pivot) or, if it has no lobes, from uniform_lobes(). Returns a
  /// mixture without lobes if no sample has weight.
  VmfMixture fit(VmfMixture start = {}) const;

 private:
  double penalty(const VmfLobes& lobes) const;

  VmfFitSettings settings_;
  Vec3 pivot_;
  std::vector<Vec3> directions_;
  std::vector<float> weights_, inverse_distances_, pdfs_;  // weights sum to scaled_sum_
  double scaled_sum_ = 0;
  double n_samples_ = 0;
};

}  // namespace covary
