// SPDX-License-Identifier: Apache-2.0
// Fits a mixture of von Mises-Fisher lobes to weighted directions: expectation maximisation (EM) with priors, splitting
// and merging of lobes [Ruppert2020] (Sec. 4 and 5; the settings are those of the library Open PGL).
//
// What is ours: the weights are scaled so that they add up to the effective number of samples (Σ w)² / Σ w², so that
// priors prevail where a few samples have all the weight; the concentration is the exact maximum, so that a step of EM
// never lowers the penalised likelihood.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sampling/vmf_mixture.h"

namespace covary {

/// Light that arrives at `position`.
struct GuidingSample {
  Vec3 position;
  Vec3 direction;              ///< unit vector, towards where the light comes from
  float inverse_distance = 0;  ///< 1 / distance to the next surface there; 0: infinitely far
  float weight = 0;            ///< radiance / pdf, at least 0
  float pdf = 1;               ///< density with which the direction was drawn, per unit solid angle, positive
  /// For the learned fraction (guiding_field.h): densities of the BSDF and of the guide alone (0: there was none), and
  /// the fraction of the BSDF that guiding may replace.
  float pdf_bsdf = 0, pdf_guide = 0, guidable = 0;
};

struct VmfFitSettings {
  int n_lobes = 16;    ///< at the beginning, 1 to VmfLobes::kMax
  int max_lobes = 32;  ///< after splitting, n_lobes to VmfLobes::kMax
  float initial_kappa = 5;
  double weight_prior = 0.01;      ///< samples added to each lobe
  double mean_cosine_prior = 0.2;  ///< samples of mean cosine 0 added to each lobe
  int max_steps = 100;             ///< of EM between two rounds of splitting and merging
  double tolerance = 0.001;        ///< ends EM: change of the penalised log-likelihood per sample
  double split_above = 0.5;        ///< part of a lobe in the χ² divergence of samples and mixture
  double merge_below = 0.025;      ///< χ² divergence of two lobes from the one that would replace them
  int max_rounds = 2;              ///< of splitting and merging
};

/// `n_lobes` equal lobes evenly over the sphere.
VmfMixture uniform_lobes(int n_lobes, float kappa, const Vec3& pivot);

/// Sums and steps of EM for one set of samples, which must outlive it. Positions are taken into account: a sample's
/// direction is that from the pivot to where its light comes from.
class VmfFit {
 public:
  /// Samples of weight 0 take part in nothing but the number of samples.
  VmfFit(std::span<const GuidingSample> samples, const Vec3& pivot, const VmfFitSettings& settings);
  /// Whether any sample has weight.
  bool has_light() const { return !directions_.empty(); }
  /// The effective number of samples.
  double effective_samples() const { return scaled_sum_; }

  /// Expectation and maximisation, once. Returns the penalised log-likelihood of the mixture before the step, divided
  /// by effective_samples(); it never decreases from step to step but for rounding.
  double step(VmfMixture& mixture) const;
  /// Steps until the likelihood settles. Returns their number.
  int converge(VmfMixture& mixture) const;
  /// Replaces pairs of lobes that one lobe describes as well. Returns how many.
  int merge(VmfMixture& mixture) const;
  /// Splits lobes that describe their samples badly, the worst first. Returns how many.
  int split(VmfMixture& mixture) const;
  /// All of it, from `start` (with this pivot) or, where it has no lobes, from uniform_lobes(). A mixture without lobes
  /// where no sample has weight.
  VmfMixture fit(VmfMixture start = {}) const;

 private:
  double penalty(const VmfLobes& lobes) const;

  VmfFitSettings settings_;
  Vec3 pivot_;
  std::vector<Vec3> directions_;
  std::vector<float> weights_, inverse_distances_, pdfs_;  // weights add up to scaled_sum_
  double scaled_sum_ = 0;
  double n_samples_ = 0;
};

}  // namespace covary
