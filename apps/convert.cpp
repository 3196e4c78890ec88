// SPDX-License-Identifier: Apache-2.0
// covary convert: a PNG to look at, from any image or layer of a film, or from several side by side.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include "commands.h"
#include "core/error.h"
#include "film/image_file.h"

namespace covary {
namespace {

struct ConvertOptions {
  std::vector<std::string> files;  // the last is the output
  std::string layer;
  double exposure = 0;
};

/// The images from left to right, their upper edges in line, black below shorter ones.
Image side_by_side(const std::vector<Image>& images) {
  int width = 0, height = 0;
  for (const Image& image : images) {
    width += image.width;
    height = std::max(height, image.height);
  }
  Image result(width, height, 3);
  int left = 0;
  for (const Image& image : images) {
    for (int y = 0; y < image.height; ++y)
      std::copy_n(image.pixel(0, y), image.width * image.channels, result.pixel(left, y));
    left += image.width;
  }
  return result;
}

void convert(const ConvertOptions& options) {
  if (options.files.size() < 2) throw Error(ErrorCode::kUsage, "convert needs an image to read and a PNG to write");
  const std::string& output = options.files.back();
  if (std::filesystem::path(output).extension() != ".png")
    throw Error(ErrorCode::kUsage, "cannot convert to '" + output + "': the name must end in .png");
  if (!(std::abs(options.exposure) <= 100)) throw Error(ErrorCode::kUsage, "--exposure accepts stops from -100 to 100");
  std::vector<Image> images;
  for (size_t i = 0; i + 1 < options.files.size(); ++i)
    images.push_back(read_image(options.files[i], options.layer).image);
  Image image = images.size() == 1 ? std::move(images[0]) : side_by_side(images);
  const float factor = static_cast<float>(std::exp2(options.exposure));
  for (float& value : image.data) value *= factor;
  write_png(output, image);
}

}  // namespace

void add_convert(CLI::App& app) {
  const auto o = std::make_shared<ConvertOptions>();
  CLI::App* command = app.add_subcommand("convert", "Convert images, or layers of films, to an sRGB PNG");
  command
      ->add_option("FILES", o->files, "Images of any renderer (EXR, HDR, PFM, …), put side by side, and last the PNG")
      ->option_text("IN... OUT.png")
      ->required();
  command->add_option("-e,--exposure", o->exposure, "Stops: the image is multiplied by 2^E")->capture_default_str();
  command->add_option("--layer", o->layer, "Layer (N, group03, …) or single channel (samples) in place of R G B");
  command->callback([o] { convert(*o); });
}

}  // namespace covary
