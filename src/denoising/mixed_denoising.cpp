// SPDX-License-Identifier: Apache-2.0
#include "denoising/mixed_denoising.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "core/error.h"
#include "denoising/denoise.h"
#include "denoising/frame_history.h"
#include "denoising/layers.h"
#include "denoising/mean_mixture.h"
#include "denoising/mixed_rows.h"
#include "denoising/mixing_memory.h"
#include "denoising/mixture.h"
#include "denoising/parts_mixture.h"
#include "denoising/rows_denoising.h"
#include "denoising/weighed_candidate.h"
#include "risk/plain_mean.h"

namespace covary {
namespace {

struct ModeSettings {
  DenoiseMode mode;
  const char* name;
  PartsWeighting weighting;
};
constexpr ModeSettings kModes[] = {{DenoiseMode::kNone, DenoisingChoice::kNone, {1, 0, false}},
                                   {DenoiseMode::kAuto, DenoisingChoice::kAuto, {1, 1, false}},
                                   {DenoiseMode::kBias, "bias", {4, 0, true}},
                                   {DenoiseMode::kBalanced, "balanced", {2, 0, true}},
                                   {DenoiseMode::kError, "error", {1, 1, false}}};

ModeSettings settings_of(DenoiseMode mode) {
  return *std::find_if(std::begin(kModes), std::end(kModes), [&](const ModeSettings& m) { return m.mode == mode; });
}

/// Of films; up to 20 groups, their number does not matter for memory.
constexpr int kTypicalGroups = 12;

/// The denoised layers of a mean.
std::vector<Image> layers_of(const DenoisingParts& parts, const std::vector<CandidateMaker>& makers,
                             const MixedDenoising& mixture, std::span<const Layer> layers) {
  if (layers.empty()) return {};
  const Image h = mean_image(parts.whole.independent);
  return denoise_layers({&mixture.result.estimate, &parts.groups, layers, input_of(parts.whole, h, parts.valid, 0),
                         makers, mixture.weights, &mixture.shares});
}

int runs_of(const std::vector<CandidateMaker>& makers) {
  int runs = 0;
  for (const CandidateMaker& maker : makers) runs += maker.runs ? maker.runs() : 0;
  return runs;
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

bool lowers_bias(DenoiseMode mode) { return settings_of(mode).weighting.bias_share > 1; }

DenoiseMode denoise_mode(const std::string& name) {
  for (const ModeSettings& mode : kModes)
    if (name == mode.name) return mode.mode;
  throw Error(ErrorCode::kUsage,
              fmt::format("`denoise` '{}': expected {}", name, fmt::join(denoise_mode_names(), ", ")));
}

MixedDenoising denoise_by_mixture(DenoisingParts parts, const std::vector<CandidateMaker>& makers, DenoiseMode mode,
                                  bool std_error, std::span<const Layer> layers, const MixingHistory& history) {
  const PartsWeighting chosen = settings_of(mode).weighting;
  MixedParts mixed = mix_parts(parts, makers, chosen);
  MixedDenoising out{.result = {}, .names = names_of(makers), .candidates = {}, .weights = {}, .shares = {}};
  MethodImage& result = out.result;
  result = finish(mixed_rows(parts, mixed, makers, std_error || history.is_used()), makers, parts.name);
  if (history.is_used()) {  // last: the error above is that of the frame alone
    use_history(history, parts, makers, chosen, result.std_error, mixed, result.kept_samples);
    result.estimate = std::move(mixed.mixture.image);
  }
  if (!std_error) result.std_error = {}, result.bias = {}, result.risk_rows.clear(), result.risks.reset();
  out.weights = std::move(mixed.mixture.weights), out.shares = std::move(mixed.whole.shares);
  out.candidates = std::move(mixed.whole.candidates);
  result.layers = layers_of(parts, makers, out, layers);
  result.network_runs = runs_of(makers);
  return out;
}

namespace {

/// Whether there are enough samples for halves to compare candidates.
bool can_be_mixed(const GroupedImage& image) {
  if (image.groups < 2) return false;
  const size_t n_pixels = static_cast<size_t>(image.width) * image.height;
  return !image.counts ||
         std::all_of(image.counts, image.counts + n_pixels, [](uint32_t n) { return n >= kMinMixedSamples; });
}

/// Why an image that can't be mixed has no error.
std::string why_unknown(const GroupedImage& image) {
  if (image.groups > 1 || (image.counts && mean_samples(image) < kMinMixedSamples))
    return fmt::format("with fewer than {} samples per pixel denoised images cannot be judged", kMinMixedSamples);
  if (image.counts)
    return "all samples are in one group, so that denoised images cannot be judged (2 or more `groups`, or a longer "
           "`time`)";
  return "one render alone does not tell its noise, which another one of a different seed would";
}

/// The candidate that was best with few samples in measurements.
MixedDenoising single_candidate(const GroupedImage& independent, const std::vector<CandidateMaker>& makers,
                                std::span<const Layer> layers) {
  DenoisingParts parts = whole_of_mean(independent);
  CandidateSet set = std::move(candidates_of({&parts.whole}, parts.valid, makers)[0]);
  MixedDenoising out{.result = {}, .names = names_of(makers), .candidates = {}, .weights = {}, .shares = {}};
  const size_t best = static_cast<size_t>(makers[0].best_of_few);
  out.result = parts.whole.image;
  out.result.std_error = Image();
  for (size_t i = 0; i < parts.valid.size(); ++i)
    if (parts.valid[i]) std::copy_n(&set.candidates[best].data[3 * i], 3, &out.result.estimate.data[3 * i]);
  const std::string why = why_unknown(independent);
  out.result.note =
      independent.groups < 2 && !has_network(makers)
          ? why + "; filters, which go by the noise between groups, leave the picture as it is"
          : fmt::format("{}: the picture is the candidate '{}', and its error is unknown", why, out.names[best]);
  out.weights.assign(set.candidates.size(), Image(independent.width, independent.height, 1));
  std::fill(out.weights[best].data.begin(), out.weights[best].data.end(), 1.0f);
  out.candidates = std::move(set.candidates);
  out.result.layers = layers_of(parts, makers, out, layers);
  out.result.network_runs = runs_of(makers);
  return out;
}

/// Shared by the image and its stages; `stages`: candidates and weights are wanted.
using Run = std::function<MixedDenoising(const Samples& samples, const MethodSettings& settings, bool stages)>;

/// The history with the frame's features applied to it.
MixingHistory history_of_frame(const MixedDenoisingOptions& options, const Features& features) {
  MixingHistory history = options.history;
  if (!history.before || !features.albedo || !features.normal) return history;
  const auto before = std::make_shared<History>(*history.before);
  follow_features(*before, *features.albedo, *features.normal);
  history.before = before;
  return history;
}

/// Keeps the frame's features for the next one.
void keep_features(const MixedDenoisingOptions& options, const Features& features, MethodImage& result) {
  if (!options.history.keep_samples || !features.albedo || !features.normal) return;
  result.kept_samples[2] = *features.albedo, result.kept_samples[3] = *features.normal;
}

/// denoise_by_mixture() of a frame.
MixedDenoising denoise_frame(DenoisingParts parts, const std::vector<CandidateMaker>& makers,
                             const MixedDenoisingOptions& options, const MethodSettings& settings,
                             std::span<const Layer> layers) {
  parts.features = settings.features;
  MixedDenoising out = denoise_by_mixture(std::move(parts), makers, options.mode, settings.std_error, layers,
                                          history_of_frame(options, settings.features));
  keep_features(options, settings.features, out.result);
  return out;
}

void add_note(const std::string& text, MethodImage& result) { result.note += (result.note.empty() ? "" : "; ") + text; }

/// Tells what is not made elsewhere although options.mix_mean is given.
void tell_that_made_here(const MixedDenoisingOptions& options, const char* what, MethodImage& result) {
  if (options.mix_mean) add_note(fmt::format("{} are denoised on the processor, not on the device", what), result);
}

/// Tells that the network did not run on the device that it should run on.
void tell_where_network_ran(const DenoiseOptions& oidn, MethodImage& result) {
  if (oidn.cuda_device >= 0 && !runs_on_cuda(oidn))
    add_note("Open Image Denoise ran on the processor: what is installed of it cannot use this device", result);
}

Run run_of_pair(const Method& base, const MixedDenoisingOptions& options, bool with_oidn) {
  return [=](const Samples& samples, const MethodSettings& settings, bool stages) {
    const auto& [crn, independent] = samples;
    check_features(settings.features, independent.width, independent.height);
    if (std::min(crn.groups, independent.groups) < 2 * base.min_groups) {
      MixedDenoising out;
      out.result = base.image(samples, settings);
      out.result.note =
          fmt::format("with fewer than {} groups denoised images cannot be judged: the picture is that of {} alone",
                      2 * base.min_groups, base.text);
      return out;
    }
    DenoisingParts parts = parts_of_pair(base, crn, independent, settings);
    parts.features = settings.features;
    const auto here = [&] {
      std::vector<CandidateMaker> makers = {filtered_candidates(settings.features)};
      if (with_oidn) makers.push_back(neural_candidates(settings.features, options.oidn));
      return denoise_frame(std::move(parts), makers, options, settings, {});
    };
    if (!options.mix_pair) return here();
    PairMixture request{&parts, settings_of(options.mode).weighting,         {}, settings.std_error,
                        stages, history_of_frame(options, settings.features)};
    if (with_oidn)
      request.network = [&] {
        return network_images(settings.features, options.oidn,
                              {mean_image(parts.whole.independent), mean_image(parts.halves[0].independent),
                               mean_image(parts.halves[1].independent)});
      };
    MixedDenoising out = options.mix_pair(request, here);
    if (with_oidn) tell_where_network_ran(options.oidn, out.result);
    keep_features(options, settings.features, out.result);
    return out;
  };
}

Run run_of_mean(const MixedDenoisingOptions& options, bool with_oidn) {
  return [=](const Samples& samples, const MethodSettings& settings, bool stages) {
    const GroupedImage& independent = samples.independent;
    check_features(settings.features, independent.width, independent.height);
    const FilterKinds kinds = kinds_of_mean(with_oidn);
    const auto here = [&]() -> MixedDenoising {
      std::vector<CandidateMaker> makers;
      if (with_oidn) makers.push_back(neural_candidates(settings.features, options.oidn, CandidateBase::kMean));
      makers.push_back(filtered_candidates(settings.features, CandidateBase::kMean, kinds));
      if (!can_be_mixed(independent)) return single_candidate(independent, makers, settings.layers);
      add_weighing_maker(settings.features, makers);
      return denoise_frame(parts_of_mean(independent), makers, options, settings, settings.layers);
    };
    if (!options.mix_mean) return here();
    if (!can_be_mixed(independent)) {
      MixedDenoising out = here();
      tell_that_made_here(options, "images of very few samples", out.result);
      return out;
    }
    MeanMixture request{independent, settings.features,  kinds,  settings_of(options.mode).weighting,
                        {},          settings.std_error, stages, settings.layers};
    if (with_oidn) {
      const NetworkCalls network = network_calls(settings.features, options.oidn);
      request.network = network.images, request.network_of_layers = network.layers;
    }
    request.history = history_of_frame(options, settings.features);
    MixedDenoising out = options.mix_mean(request, here);
    if (with_oidn) tell_where_network_ran(options.oidn, out.result);
    keep_features(options, settings.features, out.result);
    return out;
  };
}

/// The same for images in rows, without history and layers.
RowsMethod rows_of_mean(bool with_oidn) {
  RowsMethod method;
  method.halo_of_parts = kMeanHalo;
  method.parts = [](const Samples& rows, const MethodSettings& settings) {
    DenoisingParts parts = parts_of_mean(rows.independent);
    parts.features = settings.features;
    return parts;
  };
  method.filters = [with_oidn](const Features& features, const WantedRows& wanted) {
    return filtered_candidates(features, CandidateBase::kMean, kinds_of_mean(with_oidn), wanted);
  };
  method.are_enough = [](const Samples& rows) { return can_be_mixed(rows.independent); };
  method.of_few = [](const Samples& rows, const MethodSettings&, const std::vector<CandidateMaker>& makers) {
    return single_candidate(rows.independent, makers, {}).result;
  };
  return method;
}

RowsMethod rows_of_pair(const Method& base) {
  RowsMethod method;
  method.base = CandidateBase::kPair;
  method.halo_of_parts = base.halo + kFilledHalo;
  method.parts = [base](const Samples& rows, const MethodSettings& settings) {
    DenoisingParts parts = parts_of_pair(base, rows.crn, rows.independent, settings);
    parts.features = settings.features;
    return parts;
  };
  method.filters = [](const Features& features, const WantedRows& wanted) {
    return filtered_candidates(features, CandidateBase::kPair, FilterKinds::kNlMeans, wanted);
  };
  method.are_enough = [n = 2 * base.min_groups](const Samples& rows) {
    return std::min(rows.crn.groups, rows.independent.groups) >= n;
  };
  method.of_few = [run = run_of_pair(base, {}, false)](const Samples& rows, const MethodSettings& settings,
                                                       const std::vector<CandidateMaker>&) {
    return run(rows, settings, false).result;
  };
  return method;
}

/// Lets the method work on rows of images that are too large for memory.
void allow_rows(const Method& base, const MixedDenoisingOptions& options, bool with_oidn, Method& method) {
  method.halo = -1;
  if (base.halo < 0 || options.history.before || options.history.keep_samples) return;
  RowsMethod rows = base.is_mean() ? rows_of_mean(with_oidn) : rows_of_pair(base);
  rows.weighting = settings_of(options.mode).weighting;
  if (with_oidn) rows.network = options.oidn;
  method.halo = rows_halo(rows);
  method.memory.of_whole = bytes_of_whole(with_oidn);
  method.image_in_rows = [rows, options](const SamplesInRows& image, const MethodSettings& settings) {
    check_features(settings.features, image.width, image.height);
    MethodImage result = denoise_in_rows(image, settings, rows);
    tell_that_made_here(options, "images that are read in parts", result);
    return result;
  };
}

}  // namespace

bool can_be_denoised(const Method& method) {
  return ((method.pair() && !method.adaptive) || method.is_mean()) && method.predicts_error;
}

namespace {

/// The base's text under another name.
std::string text_as(const char* name, const Method& base) { return name + base.text.substr(base.name.size()); }

/// The passes of the base, of which `run` makes the mixture.
void set_image(const Method& base, const Run& run, Method& method) {
  if (base.is_mean())
    method.passes = OnePass{.image = [run](const GroupedImage& independent, const MethodSettings& settings) {
      return run({{}, independent}, settings, false).result;
    }};
  else
    method.passes =
        PassPair{.image =
                     [run](const GroupedImage& crn, const GroupedImage& independent, const MethodSettings& settings) {
                       return run({crn, independent}, settings, false).result;
                     },
                 .needs_sample_count = base.pair()->needs_sample_count,
                 .explain = {}};
  method.stages = [run](const Samples& samples, const MethodSettings& settings) {
    MixedDenoising all = run(samples, settings, true);
    std::map<std::string, Image> stages;
    for (size_t p = 0; p < all.names.size(); ++p) {
      stages["candidate-" + all.names[p]] = std::move(all.candidates[p]);
      stages["weight-" + all.names[p]] = std::move(all.weights[p]);
    }
    return stages;
  };
}

}  // namespace

Method with_denoising(const Method& base, const MixedDenoisingOptions& options) {
  Method method;
  if (options.mode == DenoiseMode::kNone) {
    method = base;
    if (base.is_mean()) method.text = text_as(kMeanName, base), method.name = kMeanName;
    return method;
  }
  if (!can_be_denoised(base))
    throw Error(ErrorCode::kUsage, "denoising needs an estimator that predicts its error, not " + base.name);
  const bool with_oidn = options.use_oidn && (!options.oidn.library.empty() || !find_denoiser(options.oidn).empty());
  method.name = base.is_mean() ? kMixture : base.name;
  method.summary = base.summary;
  method.text = (base.is_mean() ? text_as(kMixture, base) : base.text) +
                fmt::format(" --denoise {}{}", settings_of(options.mode).name, with_oidn ? "" : " --oidn off");
  if (with_oidn) method.network = "Open Image Denoise " + denoiser_info(options.oidn).version;  // or throws
  method.min_groups = base.is_mean() ? 1 : 2 * base.min_groups;
  method.predicts_error = method.reads_features = true;
  method.reliable_samples = base.reliable_samples;
  method.memory = base.memory;
  method.memory.always +=
      base.is_mean() && !with_oidn ? bytes_of_mixture({.groups = kTypicalGroups}) : bytes_of_pair_mixture(with_oidn);
  method.memory.of_halves = method.memory.of_halves_per_group = 0;  // part of that
  if (base.adaptive) {
    method.adaptive = base.adaptive;
    method.adaptive->counts.tops_up = true;
    method.adaptive->counts.allocation = Allocation::kDenoised;
    method.memory.of_halves_per_group = 3 * sizeof(float);  // both passes in one film
  }
  allow_rows(base, options, with_oidn, method);
  set_image(base, base.is_mean() ? run_of_mean(options, with_oidn) : run_of_pair(base, options, with_oidn), method);
  return method;
}

Method make_mixture(Settings& options) {
  Method mean = make_none(options);
  mean.name = mean.text = kMixture;
  mean.summary = "the mean, with denoised images mixed in";
  return mean;
}

}  // namespace covary
