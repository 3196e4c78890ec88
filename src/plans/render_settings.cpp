// SPDX-License-Identifier: Apache-2.0
#include "plans/render_settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "combine/combine_settings.h"
#include "core/error.h"
#include "core/number_text.h"
#include "gpu/target.h"
#include "integrators/registry.h"
#include "passes/light_pass.h"
#include "passes/training.h"
#include "plans/integrator_choice.h"
#include "settings/option_names.h"

namespace covary {
namespace {

/// Fewer are few (measured: docs/notes/denoising.md).
constexpr uint32_t kFewSamples = 64;

constexpr int kLargestSide = 65536;

std::string read_resolution(const std::string& text, RenderSettings& v) {
  const auto size = parse_whole_numbers(text, 'x', 2);
  if (!size || (*size)[0] < 1 || (*size)[1] < 1 || (*size)[0] > kLargestSide || (*size)[1] > kLargestSide)
    return fmt::format("WIDTHxHEIGHT, each from 1 to {}, e.g. 1280x720", kLargestSide);
  v.width = static_cast<int>((*size)[0]), v.height = static_cast<int>((*size)[1]);
  return "";
}

std::string read_split(const std::string& text, PassChoice& passes) {
  const auto parts = parse_reals(text, ':', 2);
  if (!parts || (*parts)[0] <= 0 || (*parts)[1] <= 0) return "CRN:INDEPENDENT, two numbers above 0, e.g. 1:1";
  const double sum = (*parts)[0] + (*parts)[1];
  passes.split = {(*parts)[0] / sum, (*parts)[1] / sum};
  return "";
}

void declare_passes(Settings& s, PassChoice& v) {
  static constexpr std::pair<const char*, Sampling> kSamplings[] = {{"independent", Sampling::kIndependent},
                                                                    {"crn", Sampling::kCrn}};
  s.group("Sampling", OptionEffect::kPasses);
  s.choice("sampling", v.sampling, kSamplings,
           fmt::format("Random numbers of a single pass (`estimator` {}): independent, or common to all pixels",
                       kNoEstimator),
           {.effect = OptionEffect::kSamples});
  s.text_as("split", v, "CRN:INDEPENDENT", read_split,
            "Ratio of the samples of the two passes; default: the estimator's, usually 1:1");
  s.whole("groups", v.groups, {.low = 1, .high = Film::kMaxGroups},
          "Groups of samples per pixel, whose means films keep; default: the largest number from 12 to 8 that divides "
          "the samples, else 12 or the number of samples; 1 for a single independent pass");
}

}  // namespace

std::string read_crop(const std::string& text, std::optional<CropWindow>& crop) {
  const auto c = parse_whole_numbers(text, ',', 4);
  if (!c || *std::max_element(c->begin(), c->end()) > kLargestSide)
    return "X,Y,WIDTH,HEIGHT in pixels, e.g. 240,560,240,160";
  const auto at = [&](size_t i) { return static_cast<int>((*c)[i]); };
  crop = {at(0), at(1), at(2), at(3)};
  return "";
}

std::string read_until(const std::string& text, RenderRequest& v) {
  for (const std::string key : {"relmse=", "relmse-p95=", "relative="})
    if (text.starts_with(key)) {
      const std::optional<double> value = parse_real(std::string_view(text).substr(key.size()));
      if (!value || *value <= 0) break;
      if (key == "relative=")
        v.relative_error = static_cast<float>(*value);
      else
        v.until = *value, v.until_in_blocks = key != "relmse=";
      return "";
    }
  return "relmse=X, relmse-p95=X or relative=X with X > 0, e.g. relmse=0.005";
}

FilterSettings filter_named(const std::string& name) {
  if (name == "box") return {FilterKind::kBox, 0.5f, 0};
  if (name == "tent") return {FilterKind::kTent, 1.0f, 0};
  if (name == "mitchell") return lobed(LobedFilter::mitchell(1.0f / 3, 1.0f / 3));
  if (name == "catmullrom") return lobed(LobedFilter::catmull_rom());
  if (name == "lanczos") return lobed(LobedFilter::lanczos(3));
  return {FilterKind::kGaussian, 2.0f, 0.5f};
}

void declare(Settings& s, RenderSettings& v) {
  declare_goal(s, v.request);
  s.one_of("integrator", v.integrator, integrator_names(), "Integrator instead of the scene's", kBasicSamples);
  if (s.is_given("sampling")) v.estimator = kNoEstimator;
  s.one_of("estimator", v.estimator, estimator_names(),
           fmt::format(
               "How samples become the image; {}: their mean. Others than the default are denoised only by `denoise`",
               kNoEstimator),
           kBasicPasses);
  v.denoising.mode = default_denoising(v.estimator);
  declare(s, v.denoising, false);
  declare_device(s, v.device);
  s.group("Rendering");
  s.text_as("resolution", v, "WIDTHxHEIGHT", read_resolution, "Size of the full frame; default: the scene's",
            kBasicSamples);
  declare(s, v.view);
  declare_passes(s, v.passes);
  declare(s, v.request);
}

Method estimator_of(const RenderSettings& settings, const OptionValues& of_estimator) {
  const MethodTarget target = gpu::Target::open(settings.device);
  Method estimator =
      with_denoising(make_estimator(settings.estimator, of_estimator, target), settings.denoising, target);
  if (!settings.request.relative_error) return estimator;
  if (!estimator.adaptive)
    throw Error(ErrorCode::kUsage,
                fmt::format("`until` relative needs adaptive sample counts: `adaptive`, or `estimator` {}",
                            fmt::join(estimators_where([](const Method& e) { return e.adaptive.has_value(); }), ", ")));
  estimator.adaptive->counts.relative_error = settings.request.relative_error;
  return estimator;
}

void check_given(const OptionValues& given, const RenderSettings& settings, const Method& method) {
  const auto usage = [](const std::string& message) { throw Error(ErrorCode::kUsage, message); };
  const auto has = [&](const char* option) { return given.contains(option); };
  const std::string& name = settings.estimator;
  const bool is_pair = method.pair(), of_pixels = method.pixel_pass();
  if (method.one_pass() && !method.is_mean() && settings.passes.sampling == Sampling::kCrn)
    usage(
        "`denoise` of a single pass needs `sampling` independent: errors that all pixels share show in no difference");
  if (has("sampling") && !method.one_pass())
    usage(fmt::format(
        "`sampling` is an option of `estimator` {}; {} renders one pass {}", kNoEstimator, name,
        of_pixels ? "with independent random numbers" : "with common random numbers and one with independent ones"));
  if (method.adaptive && has("split"))
    usage(fmt::format("`split`: the first pass of {} has its own number of samples, `dependent-spp`", name));
  if (method.adaptive && has("sampling")) usage("`sampling`: `adaptive` always takes independent random numbers");
  if (!is_pair && has("split")) usage("`split` is an option of estimators with two passes, not of " + name);
  if (of_pixels && has("groups"))
    usage(fmt::format("`groups`: {} are fitted to the samples of a pixel themselves, not to means of groups", name));
  if (of_pixels && has("time"))
    usage(fmt::format(
        "`time`: {} are fitted to all samples of a pixel together, so their number must be known; use `spp`", name));
  if (settings.request.until <= 0) return;
  if (!method.predicts_error)
    usage("`until`: " + name + " does not estimate its error" + (method.adaptive ? "; use relative=X" : ""));
  if (method.is_mean() && settings.passes.groups.value_or(2) < 2) usage("`until` needs `groups` 2 or more");
}

Plan render_plan(const RenderSettings& settings, const OptionValues& of_estimator) {
  return estimator_plan(estimator_of(settings, of_estimator), settings.passes);
}

RenderRequest request_of(const RenderSettings& settings, const LoadedScene& scene) {
  RenderRequest request = settings.request;
  const LearningIntegrator* learning = integrator_of(scene).learning();
  const std::string& oidn = settings.denoising.oidn;
  const bool is_surrogate = learning && learning->pilot_by_oidn() && request.load_training.empty();
  if (is_surrogate && oidn == "off")
    throw Error(ErrorCode::kUsage, "`cv-variance` relative-oidn needs Open Image Denoise, which `oidn` off leaves out");
  if (!oidn.empty() && !is_surrogate && !settings.denoising.denoises())
    throw Error(ErrorCode::kUsage,
                fmt::format("`oidn` has no effect {}, and no training with `cv-variance` relative-oidn", kNotDenoised));
  if (is_surrogate) request.oidn = oidn;
  if (const MethodTarget target = gpu::Target::open(settings.device))
    request.made_by = [target] { return target->made_by(); };
  return request;
}

std::string advice(const RenderSettings& settings, const Method& estimator, const LoadedScene& scene) {
  const RenderRequest& request = settings.request;
  if (request.seconds > 0 || request.until > 0 || request.films_only) return "";
  const uint32_t samples = request.spp.value_or(static_cast<uint32_t>(scene.spp));
  if (samples >= kFewSamples) return "";
  const std::string& mode = settings.denoising.mode;
  if (estimator.one_pass() && lowers_bias(denoise_mode(mode)))
    return fmt::format(
        "around {} independent samples per pixel, `denoise` {} is nearly the same as auto; for less bias take {} or "
        "more, or `estimator` {} with `denoise` {}",
        samples, mode, kFewSamples, kDefaultOfPairs, mode);
  if (!estimator.pair() || samples >= estimator.reliable_samples) return "";
  return fmt::format("with {} samples per pixel, `estimator` {} is {}; take {} or more, or leave `estimator` out",
                     samples, settings.estimator, mode == DenoisingChoice::kNone ? "blotchy" : "worse than the default",
                     estimator.reliable_samples);
}

void take_training(const LoadedScene& scene, RenderRequest& request) {
  const LearningIntegrator* learning = integrator_of(scene, request).learning();
  const uint32_t training = learning ? learning->training_spp() : 0;
  const bool open_ended = request.seconds > 0 || request.until > 0;
  if (training == 0 || (!request.spp && open_ended)) return;
  const uint32_t all = request.spp.value_or(static_cast<uint32_t>(scene.spp));
  if (all <= training)
    throw Error(ErrorCode::kUsage, fmt::format("{} samples per pixel, of which the training takes {}, leave none for "
                                               "the image; use a larger `spp` or a shorter training "
                                               "(`cv-train`, `guiding-train`)",
                                               all, training));
  request.spp = all - training;
}

std::vector<std::string> replay_words(OptionValues values, const Pass& pass, const BadSample& bad,
                                      uint64_t seed_offset) {
  std::vector<Option> options = options_of<RenderSettings>();
  const LearningIntegrator* learning = pass.integrator->learning();
  const bool is_by_oidn = learning && learning->pilot_by_oidn() && !values.contains("load-training");
  for (const Option& option : options)
    if (option.effect != OptionEffect::kSamples && !(option.name == "oidn" && is_by_oidn)) values.erase(option.name);
  values["seed"] = std::to_string(pass.settings.seed - seed_offset);
  if (values.contains("integrator")) values["integrator"] = registered_name(*pass.integrator);  // the one chosen
  const bool is_crn = pass.settings.sampling == Sampling::kCrn, is_sobol = pass.settings.sampler == Sampler::kSobol;
  if (!pass.plan.light) values["sampling"] = is_crn ? "crn" : "independent";
  if (is_sobol) values["groups"] = std::to_string(pass.settings.groups);
  if (is_sobol || values.contains("sampler")) values["sampler"] = sampler_name(pass.settings.sampler);
  // The weights of sampling strategies depend on whether light is traced.
  if (pass.integrator->light_tracing()) values["light-tracing"] = light_tracer(*pass.integrator) ? "on" : "off";
  std::vector<std::string> words = option_words(options, values);
  const std::vector<std::string> of_integrator = method_words(options_of_integrators(), values);
  words.insert(words.end(), of_integrator.begin(), of_integrator.end());
  const std::string sample =
      pass.plan.light ? fmt::format("light,{}", bad.sample) : fmt::format("{},{},{}", bad.x, bad.y, bad.sample);
  const std::string number = !pass.plan.light && pass.plan.number ? fmt::format(",{}", pass.plan.number) : "";
  words.insert(words.end(), {"--replay", sample + number});
  return words;
}

std::vector<std::string> pass_words(OptionValues given, const OptionValues& of_integrator, OptionValues of_estimator) {
  const RenderSettings settings = settings_from<RenderSettings>(given);
  const std::string name = settings.estimator;
  const Method estimator = make_estimator(name, of_estimator);
  given.erase("estimator");
  std::vector<std::string> words;
  const auto add = [&](const std::vector<Option>& options, OptionValues& values) {
    for (const Option& option : options)
      if (option.effect == OptionEffect::kImage) values.erase(option.name);
    const std::vector<std::string> more = option_words(options, values);
    words.insert(words.end(), more.begin(), more.end());
  };
  add(options_of<RenderSettings>(), given);
  add(options_of_estimator(name), of_estimator);
  for (const auto& [option, value] : of_integrator) words.insert(words.end(), {"--" + option, value});
  const bool is_plain_pair = estimator.pair() && !estimator.adaptive, is_mean = estimator.is_mean();
  const bool is_denoised_mean = is_mean && settings.denoising.denoises();
  words.push_back(is_plain_pair ? "pair" : is_denoised_mean ? "groups" : is_mean ? kNoEstimator : name.c_str());
  return words;
}

}  // namespace covary
