// SPDX-License-Identifier: Apache-2.0
// The candidates of each set of samples, and their mixture (mixture.h).
#pragma once

#include <array>
#include <vector>

#include "denoising/candidates.h"
#include "denoising/denoising_parts.h"
#include "denoising/mixture.h"

namespace covary {

struct PartsWeighting {
  float bias_share = 1;              ///< MixtureInput::bias_share
  float prior = 0;                   ///< MixtureInput::prior for pairs
  bool residual_correction = false;  ///< add it to the mixture, for pairs
};

struct MixedParts {
  CandidateSet whole;
  std::array<CandidateSet, 2> halves;
  std::array<Image, 2> counts;  ///< MixtureInput::counts; empty for a pair
  Mixture mixture;
};

/// The input for candidates of a part. `h`: mean of its independent image. The arguments must outlive the result.
CandidateInput input_of(const DenoisingPart& part, const Image& h, const std::vector<unsigned char>& valid);

/// Each part's image and candidates.
std::vector<CandidateSet> candidates_of(const std::vector<const DenoisingPart*>& parts,
                                        const std::vector<unsigned char>& valid,
                                        const std::vector<CandidateMaker>& makers);

/// The first candidate, an image with little noise.
inline const Image& guide_of(const CandidateSet& set) { return set.candidates[0]; }

/// Samples per pixel; without counts, one in each group.
double mean_samples(const GroupedImage& image);

/// Whether any candidates come from a neural network.
bool has_network(const std::vector<CandidateMaker>& makers);

MixedParts mix_parts(const DenoisingParts& parts, const std::vector<CandidateMaker>& makers,
                     const PartsWeighting& chosen);

}  // namespace covary
