// SPDX-License-Identifier: Apache-2.0
#include "denoising/mixed_denoising.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <iterator>

#include "core/error.h"
#include "core/parallel.h"
#include "denoising/denoise.h"
#include "denoising/layers.h"
#include "denoising/mixture.h"
#include "filters/residual_correction.h"
#include "risk/held_out_bias.h"
#include "risk/held_out_error.h"
#include "risk/image_risk.h"
#include "risk/predicted_error.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

struct ModeSettings {
  DenoiseMode mode;
  const char* name;
  float bias_share, prior;
  bool residual_correction;
};
constexpr ModeSettings kModes[] = {{DenoiseMode::kNone, "none", 1, 0, false},
                                   {DenoiseMode::kAuto, "auto", 1, 1, false},
                                   {DenoiseMode::kBias, "bias", 4, 0, true},
                                   {DenoiseMode::kBalanced, "balanced", 2, 0, true},
                                   {DenoiseMode::kError, "error", 1, 1, false}};

ModeSettings settings_of(DenoiseMode mode) {
  return *std::find_if(std::begin(kModes), std::end(kModes), [&](const ModeSettings& m) { return m.mode == mode; });
}

/// Memory beside that of the estimator, about: images of three sets of samples, planes of filters and sums, half of 12
/// groups; of the mean, it without fireflies; with the network, what that takes and its candidates.
constexpr double kBytesPerPixel = 480, kBytesOfMean = 220, kBytesWithOidn = 1400;

/// Of the mean: what its variance counts beside its square, and how much the weights of the whole image count; both
/// measured (docs/methods/denoising.md).
constexpr float kCountOfVariance = 2, kPriorOfMean = 10;

/// Weights of candidates around a mean that have the least error with 16 samples if all pixels of all scenes have the
/// same; measured (docs/notes/denoising.md).
struct UsualWeight {
  const char* name;
  float with_network, without;
};
constexpr UsualWeight kUsual[] = {
    {"oidn", 0.85f, 0}, {"oidn-wide", 0.05f, 0}, {"sharp", 0.05f, 0.4f}, {"demodulated", 0.05f, 0.6f}};

/// How much usual weights count for those of the whole image, with so many samples per pixel or fewer; less with more.
constexpr float kCountOfUsual = 0.2f, kSamplesOfUsual = 16;

/// `h`: the mean of its independent image.
CandidateInput input_of(const DenoisingPart& part, const Image& h, const std::vector<unsigned char>& valid) {
  if (const auto& limited = part.limited)
    return {&limited->estimate, &limited->std_error, &h, &limited->independent, &valid};
  return {&part.image.estimate, &part.image.std_error, &h, &part.independent, &valid};
}

/// Of each of the parts.
std::vector<CandidateSet> candidates_of(const std::vector<const DenoisingPart*>& parts,
                                        const std::vector<unsigned char>& valid,
                                        const std::vector<CandidateMaker>& makers) {
  std::deque<Image> h;
  std::vector<CandidateInput> inputs;
  std::vector<CandidateSet> sets;
  for (const DenoisingPart* part : parts) {
    h.push_back(mean_image(part->independent));
    inputs.push_back(input_of(*part, h.back(), valid));
    sets.push_back({part->image.estimate, {}});
  }
  for (const CandidateMaker& maker : makers) {
    std::vector<std::vector<Image>> images = maker.make(inputs);
    for (size_t i = 0; i < sets.size(); ++i)
      std::move(images[i].begin(), images[i].end(), std::back_inserter(sets[i].candidates));
  }
  return sets;
}

/// The first candidate: the image with little noise.
const Image& guide_of(const CandidateSet& set) { return set.candidates[0]; }

/// What errors of a half's pixels count where its image is noisy: 1 / (G'^2 + 0.01 + 2 s^2), G: the image with little
/// noise, s: the standard error. By the noisy image itself, pixels that are bright by chance would count little.
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

/// relMSE of the image itself, by its standard error.
double risk_of_base(const DenoisingPart& part, const Image& guide, const std::vector<unsigned char>& valid) {
  double sum = 0, n = 0;
  for (size_t i = 0; i < valid.size(); ++i) {
    if (!valid[i]) continue;
    const float weight = relative_weight(&guide.data[3 * i]);
    for (size_t c = 0; c < 3; ++c) sum += weight * sqr(part.image.std_error.data[3 * i + c]);
    n += 3;
  }
  return n > 0 ? sum / n : 0;
}

