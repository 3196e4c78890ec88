// SPDX-License-Identifier: Apache-2.0
#include "combine/pair_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "combine/registry.h"
#include "core/error.h"
#include "film/splat_layer.h"

namespace covary {
namespace {

using Severity = Finding::Severity;

}  // namespace

void check_origins(const ImageOrigin& crn, const ImageOrigin& independent, std::vector<Finding>& findings) {
  const auto size = [](const ImageOrigin& o) {
    const CropWindow& w = o.place.window;
    return fmt::format("{} x {} pixels at ({}, {}) of {} x {}", w.width, w.height, w.x, w.y, o.place.frame_width,
                       o.place.frame_height);
  };
  if (!(crn.place == independent.place))
    throw Error(ErrorCode::kInput, fmt::format("{} has {}, {} has {}; both images must show the same pixels", crn.name,
                                               size(crn), independent.name, size(independent)));
  if (!(crn.colours == independent.colours))
    throw Error(ErrorCode::kInput,
                fmt::format("the colours of {} are {}, those of {} {}; expected one colour space", crn.name,
                            crn.colours.text(), independent.name, independent.colours.text()));
  if (crn.sampling == "independent" || independent.sampling == "crn")
    findings.push_back({Severity::kError, "the files say that the CRN image was rendered with sampling '" +
                                              crn.sampling + "' and the independent image with '" +
                                              independent.sampling +
                                              "'; expected `sampling` crn and `sampling` independent"});
  if (!crn.scene_hash.empty() && !independent.scene_hash.empty() && crn.scene_hash != independent.scene_hash)
    findings.push_back({Severity::kError, "the files say that they show different scenes (attribute scene_hash)"});
  if (!crn.settings.empty() && !independent.settings.empty() && crn.settings != independent.settings)
    findings.push_back({Severity::kError,
                        "the files say that they were rendered with different settings: the CRN "
                        "image with '" +
                            crn.settings + "', the independent image with '" + independent.settings + "'"});
  for (const auto& [name, origin] : {std::pair{"CRN image", &crn}, {"independent image", &independent}})
    if (origin->has_half)
      findings.push_back(
          {Severity::kWarning,
           fmt::format("{}: values have 16 bits, which limits what can be gained; save 32-bit float values ({})", name,
                       where_to_set(RenderSetting::kFloats, origin->renderer))});
}

void check_light(const ImageOrigin& crn, const ImageOrigin& independent, const ImageOrigin* light,
                 std::vector<Finding>& findings) {
  for (const ImageOrigin* image : {&crn, &independent}) {
    if (image->is_light_film)
      findings.push_back({Severity::kError, image->name + " is a light film, which `light` adds"});
    else if (light && image->has_light_added)
      findings.push_back({Severity::kError, image->name + " has a light film added already"});
    else if (!light && !image->has_light_added && has_light_film(image->settings))
      findings.push_back({Severity::kWarning, image->name + " lacks the light of a light film; `light` adds it"});
  }
  if (!light) return;
  if (!light->is_light_film)
    throw Error(ErrorCode::kInput, fmt::format("`light` '{}' is not a light film: it lacks the attribute "
                                               "covary:light_paths_per_sample",
                                               light->name));
  if (!(light->place == crn.place))
    throw Error(ErrorCode::kInput, fmt::format("`light` '{}' shows other pixels than '{}'", light->name, crn.name));
  if (!crn.scene_hash.empty() && light->scene_hash != crn.scene_hash)
    findings.push_back({Severity::kError, "the light film says that it shows another scene (attribute scene_hash)"});
  if (!crn.settings.empty() && light->settings != crn.settings)
    findings.push_back({Severity::kError, fmt::format("the light film says that it was rendered with '{}', the CRN "
                                                      "image with '{}'",
                                                      light->settings, crn.settings)});
}

std::string errors_text(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& f : findings)
    if (f.severity == Severity::kError) text += (text.empty() ? "" : "; ") + f.text;
  return text;
}

bool lacks_samples(const GroupedImage& image) {
  const auto groups = static_cast<uint32_t>(image.groups);
  return image.counts && std::any_of(image.counts, image.counts + static_cast<size_t>(image.width) * image.height,
                                     [groups](uint32_t n) { return n < groups; });
}

InputReport unchecked_report() {
  InputReport report;
  report.findings.push_back({Severity::kNote, "images in which pixels lack samples are not checked"});
  return report;
}

bool needs_sample_count(const Method& method) { return method.pair() && method.pair()->needs_sample_count; }

std::vector<std::string> estimators_with_samples() { return estimators_where(needs_sample_count); }

MethodSettings pair_settings(const Method& estimator, std::optional<int> samples, double known_samples,
                             bool std_error) {
  const auto usage = [](const std::string& message) { throw Error(ErrorCode::kUsage, message); };
  const std::string& name = estimator.name;
  const bool needs_count = needs_sample_count(estimator);
  if (samples && !needs_count)
    usage(fmt::format("`samples` is an option of `counts` and `estimator` {}, not of {}",
                      fmt::join(estimators_with_samples(), ", "), name));
  if (std_error && !estimator.predicts_error) usage("`error`: " + name + " does not estimate its error");
  const int64_t count = samples ? *samples : std::llround(known_samples);
  if (needs_count && count == 0)
    usage("`estimator` " + name + " needs `samples` N, the samples per pixel of the CRN image");
  MethodSettings settings;
  settings.crn_samples = count;
  settings.std_error = std_error;
  return settings;
}

std::string needs_samples_text(const std::string& name) {
  for (const MethodPlugin& plugin : estimator_plugins())
    if (name == plugin.name && make_estimator(name).pixel_pass())
      return fmt::format(
          "{0} are fitted to the samples of each pixel, which images do not hold; use 'covary render "
          "SCENE --estimator {0}'",
          name);
  return "";
}

Method make_pair_estimator(const std::string& name, const OptionValues& values, const MethodTarget& target) {
  if (const std::string text = needs_samples_text(name); !text.empty()) throw Error(ErrorCode::kUsage, text);
  Method estimator = make_estimator(name, values, target);
  if (!estimator.pair())
    throw Error(ErrorCode::kUsage, fmt::format("estimator '{}' is not one of two images; those are {}", name,
                                               fmt::join(pair_estimator_names(), ", ")));
  return estimator;
}

}  // namespace covary
