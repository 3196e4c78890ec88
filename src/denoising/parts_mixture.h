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

/// MixtureInput::prior for the mean, measured (docs/methods/denoising.md).
inline constexpr float kPriorOfMean = 10;

struct MixedParts {
  CandidateSet whole;
  std::array<CandidateSet, 2> halves;
  std::array<Image, 2> counts;  ///< MixtureInput::counts; empty for a pair
  Mixture mixture;
};

/// The input for candidates of a part. `h`: mean of its independent image. `index`: CandidateInput::part. The other
/// arguments must outlive the result.
CandidateInput input_of(const DenoisingPart& part, const Image& h, const std::vector<unsigned char>& valid, int index);

/// Each part's image and candidates. The parts are all samples, both halves, or all of these; `first`: 1 for the
/// halves.
std::vector<CandidateSet> candidates_of(const std::vector<const DenoisingPart*>& parts,
                                        const std::vector<unsigned char>& valid,
                                        const std::vector<CandidateMaker>& makers, int first = 0);

/// The same in two steps: those of the parts alone, and then those that consist of the others.
std::vector<CandidateSet> made_candidates(const std::vector<const DenoisingPart*>& parts,
                                          const std::vector<unsigned char>& valid,
                                          const std::vector<CandidateMaker>& makers, int first = 0);
void add_weighed(const std::vector<const DenoisingPart*>& parts, const std::vector<unsigned char>& valid,
                 const std::vector<CandidateMaker>& makers, int first, std::vector<CandidateSet>& sets);

/// The first candidate, an image with little noise.
inline const Image& guide_of(const CandidateSet& set) { return set.candidates[0]; }

/// Samples of all pixels, and per pixel; without counts, one in each group.
double all_samples(const GroupedImage& image);
double mean_samples(const GroupedImage& image);

/// Whether any candidates come from a neural network.
bool has_network(const std::vector<CandidateMaker>& makers);

/// What all rows of an image share.
struct WholeImage {
  double samples = 0;             ///< mean_samples()
  std::vector<float> everywhere;  ///< MixtureInput::everywhere
};

/// `whole`: the image, if the parts are rows of it.
MixedParts mix_parts(const DenoisingParts& parts, const std::vector<CandidateMaker>& makers,
                     const PartsWeighting& chosen, const WholeImage* whole = nullptr);

/// The mixture of these candidates, of all samples and of both halves.
MixedParts mix_sets(const DenoisingParts& parts, std::vector<CandidateSet> sets,
                    const std::vector<CandidateMaker>& makers, const PartsWeighting& chosen,
                    const WholeImage* whole = nullptr);

/// The sums over rows first … end - 1 from which WholeImage::everywhere follows. `sets`: the candidates of both
/// halves.
std::vector<NormalRow> normal_rows_of(const DenoisingParts& parts, std::vector<CandidateSet> sets,
                                      const PartsWeighting& chosen, int first, int end);
/// WholeImage::everywhere from the rows of the sample; empty if there is no prior. `samples`: mean_samples().
std::vector<float> weights_of_whole(bool is_mean, const std::vector<CandidateMaker>& makers,
                                    const PartsWeighting& chosen, double samples, const std::vector<NormalRow>& rows);

/// Radius of influence of the candidates on the mixture, in rows; cells are aligned to multiples of kResidualCell.
int mixture_halo(bool is_mean, const PartsWeighting& chosen);

}  // namespace covary