/// Those of the parts from the predicted one, by how held-out samples tell them apart.
MeasuredRisks risks_of(const DenoisingParts& parts, const std::array<CandidateSet, 2>& halves,
                       const std::vector<std::string>& names, const HeldOutInput& mixture, double predicted) {
  const HalvesRisk mixed = risk_of_halves(mixture);
  MeasuredRisks risks{.held_out = mixed.of_whole(), .bias_share = 0, .images = {}};
  if (predicted > 0) risks.bias_share = std::clamp(1 - 0.5 * mixed.variance / predicted, 0.0, 1.0);
  risks.images.push_back({parts.name, risk_of_base(parts.whole, *mixture.guide, parts.valid)});
  for (size_t p = 0; p < names.size(); ++p) {
    HeldOutInput candidate = mixture;
    candidate.halves = {&halves[0].candidates[p], &halves[1].candidates[p]};
    const HalvesRisk risk = risk_of_halves(candidate);
    risks.images.push_back({names[p], std::max(predicted + risk.of_whole() - mixed.of_whole(), 0.5 * risk.variance)});
  }
  return risks;
}

/// Of a mean.
std::vector<Image> layers_of(const DenoisingParts& parts, const std::vector<CandidateMaker>& makers,
                             const MixedDenoising& mixture, std::span<const Layer> layers) {
  if (layers.empty()) return {};
  const Image h = mean_image(parts.whole.independent);
  return denoise_layers({&mixture.result.estimate, &parts.groups, layers, input_of(parts.whole, h, parts.valid), makers,
                         mixture.weights});
}

int runs_of(const std::vector<CandidateMaker>& makers) {
  int runs = 0;
  for (const CandidateMaker& maker : makers) runs += maker.runs ? maker.runs() : 0;
  return runs;
}

float count_of_usual(const GroupedImage& image) {
  double samples = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) samples += image.count(x, y);
  samples /= static_cast<double>(image.width) * image.height;
  return kCountOfUsual * static_cast<float>(std::min(1.0, kSamplesOfUsual / std::max(samples, 1.0)));
}

bool has_network(const std::vector<CandidateMaker>& makers) {
  return std::any_of(makers.begin(), makers.end(), [](const CandidateMaker& m) { return m.network; });
}

/// Of all candidates, with a sum of 1; empty where none is known.
std::vector<float> usual_weights(const std::vector<CandidateMaker>& makers) {
  const bool network = has_network(makers);
  std::vector<float> weights;
  float sum = 0;
  for (const CandidateMaker& maker : makers)
    for (const std::string& name : maker.names) {
      const auto usual =
          std::find_if(std::begin(kUsual), std::end(kUsual), [&](const UsualWeight& u) { return name == u.name; });
      weights.push_back(usual == std::end(kUsual) ? 0 : network ? usual->with_network : usual->without);
      sum += weights.back();
    }
  if (sum == 0) return {};
  for (float& weight : weights) weight /= sum;
  return weights;
}

/// HeldOutInput::error_over_variance
double usual_error(const std::vector<CandidateMaker>& makers) {
  double usual = 0.5;
  for (const CandidateMaker& maker : makers) usual = std::max(usual, maker.error_over_variance);
  return usual;
}

ErrorKind kind_of(const std::vector<CandidateMaker>& makers, bool is_mean) {
  const bool network = has_network(makers);
  if (is_mean) return network ? ErrorKind::kNetwork : ErrorKind::kFilters;
  return network ? ErrorKind::kPairNetwork : ErrorKind::kPairFilters;
}

void check_guides(const Guides& guides) {
  if (guides.albedo) check_guide("the guide albedo", *guides.albedo);
  if (guides.normal) check_guide("the guide normal", *guides.normal);
  if (guides.denoising_albedo) check_guide("the guide albedo behind glass", *guides.denoising_albedo);
  if (guides.denoising_normal) check_guide("the guide normal behind glass", *guides.denoising_normal);
}

}  // namespace

const std::vector<std::string>& denoise_mode_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const ModeSettings& mode : kModes) all.emplace_back(mode.name);
    return all;
  }();
  return names;
}

DenoiseMode denoise_mode(const std::string& name) {
  for (const ModeSettings& mode : kModes)
    if (name == mode.name) return mode.mode;
  throw Error(ErrorCode::kUsage,
              fmt::format("`denoise` '{}': expected {}", name, fmt::join(denoise_mode_names(), ", ")));
}

