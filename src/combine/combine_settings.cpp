// SPDX-License-Identifier: Apache-2.0
#include "combine/combine_settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <limits>

#include "combine/pair_input.h"
#include "core/number_text.h"

namespace covary {
namespace {

constexpr OptionTraits kFile{.names = OptionNames::kFile};

std::string read_pixel(const std::string& text, std::optional<PixelPosition>& pixel) {
  const auto at = parse_whole_numbers(text, ',', 2);
  constexpr int kMost = std::numeric_limits<int>::max();
  if (!at || (*at)[0] > kMost || (*at)[1] > kMost) return "X,Y, e.g. 240,560";
  pixel = {static_cast<int>((*at)[0]), static_cast<int>((*at)[1])};
  return "";
}

void declare_images(Settings& s, CombineSettings& v) {
  s.texts("crn", v.crn, "FILE",
          "Image with common random numbers: one EXR with all groups, or one per group; without it, `denoise` works on "
          "the mean of the independent image",
          kFile);
  s.texts("independent", v.independent, "FILE", "Image with independent random numbers, likewise",
          {.aliases = {"pt"}, .names = OptionNames::kFile});
  s.text("output", v.output, "FILE", "The result (EXR)", {.aliases = {"o"}, .names = OptionNames::kFile});
  s.text("crn-layer", v.crn_layer, "LAYER", "Layer of the CRN image where its files hold several");
  s.text("independent-layer", v.independent_layer, "LAYER",
         "Layer of the independent image where its files hold several", {.aliases = {"pt-layer"}});
  s.text("counts", v.counts, "FILE",
         "EXR with the samples of each pixel of the independent image, all groups together, where its files do not "
         "tell and pixels differ",
         kFile);
  s.text("light", v.light, "FILE", "Light film (light.exr of covary render `passes`) to add to the result", kFile);
}

}  // namespace

void declare(Settings& s, CombineSettings& v) {
  declare_images(s, v);
  s.one_of("estimator", v.estimator, pair_estimator_names(), "iicv, or a comparator");
  declare(s, v.denoising);
  s.group("");
  s.text("guides", v.guides, "FILE",
         "For `denoise`: image (EXR) of the same pixels whose layers Albedo and N show the surfaces", kFile);
  s.texts("layers", v.layers, "LAYER",
          "For `denoise`: layers of the independent image's files, denoised so that they add up to the result, with "
          "Rest for what they leave of it");
  s.whole("samples", v.samples, {.low = 1, .high = std::numeric_limits<int>::max()},
          fmt::format("With `counts`, or {}: samples per pixel of the CRN image; default: what its file tells",
                      fmt::join(estimators_with_samples(), ", ")));
  s.flag("error", v.error, "Add the standard error as channels StdError.R, .G, .B");
  s.text_as("explain", v.explain, "X,Y", read_pixel, "Print the control variates of this pixel and their coefficients");
  s.flag("force", v.force, "Combine even where the check of the inputs finds errors");
  s.real("memory", v.memory_mib, {.low = 0, .above_low = true},
         "MiB to work in: larger images are worked on in bands, with the same bits, or refused by estimators that need "
         "whole images; default: 4096 for bands, most of the machine's for whole images");
}

}  // namespace covary
