// SPDX-License-Identifier: Apache-2.0
// covary convert: a PNG to look at, from any image or layer of a film.
#include <cmath>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "core/error.h"
#include "film/image_file.h"

namespace covary {
namespace {

struct ConvertOptions {
  std::string input, output, layer;
  double exposure = 0;
};

void convert(const ConvertOptions& options) {
  if (std::filesystem::path(options.output).extension() != ".png")
    throw Error(ErrorCode::kUsage, "cannot convert to '" + options.output + "': the name must end in .png");
  if (!(std::abs(options.exposure) <= 100)) throw Error(ErrorCode::kUsage, "--exposure accepts stops from -100 to 100");
  Image image = read_image(options.input, options.layer).image;
  const float factor = static_cast<float>(std::exp2(options.exposure));
  for (float& value : image.data) value *= factor;
  write_png(options.output, image);
}

}  // namespace

void add_convert(CLI::App& app) {
  const auto o = std::make_shared<ConvertOptions>();
  CLI::App* command = app.add_subcommand("convert", "Convert an image, or a layer of a film, to an sRGB PNG");
  command->add_option("IN", o->input, "Image of any renderer (EXR, HDR, PFM, …)")->required();
  command->add_option("OUT", o->output, "The PNG")->required();
  command->add_option("-e,--exposure", o->exposure, "Stops: the image is multiplied by 2^E")->capture_default_str();
  command->add_option("--layer", o->layer, "Layer (N, group03, …) or single channel (samples) in place of R G B");
  command->callback([o] { convert(*o); });
}

}  // namespace covary
