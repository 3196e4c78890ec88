// SPDX-License-Identifier: Apache-2.0
#include "denoising/parts_mixture.h"

#include <algorithm>
#include <deque>
#include <iterator>
#include <span>
#include <string>

#include "core/parallel.h"
#include "denoising/weighed_candidate.h"
#include "filters/residual_correction.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

/// The factor of a mean's variance in counts_of(), measured (docs/methods/denoising.md).
constexpr float kCountOfVariance = 2;

/// Typical weights of a mean's candidates: those of least error with 16 samples if all pixels of all scenes have the
/// same. Measured (docs/notes/denoising.md).
struct TypicalWeight {
  const char* name;
  float with_network, without;
};
constexpr TypicalWeight kTypical[] = {{"oidn", 0.85f, 0},
                                      {"oidn-wide", 0.05f, 0},
                                      {"regression", 0, 0.9f},
                                      {"sharp", 0.05f, 0.1f},
                                      {"demodulated", 0.05f, 0.1f}};
/// Those beside a candidate that consists of the others.
constexpr TypicalWeight kTypicalBesideWeighed[] = {
    {"regression", 0, 0.45f}, {"demodulated", 0, 0.05f}, {kWeighedName, 0, 0.5f}};

/// MixtureInput::typical_count up to kSamplesOfUsual samples per pixel; with more, it falls inversely to their number.
constexpr float kCountOfUsual = 0.2f, kSamplesOfUsual = 16;

/// The weights of squared errors of a half's noisy image, 1 / (G'^2 + 0.01 + 2 s^2), G: an image with little noise, s:
/// the standard error. Weighted by the noisy image itself, pixels that are bright by chance would count little.
Image counts_of(const DenoisingPart& part, const Image& guide) {
  Image counts(guide.width, guide.height, 1);
  parallel_for(guide.height, 16, [&](int y) {
    for (int x = 0; x < guide.width; ++x) {
      float variance = 0;
      for (int c = 0; c < 3; ++c) variance += sqr(part.image.std_error.pixel(x, y)[c]) / 3;
      *counts.pixel(x, y) = 1 / (1 / relative_weight(guide.pixel(x, y)) + kCountOfVariance * variance);
    }
  });
  return counts;
}

float typical_count_of(double samples) {
  return kCountOfUsual * static_cast<float>(std::min(1.0, kSamplesOfUsual / std::max(samples, 1.0)));
}

/// The typical weights of the candidates, with a sum of 1; empty if none is known.
std::vector<float> typical_weights(const std::vector<CandidateMaker>& makers) {
  const bool network = has_network(makers), is_weighed = !makers.empty() && makers.back().shares;
  const std::span<const TypicalWeight> known =
      is_weighed ? std::span<const TypicalWeight>(kTypicalBesideWeighed) : kTypical;
  std::vector<float> weights;
  float sum = 0;
  for (const CandidateMaker& maker : makers)
    for (const std::string& name : maker.names) {
      const auto typical =
          std::find_if(known.begin(), known.end(), [&](const TypicalWeight& u) { return name == u.name; });
      weights.push_back(typical == known.end() ? 0 : network ? typical->with_network : typical->without);
      sum += weights.back();
    }
  if (sum == 0) return {};
  for (float& weight : weights) weight /= sum;
  return weights;
}

/// A pixel unlike all others keeps its firefly in every filtered image. So candidates are clamped to the larger of two
/// brightnesses: this factor times the brightest of the 3 x 3 pixels of the network's image, the first candidate, and
/// the estimate minus two standard errors.
constexpr float kBrighterThanNetwork = 1.5f;

void limit_by_network(const CandidateInput& in, CandidateSet& set) {
  const Image& network = set.candidates[0];
  const auto sum = [](const Image& image, int x, int y) {
    const float* rgb = image.pixel(x, y);
    return rgb[0] + rgb[1] + rgb[2];
  };
  parallel_for(network.height, 16, [&](int y) {
    for (int x = 0; x < network.width; ++x) {
      float around = 0;
      for (int j = std::max(0, y - 1); j <= std::min(network.height - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(network.width - 1, x + 1); ++i)
          around = std::max(around, sum(network, i, j));
      const float limit =
          std::max(kBrighterThanNetwork * around, sum(*in.estimate, x, y) - 2 * sum(*in.std_error, x, y));
      for (size_t p = 1; p < set.candidates.size(); ++p) {
        const float own = sum(set.candidates[p], x, y);
        if (!(own > limit)) continue;
        for (int c = 0; c < 3; ++c) set.candidates[p].pixel(x, y)[c] *= limit / own;
      }
    }
  });
}

}  // namespace

double all_samples(const GroupedImage& image) {
  double samples = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) samples += image.count(x, y);
  return samples;
}

double mean_samples(const GroupedImage& image) {
  return all_samples(image) / (static_cast<double>(image.width) * image.height);
}

bool has_network(const std::vector<CandidateMaker>& makers) {
  return std::any_of(makers.begin(), makers.end(), [](const CandidateMaker& m) { return m.network; });
}

CandidateInput input_of(const DenoisingPart& part, const Image& h, const std::vector<unsigned char>& valid, int index) {
  if (const auto& limited = part.limited)
    return {&limited->estimate, &limited->std_error, &h, &limited->independent, &valid, index};
  return {&part.image.estimate, &part.image.std_error, &h, &part.independent, &valid, index};
}