MixedDenoising denoise_by_mixture(DenoisingParts parts, const std::vector<CandidateMaker>& makers, DenoiseMode mode,
                                  bool std_error, std::span<const Layer> layers, const History* history) {
  const ModeSettings chosen = settings_of(mode);
  const std::vector<unsigned char>& valid = parts.valid;
  std::vector<CandidateSet> sets = candidates_of({&parts.whole, &parts.halves[0], &parts.halves[1]}, valid, makers);
  CandidateSet whole = std::move(sets[0]);
  const std::array<CandidateSet, 2> halves = {std::move(sets[1]), std::move(sets[2])};
  MixtureInput input;
  input.whole = &whole;
  input.halves = {&halves[0], &halves[1]};
  input.independent = {&parts.halves[0].independent, &parts.halves[1].independent};
  input.guide = &guide_of(whole);
  input.valid = &valid;
  input.bias_share = chosen.bias_share;
  input.prior = parts.is_mean ? kPriorOfMean : chosen.prior;
  if (parts.is_mean) input.usual = usual_weights(makers);
  if (!input.usual.empty()) input.usual_count = count_of_usual(parts.groups);
  std::array<Image, 2> counts;
  for (int half = 0; parts.is_mean && half < 2; ++half) {
    counts[half] = counts_of(parts.halves[half], guide_of(halves[half]));
    input.counts[half] = &counts[half];
  }
  Mixture mixture = mix(input);
  if (chosen.residual_correction && !parts.is_mean) {
    add_residual_correction(parts.whole.independent, {}, valid, parts.whole.image.std_error, mixture.image);
    for (int half : {0, 1})
      add_residual_correction(parts.halves[half].independent, {}, valid, parts.halves[half].image.std_error,
                              mixture.halves[half]);
  }

  const std::array<const Image*, 2> images = {&mixture.halves[0], &mixture.halves[1]};
  const Image place = disagreement(whole, *input.guide, mixture.image);
  const HeldOutInput held_out{images, input.independent, input.guide, &valid, usual_error(makers), &place};

  MixedDenoising out;
  for (const CandidateMaker& maker : makers) out.names.insert(out.names.end(), maker.names.begin(), maker.names.end());
  EstimatorResult& result = out.result;
  result.nonfinite_pixels = parts.whole.image.nonfinite_pixels;
  result.estimate = mixture.image;
  if (std_error) {
    result.std_error = held_out_error(held_out);
    result.bias = held_out_bias({images, {&guide_of(halves[0]), &guide_of(halves[1])}, input.independent, &valid});
    result.risk_rows = image_risk(
        {&result.estimate, images, &parts.whole.independent, input.independent, &parts.groups, input.guide, &valid});
    result.risk_kind = kind_of(makers, parts.is_mean);
    result.risks = risks_of(parts, halves, out.names, held_out, predicted_relmse(result));
  }
  if (history) {  // after the error, which is that of the frame alone
    const Image frame_error = std_error ? result.std_error : held_out_error(held_out);
    add_history(*history, {input.independent, &frame_error, input.guide, &valid, input.counts}, mixture);
    result.estimate = std::move(mixture.image);
  }
  out.weights = std::move(mixture.weights);
  out.candidates = std::move(whole.candidates);
  result.layers = layers_of(parts, makers, out, layers);
  result.network_runs = runs_of(makers);
  return out;
}

namespace {

bool is_mean(const Estimator& estimator) { return estimator.passes == EstimatorPasses::kAny; }

/// Whether halves of the samples are enough to judge candidates.
bool can_be_mixed(const GroupedImage& image) {
  if (image.groups < 2) return false;
  const size_t n_pixels = static_cast<size_t>(image.width) * image.height;
  return !image.counts ||
         std::all_of(image.counts, image.counts + n_pixels, [](uint32_t n) { return n >= kFewestMixedSamples; });
}

/// The candidate that was measured to be best where samples are few; without any the mean itself.
MixedDenoising single_candidate(const GroupedImage& independent, const std::vector<CandidateMaker>& makers,
                                std::span<const Layer> layers) {
  DenoisingParts parts = whole_of_mean(independent);
  CandidateSet set = std::move(candidates_of({&parts.whole}, parts.valid, makers)[0]);
  MixedDenoising out;
  for (const CandidateMaker& maker : makers) out.names.insert(out.names.end(), maker.names.begin(), maker.names.end());
  const size_t best = static_cast<size_t>(makers[0].best_of_few);
  out.result = parts.whole.image;
  out.result.std_error = Image();
  for (size_t i = 0; i < parts.valid.size(); ++i)
    if (parts.valid[i]) std::copy_n(&set.candidates[best].data[3 * i], 3, &out.result.estimate.data[3 * i]);
  out.result.note = fmt::format(
      "fewer than {} samples per pixel are too few to judge denoised images by: the picture is the candidate '{}', and "
      "its error is not known",
      kFewestMixedSamples, out.names[best]);
  out.weights.assign(set.candidates.size(), Image(independent.width, independent.height, 1));
  std::fill(out.weights[best].data.begin(), out.weights[best].data.end(), 1.0f);
  out.candidates = std::move(set.candidates);
  out.result.layers = layers_of(parts, makers, out, layers);
  out.result.network_runs = runs_of(makers);
  return out;
}

/// What Estimator::apply and Estimator::stages have in common.
using Run = std::function<MixedDenoising(const GroupedImage& crn, const GroupedImage& independent,
                                         const PairSettings& settings)>;

Run run_of_pair(const Estimator& base, const MixedDenoisingOptions& options, bool with_oidn) {
  return [=](const GroupedImage& crn, const GroupedImage& independent, const PairSettings& settings) {
    check_guides(settings.guides);
    std::vector<CandidateMaker> makers = {filtered_candidates(settings.guides)};
    if (with_oidn) makers.push_back(neural_candidates(settings.guides, options.oidn));
    return denoise_by_mixture(parts_of_pair(base, crn, independent, settings), makers, options.mode, settings.std_error,
                              {}, options.history.get());
  };
}

Run run_of_mean(const MixedDenoisingOptions& options, bool with_oidn) {
  return [=](const GroupedImage&, const GroupedImage& independent, const PairSettings& settings) {
    check_guides(settings.guides);
    std::vector<CandidateMaker> makers;
    if (with_oidn) makers.push_back(neural_candidates(settings.guides, options.oidn, CandidateBase::kMean));
    makers.push_back(filtered_candidates(settings.guides, CandidateBase::kMean));
    if (!can_be_mixed(independent)) return single_candidate(independent, makers, settings.layers);
    return denoise_by_mixture(parts_of_mean(independent), makers, options.mode, settings.std_error, settings.layers,
                              options.history.get());
  };
}

}  // namespace

