// SPDX-License-Identifier: Apache-2.0
// covary convert: any image or layer of a film, or several side by side, in another format.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <vector>

#include "commands.h"
#include "core/error.h"
#include "declared_options.h"
#include "film/image_writer.h"
#include "film/output_file.h"
#include "film/outputs.h"
#include "metrics/error_map.h"
#include "metrics/provenance.h"
#include "numbers.h"
#include "sequences/frame_names.h"
#include "value_names.h"
#include "video.h"

namespace covary {
namespace {

struct ConvertOptions {
  std::vector<std::string> files;  // the last is the output
  std::string layer;
  double exposure = 0;
  std::optional<double> rate;  // of a video, frames per second
  bool accept_changed = false, overwrite = false, colours = false;

  ChecksumPolicy checksums() const { return accept_changed ? ChecksumPolicy::kIgnore : ChecksumPolicy::kCheck; }
};

/// The mean over channels in the colours of error maps; prints their scale, except for frames of a video.
Image in_false_colours(const Image& image, const std::string& output) {
  Image mean(image.width, image.height, 1);
  for (size_t i = 0; i < mean.data.size(); ++i) {
    const float* values = &image.data[i * image.channels];
    mean.data[i] = std::accumulate(values, values + image.channels, 0.0f) / static_cast<float>(image.channels);
  }
  const ErrorScale scale = decade_scale({&mean, 1});
  if (!is_video_name(output)) fmt::print(stderr, "{}: {}\n", output, scale.legend());
  return colour_errors(mean, scale);
}

/// The images side by side, top-aligned, with black below shorter ones.
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

/// Attributes of the new image: none are inherited from several images; covary's are dropped if the image was changed.
std::map<std::string, std::string> attributes_of(const ConvertOptions& options) {
  std::map<std::string, std::string> attributes;
  if (options.files.size() == 2 && !options.accept_changed)
    attributes = inherited_attributes(inspect_image(options.files[0]).attributes);
  const auto earlier = attributes.find(kExposureAttribute);
  const double exposure =
      options.exposure + (earlier == attributes.end() ? 0 : parse_real(earlier->second).value_or(0));
  attributes.erase(kExposureAttribute);
  if (exposure != 0) attributes[kExposureAttribute] = fmt::format("{:g}", exposure);
  if (!options.layer.empty()) attributes["covary:layer"] = options.layer;
  attributes["covary:version"] = COVARY_VERSION;
  attributes["covary:command"] = command_line();
  return attributes;
}

/// Whether the file, according to its metadata, can be made again: an EXR written by this command, or any PNG of
/// covary.
bool is_own_picture(const std::string& path) {
  if (lower_extension(path) == ".png") return is_own_png(path);
  if (lower_extension(path) != ".exr") return false;
  try {
    const std::map<std::string, std::string> attributes = inspect_image(path, ChecksumPolicy::kIgnore).attributes;
    const auto command = attributes.find("covary:command");
    return command != attributes.end() && command->second.starts_with("covary convert ");
  } catch (const Error&) {
    return false;  // damaged, or something else under this name
  }
}

/// `convert *.exr` would make the last existing file the output.
void check_not_lost(const ConvertOptions& options) {
  const std::string& output = options.files.back();
  std::error_code ignored;
  if (options.overwrite || !std::filesystem::is_regular_file(output, ignored) || output_target(output).is_special ||
      is_own_picture(output))
    return;
  throw Error(ErrorCode::kUsage,
              fmt::format("the output '{}', which is the last name given, already exists and not a picture that "
                          "'covary convert' made; give another name, or --overwrite to replace it",
                          output));
}

/// Checks memory for the result: one image side by side if there are several, and a copy for writing.
void check_memory(const std::vector<Image>& images, const std::string& output) {
  constexpr double kPixel = 3 * sizeof(float);
  int width = 0, height = 0;
  for (const Image& image : images) width += image.width, height = std::max(height, image.height);
  require_image_memory(output, width, height, (images.size() > 1 ? 2 : 1) * kPixel);
}

void expose(const ConvertOptions& options, Image& image) {
  const float factor = static_cast<float>(std::exp2(options.exposure));
  for (float& value : image.data) value *= factor;
  if (options.colours) image = in_false_colours(image, options.files.back());
}

/// Converts numbered images, or several sequences side by side, to a video.
void convert_frames(const ConvertOptions& options) {
  constexpr double kUsualRate = 24;
  const std::vector<std::string> inputs(options.files.begin(), options.files.end() - 1);
  const std::string& output = options.files.back();
  for (const std::string& input : inputs)
    if (!is_frame_pattern(input))
      throw Error(ErrorCode::kUsage, fmt::format("'{}': of a video, expected names with '#' for the frame number, e.g. "
                                                 "out_####.exr",
                                                 input));
  const std::vector<int> frames = frames_on_disk(inputs[0]);
  if (frames.empty()) throw Error(ErrorCode::kInput, fmt::format("there are no frames '{}'", inputs[0]));
  Outputs outputs;
  for (const int frame : frames)
    for (const std::string& input : inputs) outputs.reads(frame_name(input, frame));
  outputs.writes("the output", output, OutputKind::kText);
  check_not_lost(options);
  VideoWriter video(output, options.rate.value_or(kUsualRate));
  for (const int frame : frames) {
    std::vector<Image> images;
    for (const std::string& input : inputs)
      images.push_back(read_image(frame_name(input, frame), options.layer, options.checksums()).image);
    Image image = images.size() == 1 ? std::move(images[0]) : side_by_side(images);
    expose(options, image);
    video.add(image);
  }
  video.finish();
}

void convert(const ConvertOptions& options) {
  if (options.files.size() < 2) throw Error(ErrorCode::kUsage, "convert needs an image to read and one to write");
  if (is_video_name(options.files.back())) return convert_frames(options);
  if (options.rate) throw Error(ErrorCode::kUsage, "--fps is an option of videos (.mp4, .mkv, .mov, .webm)");
  const std::vector<std::string> inputs(options.files.begin(), options.files.end() - 1);
  const std::string& output = options.files.back();
  Outputs outputs;
  outputs.reads(inputs);
  outputs.writes("the output", output, OutputKind::kImage);
  check_not_lost(options);
  std::vector<Image> images;
  ImagePlace place;
  for (const std::string& input : inputs) {
    PlacedImage image = read_image(input, options.layer, options.checksums());
    place = image.place;
    images.push_back(std::move(image.image));
  }
  check_memory(images, output);
  Image image = images.size() == 1 ? std::move(images[0]) : side_by_side(images);
  if (inputs.size() > 1) place = {image.width, image.height, {0, 0, image.width, image.height}};
  expose(options, image);
  write_image(output, image, place, attributes_of(options));
}

}  // namespace

void add_convert(CLI::App& app) {
  const auto o = std::make_shared<ConvertOptions>();
  CLI::App* command =
      app.add_subcommand("convert", "Convert images, or layers of films, to EXR, PNG, HDR, PFM, JPEG or TIFF");
  add_value(*command, "FILES", o->files, kFileValue,
            "Images (EXR, HDR, PFM, …), put side by side, and last the output, whose name sets the format (.exr "
            ".pfm .tif: 32-bit linear, .hdr: linear, .png .jpg: 8-bit sRGB; .mp4 .mkv .mov "
            ".webm: a video of in_####.exr, by ffmpeg)")
      ->option_text("IN... OUT")
      ->required();
  command->add_option("-e,--exposure", o->exposure, "Stops: the image is multiplied by 2^E")
      ->check(real_number(-100, 100))
      ->capture_default_str();
  command->add_option("--fps", o->rate, "Frames per second of a video; default: 24")->check(real_number(0.01, 1000));
  add_value(*command, "--layer", o->layer, "LAYER",
            "Layer (N, group03, …) or single channel (samples) instead of R G B");
  command->add_flag("--false-colours", o->colours,
                    "Show brightness in the colours of error maps, e.g. for --layer StdError; their scale is printed");
  command->add_flag("--accept-changed", o->accept_changed,
                    "Accept an image of covary that another program changed; the output records no origin");
  command->add_flag("--overwrite", o->overwrite, "Replace any existing OUT, not only pictures made by convert");
  command->callback([o] { convert(*o); });
}

}  // namespace covary
