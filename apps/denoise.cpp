// SPDX-License-Identifier: Apache-2.0
// covary denoise: Open Image Denoise on an image, guided by its albedo and normal where it has them.
#include "denoising/denoise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "commands.h"
#include "core/error.h"
#include "core/stopwatch.h"
#include "film/image_file.h"
#include "film/outputs.h"
#include "guide_layer.h"
#include "metrics/provenance.h"
#include "progress.h"
#include "value_names.h"

namespace covary {
namespace {

struct Options {
  std::string input, output;
  DenoiseOptions denoise;
  bool no_guides = false, clean_guides = false, check = false, quiet = false;
};

/// --check: which library there is.
void check(const Options& o) {
  const DenoiserInfo info = denoiser_info(o.denoise);
  fmt::print("Open Image Denoise {}\n{}\n", info.version, info.path);
}

void warn_of_values(const std::string& path, const Image& image) {
  const auto n = std::count_if(image.data.begin(), image.data.end(), [](float v) { return !std::isfinite(v); });
  if (n > 0)
    fmt::print(stderr, "warning: {}: {} of {} values are not finite; they count as 0\n", path, n, image.data.size());
}

void run(const Options& o) {
  if (o.check) return check(o);
  if (o.input.empty() || o.output.empty())
    throw Error(ErrorCode::kUsage, "expected are IN.exr and -o OUT.exr, or --check");
  if (o.no_guides && o.clean_guides) throw Error(ErrorCode::kUsage, "--clean-guides: with --no-guides there are none");
  const Stopwatch watch;
  Outputs outputs;
  outputs.reads(o.input);
  outputs.writes("-o", o.output, OutputKind::kFilm);
  ProgressLine progress(std::filesystem::path(o.input).stem().string(), o.quiet);
  progress.begin("loading");
  const ImageInfo info = inspect_image(o.input);
  constexpr double kImages = 4 * 3 * sizeof(float), kNetwork = 600;  // per pixel; image, guides, result
  require_image_memory(o.input, info.place.window.width, info.place.window.height, kImages + kNetwork);
  const PlacedImage image = read_image(o.input);
  warn_of_values(o.input, image.image);
  std::optional<Image> albedo, normal;
  if (!o.no_guides) {
    albedo = guide_layer(o.input, info, "DenoisingAlbedo");
    if (albedo) normal = guide_layer(o.input, info, "DenoisingNormal");
    if (!albedo) albedo = guide_layer(o.input, info, "Albedo");
    if (albedo && !normal) normal = guide_layer(o.input, info, "N");
  }
  progress.begin("denoising");
  Denoiser denoiser(o.denoise);
  if (o.clean_guides && albedo) albedo = denoiser.denoise_guide("albedo", *albedo);
  if (o.clean_guides && normal) normal = denoiser.denoise_guide("normal", *normal);
  Image result =
      denoiser.denoise(image.image, albedo ? &*albedo : nullptr, normal ? &*normal : nullptr, o.clean_guides);
  progress.begin("writing");
  std::map<std::string, std::string> attributes = inherited_attributes(info.attributes);
  attributes["covary:version"] = COVARY_VERSION;
  attributes["covary:command"] = command_line();
  attributes["covary:denoiser"] = "Open Image Denoise";
  std::vector<ExrPlane> planes;
  for (size_t c = 0; c < 3; ++c)
    planes.push_back({std::string(1, "RGB"[c]), ExrPlane::Type::kFloat, result.data.data() + c, 12});
  write_exr(o.output, image.place, attributes, planes);
  progress.finish();
  if (!o.quiet)
    std::fprintf(stderr, "%s: %d x %d, %s, in %.2f s\n", o.output.c_str(), result.width, result.height,
                 normal   ? "guided by albedo and normal"
                 : albedo ? "guided by albedo"
                          : "without guides",
                 watch.seconds());
}

}  // namespace

void add_denoise(CLI::App& app) {
  const auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("denoise", "Denoise an image with Open Image Denoise (biased)");
  command
      ->add_option("IN", o->input,
                   "Linear image (EXR); its layers DenoisingAlbedo and DenoisingNormal, or Albedo and N, are guides")
      ->type_name(kFileValue);
  command->add_option("-o,--output", o->output, "The result (EXR)")->type_name(kFileValue);
  command
      ->add_option("--oidn", o->denoise.library,
                   "Open Image Denoise's library, its folder, the folder of Python's package pyoidn, or of an "
                   "environment that holds it")
      ->type_name(kLibraryValue);
  command->add_flag("--check", o->check, "Print version and path of Open Image Denoise as it is found, and do nothing");
  command->add_flag("--no-guides", o->no_guides, "Do not use these layers");
  command->add_flag(
      "--clean-guides", o->clean_guides,
      "Denoise these layers first, each alone: less error where they are noisy, for three times the time");
  command->add_flag("--quiet", o->quiet, "No summary");
  command->callback([o] { run(*o); });
}

}  // namespace covary