bool can_be_denoised(const Estimator& estimator) {
  return ((estimator.apply && !estimator.adaptive) || is_mean(estimator)) && estimator.predicts_error;
}

Estimator with_denoising(const Estimator& base, const MixedDenoisingOptions& options) {
  if (options.mode == DenoiseMode::kNone) return base;
  if (!can_be_denoised(base))
    throw Error(ErrorCode::kUsage, "denoising needs an estimator that predicts its error, not " + base.name);
  const bool with_oidn = options.use_oidn && (!options.oidn.library.empty() || !find_denoiser(options.oidn).empty());
  Estimator estimator = base;
  if (with_oidn) estimator.network = "Open Image Denoise " + denoiser_info(options.oidn).version;  // or throws
  estimator.text += fmt::format(" --denoise {}{}", settings_of(options.mode).name, with_oidn ? "" : " --oidn off");
  estimator.fewest_groups = 2 * base.fewest_groups;
  estimator.reads_guides = true;
  estimator.reach = -1;
  estimator.explain = nullptr;
  estimator.memory.always += with_oidn ? kBytesWithOidn : kBytesPerPixel + (is_mean(base) ? kBytesOfMean : 0);
  estimator.memory.of_halves = estimator.memory.of_halves_per_group = 0;  // part of that
  if (is_mean(base)) estimator.passes = EstimatorPasses::kIndependent, estimator.fewest_groups = 1;
  estimator.splits_layers = is_mean(base) && !base.adaptive;
  if (AdaptiveSampling* adaptive = estimator.adaptive ? &*estimator.adaptive : nullptr) {
    adaptive->counts.tops_up = true;
    if (!adaptive->names_allocation) adaptive->counts.allocation = Allocation::kDenoised;
  }
  const Run run = is_mean(base) ? run_of_mean(options, with_oidn) : run_of_pair(base, options, with_oidn);
  estimator.apply = [run](const GroupedImage& crn, const GroupedImage& independent, const PairSettings& settings) {
    return run(crn, independent, settings).result;
  };
  estimator.stages = [run](const GroupedImage& crn, const GroupedImage& independent, const PairSettings& settings) {
    MixedDenoising all = run(crn, independent, settings);
    std::map<std::string, Image> stages;
    for (size_t p = 0; p < all.names.size(); ++p) {
      stages["candidate-" + all.names[p]] = std::move(all.candidates[p]);
      stages["weight-" + all.names[p]] = std::move(all.weights[p]);
    }
    return stages;
  };
  return estimator;
}

void declare(Settings& s, DenoisingChoice& v, bool is_all) {
  s.group("Denoising");
  s.one_of("denoise", v.mode, denoise_mode_names(),
           "Mix the image with denoised ones where held-out samples find that better: for the least error (auto), or "
           "with less bias",
           {.level = OptionLevel::kBasic});
  s.text("oidn", v.oidn, "off|LIBRARY",
         std::string(is_all ? "For `denoise`" : "For `denoise` and `cv-surrogate` oidn") +
             ": Open Image Denoise's library or a folder of it; default: where it is found; 'off': without it",
         {.names = OptionNames::kLibrary});
  s.only_if(v.denoises() || !is_all, {"oidn"}, kNotDenoised);
}

std::string missing_network(const DenoisingChoice& choice) {
  if (!choice.uses_oidn() || !choice.oidn.empty() || !find_denoiser().empty()) return "";
  return "Open Image Denoise is not installed, so that the image is denoised by filters alone; `pip install pyoidn` "
         "brings it (`oidn` off: without these words)";
}

}  // namespace covary
