// SPDX-License-Identifier: Apache-2.0
#include "denoising/mixed_denoising.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "denoising/denoise.h"
#include "denoising/mixture.h"
#include "filters/feedback.h"
#include "risk/halves.h"
#include "risk/held_out_bias.h"
#include "risk/held_out_error.h"

namespace covary {
namespace {

struct ModeSettings {
  DenoiseMode mode;
  const char* name;
  float bias_share, prior;
  bool feedback;
};
constexpr ModeSettings kModes[] = {{DenoiseMode::kNone, "none", 1, 0, false},
                                   {DenoiseMode::kBias, "bias", 4, 0, true},
                                   {DenoiseMode::kBalanced, "balanced", 2, 0, true},
                                   {DenoiseMode::kError, "error", 1, 1, false}};

ModeSettings settings_of(DenoiseMode mode) {
  return *std::find_if(std::begin(kModes), std::end(kModes), [&](const ModeSettings& m) { return m.mode == mode; });
}

/// Memory beside that of the estimator, about: images of three sets of samples, planes of filters and sums, half of 12
/// groups; with the network, what that takes and its candidates.
constexpr double kBytesPerPixel = 510, kBytesWithOidn = 1280;

/// The image of one set of samples, and what candidates are made of.
struct Part {
  EstimatorResult base;
  Moments independent;
  CandidateSet set;
};

Image interior(const Planes& planes) {
  Image image(planes.width(), planes.height(), 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = planes.row(c, y)[x];
  return image;
}

Part make_part(const Estimator& base, const GroupedImage& crn, const GroupedImage& independent, PairSettings settings,
               const std::vector<unsigned char>& valid, const std::vector<CandidateMaker>& makers) {
  settings.std_error = true;
  settings.held_out = false;
  Part part;
  part.base = base.apply(crn, independent, settings);
  part.independent = moments(independent, valid, 0, 0.0f);
  const Image h = interior(part.independent.mean);
  // Pixels that the estimator leaves out may hold anything.
  for (Image* image : {&part.base.estimate, &part.base.std_error})
    for (float& value : image->data)
      if (!std::isfinite(value)) value = 0;
  for (const CandidateMaker& maker : makers)
    for (Image& image : maker.make({&part.base.estimate, &part.base.std_error, &h, &valid}))
      part.set.candidates.push_back(std::move(image));
  part.set.base = part.base.estimate;
  return part;
}

/// The first candidate: the estimator's image with little noise.
const Image& guide_of(const Part& part) { return part.set.candidates[0]; }

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

MixedDenoising denoise_by_mixture(const Estimator& base, const GroupedImage& crn, const GroupedImage& independent,
                                  const PairSettings& settings, const std::vector<CandidateMaker>& makers,
                                  DenoiseMode mode) {
  if (settings.guides.albedo) check_guide("the guide albedo", *settings.guides.albedo);
  if (settings.guides.normal) check_guide("the guide normal", *settings.guides.normal);
  long n_nonfinite = 0;
  const std::vector<unsigned char> valid = finite_pixels(crn, independent, n_nonfinite);
  const ModeSettings chosen = settings_of(mode);
  Part whole = make_part(base, crn, independent, settings, valid, makers);
  std::array<Part, 2> halves;
  for (int half : {0, 1}) {
    const HalfImage half_crn(crn, half), half_independent(independent, half);
    PairSettings half_settings = settings;
    half_settings.crn_samples = std::max<int64_t>(1, settings.crn_samples / 2);
    halves[half] = make_part(base, half_crn.view(), half_independent.view(), half_settings, valid, makers);
  }
  MixtureInput input;
  input.whole = &whole.set;
  input.halves = {&halves[0].set, &halves[1].set};
  input.independent = {&halves[0].independent, &halves[1].independent};
  input.guide = &guide_of(whole);
  input.valid = &valid;
  input.bias_share = chosen.bias_share;
  input.prior = chosen.prior;
  Mixture mixture = mix(input);
  if (chosen.feedback) {
    add_feedback(whole.independent, {}, valid, whole.base.std_error, mixture.image);
    for (int half : {0, 1})
      add_feedback(halves[half].independent, {}, valid, halves[half].base.std_error, mixture.halves[half]);
  }

  MixedDenoising out;
  out.result = std::move(whole.base);
  out.result.std_error = Image();
  if (settings.std_error) {
    const std::array<const Image*, 2> images = {&mixture.halves[0], &mixture.halves[1]};
    double usual = 0.5;
    for (const CandidateMaker& maker : makers) usual = std::max(usual, maker.error_over_variance);
    out.result.std_error = held_out_error({images, input.independent, input.guide, &valid, usual});
    out.result.bias = held_out_bias({images, {&guide_of(halves[0]), &guide_of(halves[1])}, input.independent, &valid});
  }
  out.result.estimate = std::move(mixture.image);
  for (const CandidateMaker& maker : makers) out.names.insert(out.names.end(), maker.names.begin(), maker.names.end());
  out.weights = std::move(mixture.weights);
  out.candidates = std::move(whole.set.candidates);
  return out;
}

bool can_be_denoised(const Estimator& estimator) {
  return estimator.apply && estimator.predicts_error && !estimator.adaptive;
}

Estimator with_denoising(const Estimator& base, const MixedDenoisingOptions& options) {
  if (options.mode == DenoiseMode::kNone) return base;
  if (!can_be_denoised(base))
    throw Error(ErrorCode::kUsage,
                "denoising needs an estimator of two passes that predicts its error, not " + base.name);
  if (options.use_oidn && !options.oidn.library.empty()) denoiser_info(options.oidn);  // throws before rendering
  const bool with_oidn = options.use_oidn && (!options.oidn.library.empty() || !find_denoiser(options.oidn).empty());
  Estimator estimator = base;
  estimator.text += fmt::format(" --denoise {}{}", settings_of(options.mode).name, with_oidn ? "" : " --oidn off");
  estimator.fewest_groups = 2 * base.fewest_groups;
  estimator.reads_guides = true;
  estimator.reach = -1;
  estimator.explain = nullptr;
  estimator.memory.always += with_oidn ? kBytesWithOidn : kBytesPerPixel;
  estimator.memory.of_halves = estimator.memory.of_halves_per_group = 0;  // part of that
  const auto makers = [options, with_oidn](const Guides& guides) {
    std::vector<CandidateMaker> all = {filtered_candidates(guides)};
    if (with_oidn) all.push_back(neural_candidates(guides, options.oidn));
    return all;
  };
  const auto run = [base, options, makers](const GroupedImage& crn, const GroupedImage& independent,
                                           const PairSettings& settings) {
    return denoise_by_mixture(base, crn, independent, settings, makers(settings.guides), options.mode);
  };
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

void declare(Settings& s, DenoisingChoice& v) {
  s.group("Denoising");
  s.one_of("denoise", v.mode, denoise_mode_names(),
           "Mix the image with denoised ones where held-out samples find that better: for least bias, for least error, "
           "or balanced",
           {.level = OptionLevel::kBasic});
  s.text("oidn", v.oidn, "off|LIBRARY",
         "For `denoise`: Open Image Denoise's library or a folder of it; default: where it is found; 'off': without it",
         {.names = OptionNames::kLibrary});
  s.only_if(v.denoises(), {"oidn"}, "without `denoise` bias, balanced or error");
}

}  // namespace covary
