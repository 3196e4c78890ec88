// SPDX-License-Identifier: Apache-2.0
// The request of a render, in addition to the plan. Members are next to the declarations of their options
// (settings/settings.h), so an option of rendering is one member and one line here, and the code that uses it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/error.h"
#include "film/film.h"
#include "passes/light_pass.h"
#include "settings/settings.h"

namespace covary {

/// As film/exposure.h says.
inline constexpr double kAutomaticExposure = 1e9;

struct RenderRequest {
  uint64_t seed = 0;
  /// Replaces the scene's integrator; if that has choices, the chosen one.
  std::shared_ptr<const Integrator> integrator;
  std::optional<FilterSettings> filter;  ///< default: the scene's
  std::optional<Sampler> sampler;        ///< of camera samples; default: sampler_of()
  std::optional<CropWindow> crop;        ///< default: the scene's; inside the frame
  /// Samples per pixel of all passes together, 1 … 2^30. Default: the scene's, or no limit if `seconds` or `until` is
  /// given.
  std::optional<uint32_t> spp;
  double seconds = 0;            ///< > 0: limit for everything but loading
  double until = 0;              ///< > 0: add samples until the predicted relMSE is this small
  bool until_in_blocks = false;  ///< `until` means predicted_blocks() of predicted_error.h, not the whole image
  /// Wanted relative error of each pixel (3 sigma), for estimators with adaptive sample counts; `spp` is then the most.
  std::optional<float> relative_error;
  bool films_only = false;  ///< only the passes: no image is made of their films
  bool aovs = false;        ///< also the images Albedo, N and P
  bool alpha = false;       ///< also the channel A
  /// At most, per pixel of the auxiliary images (integrators/aov.h), at least 1. Fewer with `seconds`, if need be.
  uint32_t aov_samples = 64;
  /// Also the images Edges01, Edges02, … of the last pass of camera samples (passes/sample_parts.h). Requires the
  /// integrator controlled-path.
  bool path_lengths = false;
  /// Also the images Direct and Indirect, which sum to the image (passes/sample_parts.h). Requires an integrator that
  /// separates direct light, and a plan that splits layers.
  bool layers = false;
  /// Instead, images Combined_GROUP for each group of the scene's lights, and Rest for the others. Requires an
  /// integrator that separates lights.
  bool light_groups = false;
  bool splits_layers() const { return layers || light_groups; }

