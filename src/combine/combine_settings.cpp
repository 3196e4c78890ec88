// SPDX-License-Identifier: Apache-2.0
#include "combine/combine_settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <limits>

#include "combine/pair_input.h"
#include "core/number_text.h"
#include "gpu/target.h"

namespace covary {
namespace {

constexpr OptionTraits kFile{.names = OptionNames::kFile};

std::string read_pixel(const std::string& text, std::optional<PixelPosition>& pixel) {
  const auto at = parse_whole_numbers(text, ',', 2);
  constexpr int kMax = std::numeric_limits<int>::max();
  if (!at || (*at)[0] > kMax || (*at)[1] > kMax) return "X,Y, e.g. 240,560";
  pixel = {static_cast<int>((*at)[0]), static_cast<int>((*at)[1])};
  return "";
}

void declare_images(Settings& s, CombineSettings& v) {
  s.texts("crn", v.crn, "FILE",
          "Image with common random numbers: one EXR with all groups, or one per group; without it, the independent "
          "image is denoised",
          kFile);
  s.texts("independent", v.independent, "FILE", "Image with independent random numbers, likewise", kFile);
  s.text("output", v.output, "FILE", "The result (EXR)", {.letter = "o", .names = OptionNames::kFile});
  s.text("crn-layer", v.crn_layer, "LAYER", "Layer of the CRN image if its files have several");
  s.text("independent-layer", v.independent_layer, "LAYER", "Layer of the independent image if its files have several");
  s.text(
      "counts", v.counts, "FILE",
      "EXR with the samples per pixel of the independent image over all groups, if they vary and its files do not say",
      kFile);
  s.text("light", v.light, "FILE", "Light film (light.exr of covary render `passes`) to add to the result", kFile);
}

}  // namespace

void declare_device(Settings& s, std::string& device) {
  const auto read = [](const std::string& text, std::string& name) {
    name = text;
    return gpu::wrong_device_name(text);
  };
  s.text_as("device", device, "DEVICE", read, gpu::kDeviceHelp);
}

void declare(Settings& s, CombineSettings& v) {
  declare_images(s, v);
  std::vector<std::string> names = pair_estimator_names();
  names.insert(names.begin(), kDefaultEstimator);
  s.one_of("estimator", v.estimator, names,
           "How the images are combined. The default denoises, by mixing; others are denoised only by `denoise`");
  v.denoising.mode = default_denoising(v.estimator);
  declare(s, v.denoising);
  s.group("");
  s.text("features", v.features, "FILE",
         "For denoising: image (EXR) of the same pixels with the layers Albedo, N and P", kFile);
  s.texts("layers", v.layers, "LAYER",
          "For denoising: layers of the independent image's files to denoise with it; with Rest, they add up to the "
          "result");
  s.whole("samples", v.samples, {.low = 1, .high = std::numeric_limits<int>::max()},
          fmt::format("With `counts`, or {}: samples per pixel of the CRN image; default: as its file says",
                      fmt::join(estimators_with_samples(), ", ")));
  s.flag("error", v.error, "Add the standard error as channels StdError.R, .G, .B");
  s.text_as("explain", v.explain, "X,Y", read_pixel, "Print the control variates of this pixel and their coefficients");
  s.flag("force", v.force, "Combine even if the check of the inputs finds errors");
  declare_device(s, v.device);
  s.real("memory", v.memory_mib, {.low = 0, .above_low = true}, kMemoryHelp);
}

}  // namespace covary
