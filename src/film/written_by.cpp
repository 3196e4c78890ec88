// SPDX-License-Identifier: Apache-2.0
#include "film/written_by.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace covary {
namespace {

struct Settings {
  Renderer renderer;
  std::string_view name;
  std::array<std::string_view, 4> where;  ///< in the order of RenderSetting
};

constexpr std::array<Settings, 5> kPrograms = {{
    {Renderer::kBlender,
     "Blender",
     {"scene.cycles.seed", "scene.cycles.use_denoising = False",
      "scene.cycles.samples, with use_adaptive_sampling = False",
      "OpenEXR with image_settings.color_depth = '32', and clamps of 0"}},
    {Renderer::kMitsuba,
     "Mitsuba",
     {"seed of mi.render()", "no mi.OptixDenoiser", "sample_count of the sampler", "component_format \"float32\""}},
    {Renderer::kPbrt,
     "pbrt",
     {"--seed", "no imgtool denoise-optix", "\"integer pixelsamples\"",
      "Film \"bool savefp16\" false, without \"maxcomponentvalue\""}},
    {Renderer::kLuxCore,
     "LuxCore",
     {"renderengine.seed", "no INTEL_OIDN or BCD_DENOISER in film.imagepipelines",
      "batch.haltspp, with batch.haltthreshold = -1", "the output RGB, without path.clamping"}},
    {Renderer::kCovary, "covary", {"--seed", "--estimator none --denoise none", "--spp", "files that it wrote"}},
}};

std::string text_of(const Settings& of, RenderSetting setting) {
  return std::string("in ").append(of.name).append(" ").append(of.where[static_cast<size_t>(setting)]);
}

}  // namespace

Renderer written_by(const std::map<std::string, std::string>& attributes) {
  const auto starts = [&](std::string_view prefix) {
    return std::any_of(attributes.begin(), attributes.end(),
                       [&](const auto& a) { return a.first.starts_with(prefix); });
  };
  if (starts("covary:")) return Renderer::kCovary;
  if (starts("cycles.") || attributes.contains("BlenderMultiChannel")) return Renderer::kBlender;
  if (const auto by = attributes.find("generatedBy"); by != attributes.end() && by->second.starts_with("Mitsuba"))
    return Renderer::kMitsuba;
  if (attributes.contains("samplesPerPixel") && attributes.contains("renderTimeSeconds")) return Renderer::kPbrt;
  return Renderer::kUnknown;
}

std::string where_to_set(RenderSetting setting, Renderer renderer) {
  std::string all;
  for (const Settings& of : kPrograms) {
    if (of.renderer == renderer) return text_of(of, setting);
    if (of.renderer != Renderer::kCovary) all += (all.empty() ? "" : ", ") + text_of(of, setting);
  }
  return all;
}

}  // namespace covary