  std::string output;                    ///< EXR file of the result; empty: no file is written
  bool preview = false;                  ///< also a PNG next to it
  double exposure = kAutomaticExposure;  ///< of the PNG, in stops
  /// Files of the integrator's training (training_stage.h), written after the training and read instead of it; empty:
  /// none.
  std::string save_training, load_training;
  std::string oidn;               ///< path of Open Image Denoise, for integrators that use it; empty: searched for
  std::string passes;             ///< folder that keeps the films; empty: only while they are unfinished
  bool resume = false;            ///< resume existing films
  bool overwrite = false;         ///< films in `passes` may be replaced; without it and `resume` they are an error
  double checkpoint_seconds = 0;  ///< > 0: seconds between writing unfinished films
  /// Images of the window from the caller, written as layers of the output: 1 or 3 channels.
  std::map<std::string, Image> beside;
  /// Attributes of films and image from the caller, such as film_key::kVersion and kCommand.
  std::map<std::string, std::string> attributes;
  /// Names the device that has made the image, "" if it was the processor; empty: the processor.
  std::function<std::string()> made_by;
};

inline constexpr double kMaxSamples = 1 << 30;
inline constexpr OptionTraits kBasicPasses{.level = OptionLevel::kBasic, .effect = OptionEffect::kPasses};
inline constexpr OptionTraits kBasicSamples{.level = OptionLevel::kBasic, .effect = OptionEffect::kSamples};

// Parsers: they return what was expected, or "" on success.
std::string read_until(const std::string& text, RenderRequest& request);
std::string read_crop(const std::string& text, std::optional<CropWindow>& crop);
FilterSettings filter_named(const std::string& name);

/// Options for when the render ends and where the image goes.
inline void declare_goal(Settings& s, RenderRequest& r) {
  s.group("Rendering");
  s.text("output", r.output, "FILE", "The image (EXR); a PNG preview appears beside it",
         {.letter = "o", .level = OptionLevel::kBasic, .names = OptionNames::kFile});
  s.whole("spp", r.spp, {.low = 1, .high = kMaxSamples}, "Samples per pixel over all passes; default: the scene's",
          kBasicPasses);
  s.text_as("until", r, "relmse=X", read_until,
            "Add samples, up to a given `spp`, until the predicted error is X; relmse-p95=X: in 95 % of blocks; "
            "relative=X: 3 sigma of each pixel",
            kBasicPasses);
  std::optional<double> seconds;
  s.real("time", seconds, {.low = 0, .above_low = true}, "Seconds for everything but loading", kBasicPasses);
  if (seconds) r.seconds = *seconds;
}

inline void declare(Settings& s, RenderRequest& r) {
  s.group("Rendering");
  s.whole("seed", r.seed, {.low = 0}, "Seed of the random numbers", kBasicSamples);
  s.text_as("crop", r.crop, "X,Y,WIDTH,HEIGHT", read_crop, "Render only these pixels of the frame", kBasicSamples);
  s.text("passes", r.passes, "FOLDER", "Folder to keep the film of every pass in",
         {.level = OptionLevel::kBasic, .names = OptionNames::kFolder});
  s.flag("resume", r.resume, "Continue an interrupted render, or the films in `passes`",
         {.level = OptionLevel::kBasic});
  s.group("Sampling", OptionEffect::kSamples);
  std::string sampler, filter;
  s.one_of("sampler", sampler, {"independent", "sobol"},
           "Random numbers within a group of samples: independent, or Owen-scrambled Sobol' points; default: the "
           "scene's (sobol unless it is independent)");
  if (!sampler.empty()) r.sampler = sampler == "sobol" ? Sampler::kSobol : Sampler::kIndependent;
  s.one_of("rfilter", filter, {"box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"},
           "Reconstruction filter instead of the scene's");
  if (!filter.empty()) r.filter = filter_named(filter);
  s.group("Output");
  s.flag("overwrite", r.overwrite, "Replace existing films, and an `output` that another command made");
  s.real("checkpoint", r.checkpoint_seconds, {.low = 0}, "Seconds between saving unfinished films; 0: never");
  r.preview = !s.flag("no-preview", "Do not write the PNG");
  s.real("exposure", r.exposure, {.low = -40, .high = 40}, NumberWord{"auto", kAutomaticExposure},
         "Stops by which the PNG is brighter than the image; auto: 0 unless a tenth of it is burnt or black");
  s.flag("aovs", r.aovs, "Add the images Albedo, N (normal) and P (position) to the output");
  s.flag("alpha", r.alpha, "Add the channel A: how much of a pixel surfaces cover");
  s.whole("aov-samples", r.aov_samples, {.low = 1, .high = 65536},
          "Most samples per pixel of albedo, normal and position; fewer are taken where they have little noise");
  std::string layers;
  s.one_of("layers", layers, {"direct", "light-groups", "path-lengths"},
           "Add layers that add up to the image, denoised or not: Direct and Indirect; Combined_ID for the lights of "
           "each id, and Rest for the others; or, of samples, one for each path length in edges (Edges01, …)",
           {.effect = OptionEffect::kPasses});
  r.layers = layers == "direct", r.light_groups = layers == "light-groups", r.path_lengths = layers == "path-lengths";
  s.group("Training of controlled-path and guided-path");
  s.text("save-training", r.save_training, "FILE",
         "Also write what controlled-path or guided-path has learnt about the scene to this file",
         {.names = OptionNames::kFile});
  s.text("load-training", r.load_training, "FILE",
         "Render with what a render with `save-training` of the same scene and integrator has learnt",
         {.names = OptionNames::kFile, .effect = OptionEffect::kSamples});
  if (r.resume && r.overwrite) throw Error(ErrorCode::kUsage, "`overwrite` excludes `resume`");
}

}  // namespace covary