std::vector<CandidateSet> candidates_of(const std::vector<const DenoisingPart*>& parts,
                                        const std::vector<unsigned char>& valid,
                                        const std::vector<CandidateMaker>& makers, int first) {
  std::vector<CandidateSet> sets = made_candidates(parts, valid, makers, first);
  add_weighed(parts, valid, makers, first, sets);
  return sets;
}

std::vector<CandidateSet> made_candidates(const std::vector<const DenoisingPart*>& parts,
                                          const std::vector<unsigned char>& valid,
                                          const std::vector<CandidateMaker>& makers, int first) {
  std::deque<Image> h;
  std::vector<CandidateInput> inputs;
  std::vector<CandidateSet> sets;
  for (const DenoisingPart* part : parts) {
    h.push_back(mean_image(part->independent));
    inputs.push_back(input_of(*part, h.back(), valid, first + static_cast<int>(sets.size())));
    sets.push_back({part->image.estimate, {}});
  }
  for (const CandidateMaker& maker : makers) {
    if (!maker.make) continue;
    std::vector<std::vector<Image>> images = maker.make(inputs);
    for (size_t i = 0; i < sets.size(); ++i)
      std::move(images[i].begin(), images[i].end(), std::back_inserter(sets[i].candidates));
  }
  for (size_t i = 0; i < sets.size(); ++i)
    if (parts[i]->limited && has_network(makers)) limit_by_network(inputs[i], sets[i]);
  return sets;
}

void add_weighed(const std::vector<const DenoisingPart*>& parts, const std::vector<unsigned char>& valid,
                 const std::vector<CandidateMaker>& makers, int first, std::vector<CandidateSet>& sets) {
  for (const CandidateMaker& maker : makers)
    for (size_t i = 0; maker.shares && i < sets.size(); ++i)
      add_weighed(maker, input_of(*parts[i], parts[i]->image.estimate, valid, first + static_cast<int>(i)), sets[i]);
}

namespace {

constexpr int kCellsHalo = 32;  // of guided_cells.h

/// The prior of the weights.
void set_prior(bool is_mean, const std::vector<CandidateMaker>& makers, const PartsWeighting& chosen, double samples,
               MixtureInput& input) {
  input.prior = is_mean ? kPriorOfMean : chosen.prior;
  if (is_mean) input.typical = typical_weights(makers);
  if (!input.typical.empty()) input.typical_count = typical_count_of(samples);
}

/// What the weights follow from: both halves.
MixtureInput input_of_halves(const DenoisingParts& parts, const PartsWeighting& chosen, MixedParts& mixed) {
  MixtureInput input;
  input.halves = {&mixed.halves[0], &mixed.halves[1]};
  input.independent = {&parts.halves[0].independent, &parts.halves[1].independent};
  input.valid = &parts.valid;
  input.bias_share = chosen.bias_share;
  for (int half = 0; parts.is_mean && half < 2; ++half) {
    mixed.counts[half] = counts_of(parts.halves[half], guide_of(mixed.halves[half]));
    input.counts[half] = &mixed.counts[half];
  }
  return input;
}

}  // namespace

int mixture_halo(bool is_mean, const PartsWeighting& chosen) {
  return kCellsHalo + (chosen.residual_correction && !is_mean ? residual_correction_halo({}) : 0);
}

std::vector<NormalRow> normal_rows_of(const DenoisingParts& parts, std::vector<CandidateSet> sets,
                                      const PartsWeighting& chosen, int first, int end) {
  MixedParts mixed{{}, {std::move(sets[0]), std::move(sets[1])}, {}, {}};
  return normal_rows(input_of_halves(parts, chosen, mixed), first, end);
}

std::vector<float> weights_of_whole(bool is_mean, const std::vector<CandidateMaker>& makers,
                                    const PartsWeighting& chosen, double samples, const std::vector<NormalRow>& rows) {
  MixtureInput input;
  set_prior(is_mean, makers, chosen, samples, input);
  if (input.prior == 0) return {};
  size_t m = 0;
  for (const CandidateMaker& maker : makers) m += maker.names.size();
  return weights_everywhere(input, static_cast<int>(m), rows);
}

MixedParts mix_parts(const DenoisingParts& parts, const std::vector<CandidateMaker>& makers,
                     const PartsWeighting& chosen, const WholeImage* whole) {
  return mix_sets(parts, candidates_of({&parts.whole, &parts.halves[0], &parts.halves[1]}, parts.valid, makers), makers,
                  chosen, whole);
}

MixedParts mix_sets(const DenoisingParts& parts, std::vector<CandidateSet> sets,
                    const std::vector<CandidateMaker>& makers, const PartsWeighting& chosen, const WholeImage* whole) {
  MixedParts mixed{std::move(sets[0]), {std::move(sets[1]), std::move(sets[2])}, {}, {}};
  MixtureInput input = input_of_halves(parts, chosen, mixed);
  input.whole = &mixed.whole;
  input.guide = &guide_of(mixed.whole);
  set_prior(parts.is_mean, makers, chosen, whole ? whole->samples : mean_samples(parts.groups), input);
  if (whole) input.everywhere = whole->everywhere;
  Mixture& mixture = mixed.mixture = mix(input);
  if (chosen.residual_correction && !parts.is_mean) {
    add_residual_correction(parts.whole.independent, {}, parts.valid, parts.whole.image.std_error, mixture.image);
    for (int half : {0, 1})
      add_residual_correction(parts.halves[half].independent, {}, parts.valid, parts.halves[half].image.std_error,
                              mixture.halves[half]);
  }
  return mixed;
}

}  // namespace covary
