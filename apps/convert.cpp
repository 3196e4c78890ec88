// SPDX-License-Identifier: Apache-2.0
// covary convert: any image or layer of a film, or several side by side, in another format.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <numeric>
#include <optional>
#include <vector>

#include "combine/result_file.h"
#include "commands.h"
#include "core/error.h"
#include "core/number_text.h"
#include "declared_options.h"
#include "film/exr_copy.h"
#include "film/image_rows.h"
#include "film/image_writer.h"
#include "film/outputs.h"
#include "frame_files.h"
#include "metrics/error_map.h"
#include "metrics/provenance.h"
#include "numbers.h"
#include "picture_options.h"
#include "sequences/frame_names.h"
#include "value_names.h"
#include "video.h"

namespace covary {
namespace {

constexpr const char* kOutput = "the output";  // in messages

struct ConvertOptions {
  std::vector<std::string> files;  // the last is the output
  PictureChoice choice;
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

/// A picture multiplied by its alpha, if it has any.
struct LoadedPicture {
  PlacedImage colours;
  Image alpha;
};

LoadedPicture read_picture(const ConvertOptions& options, const std::string& path, const std::string& layer) {
  LoadedPicture picture{read_image(path, layer, options.checksums()), {}};
  if (options.colours) return picture;
  Alpha alpha = read_alpha(path, layer, options.checksums());
  for (size_t i = 0; alpha.straight && i < alpha.values.data.size(); ++i)
    for (size_t c = 0; c < 3; ++c) picture.colours.image.data[3 * i + c] *= alpha.values.data[i];
  picture.alpha = std::move(alpha.values);
  return picture;
}

/// All views of the file that are asked for.
void read_pictures(const ConvertOptions& options, const std::string& path, std::vector<LoadedPicture>& pictures) {
  for (const PictureChoice& view : each_view(path, options.choice))
    pictures.push_back(read_picture(options, path, chosen_layer(path, view)));
}

/// The images side by side, top-aligned, with 0 below shorter ones.
Image side_by_side(const std::vector<const Image*>& images) {
  int width = 0, height = 0;
  for (const Image* image : images) {
    width += image->width;
    height = std::max(height, image->height);
  }
  Image result(width, height, images[0]->channels);
  int left = 0;
  for (const Image* image : images) {
    for (int y = 0; y < image->height; ++y)
      std::copy_n(image->pixel(0, y), image->width * image->channels, result.pixel(left, y));
    left += image->width;
  }
  return result;
}

/// The frames of the pictures side by side, opaque without alpha; the picture itself if there is only one.
LoadedPicture joined(std::vector<LoadedPicture> pictures) {
  if (pictures.size() == 1) return std::move(pictures[0]);
  const bool has_alpha =
      std::any_of(pictures.begin(), pictures.end(), [](const LoadedPicture& p) { return !p.alpha.data.empty(); });
  std::vector<const Image*> colours, alphas;
  for (LoadedPicture& picture : pictures) {
    picture.colours.image = framed(picture.colours.image, picture.colours.place);
    const Image& image = picture.colours.image;
    colours.push_back(&image);
    if (!has_alpha) continue;
    if (picture.alpha.data.empty())
      picture.alpha = Image(image.width, image.height, 1), std::ranges::fill(picture.alpha.data, 1.0f);
    else
      picture.alpha = framed(picture.alpha, picture.colours.place);
    alphas.push_back(&picture.alpha);
  }
  LoadedPicture all;
  Image& image = all.colours.image = side_by_side(colours);
  if (has_alpha) all.alpha = side_by_side(alphas);
  all.colours.place = {image.width, image.height, {0, 0, image.width, image.height}};
  return all;
}

/// covary's attributes of the new image: none are inherited from several images, nor if another program changed it.
std::map<std::string, std::string> attributes_of(const ConvertOptions& options, bool is_same_picture) {
  std::map<std::string, std::string> attributes;
  if (options.files.size() == 2 && !options.accept_changed) {
    const std::map<std::string, std::string> all = inspect_image(options.files[0]).attributes;
    if (is_same_picture)
      std::copy_if(all.begin(), all.end(), std::inserter(attributes, attributes.end()),
                   [](const auto& a) { return a.first.starts_with("covary:") && a.first != kChecksums; });
    else
      attributes = inherited_attributes({&all, 1});
  }
  const auto earlier = attributes.find(kExposureAttribute);
  const double exposure =
      options.exposure + (earlier == attributes.end() ? 0 : parse_real(earlier->second).value_or(0));
  attributes.erase(kExposureAttribute);
  if (exposure != 0) attributes[kExposureAttribute] = fmt::format("{:g}", exposure);
  if (!options.choice.layer.empty()) attributes["covary:layer"] = options.choice.layer;
  attributes["covary:version"] = COVARY_VERSION;
  attributes["covary:command"] = command_line();
  return attributes;
}

/// Checks memory for the result: one image side by side if there are several, and a copy for writing.
void check_memory(const ConvertOptions& options) {
  constexpr double kPixel = 4 * sizeof(float);
  const size_t n_inputs = options.files.size() - 1;
  int width = 0, height = 0;
  for (size_t i = 0; i < n_inputs; ++i) {
    const ImagePlace place = inspect_image(options.files[i], options.checksums()).place;
    width += std::max(place.window.width, place.frame_width);
    height = std::max({height, place.window.height, place.frame_height});
  }
  require_image_memory(n_inputs > 1 ? options.files.back() : options.files[0], width, height,
                       (n_inputs > 1 ? 3 : 2) * kPixel);
}

void expose(const ConvertOptions& options, Image& image) {
  const float factor = static_cast<float>(std::exp2(options.exposure));
  for (float& value : image.data) value *= factor;
  if (options.colours) image = in_false_colours(image, options.files.back());
}

/// EXR to EXR: what does not change stays as it is. A layer becomes the picture of a file of its own.
void convert_exr(const ConvertOptions& options) {
  const std::string &input = options.files[0], &output = options.files[1];
  const bool is_all = options.choice.layer.empty() && options.choice.view == "all";
  const std::string layer = is_all ? "" : chosen_layer(input, options.choice);
  const bool is_layer = !is_all && !is_unnamed(options.choice), is_same_picture = !is_layer && options.exposure == 0;
  ExrChanges changes;
  changes.attributes = attributes_of(options, is_same_picture);
  PlacedImage image;
  Alpha alpha;
  if (!is_same_picture) {
    check_memory(options);
    const ExrFile file(input, options.checksums());
    const std::vector<std::string> names = layer_channels(input, file.channels(), layer);
    image = read_image(input, layer, options.checksums(), std::nullopt);
    expose(options, image.image);
    const bool is_grey = names[0] == names[2];
    for (size_t c = 0; c < (is_grey && !is_layer ? 1 : 3); ++c)
      changes.planes.push_back({is_layer ? std::string(1, "RGB"[c]) : names[c], ExrPlane::Type::kFloat,
                                image.image.data.data() + c, 3 * sizeof(float)});
    if (is_layer) alpha = read_alpha(input, layer, options.checksums());
    if (!alpha.values.data.empty()) add_image_planes("A", alpha.values, changes.planes);
    changes.picture = names[0];
    changes.only_planes = is_layer;
    changes.left_out = statistics_channels(file);
    if (!is_layer && !changes.left_out.empty())
      fmt::print(stderr, "warning: {}: errors and groups of samples are left out, since --exposure changes the image\n",
                 output);
  }
  for (const std::string& what : write_changed_exr(output, input, changes, options.checksums()))
    fmt::print(stderr, "warning: {}\n", what);
}

/// A picture that fills its frame to PNG, or one of another format to EXR, in the memory of a few rows; false if it is
/// of another kind.
bool convert_by_rows(const ConvertOptions& options) {
  const std::string &input = options.files[0], &output = options.files[1], extension = lower_extension(output);
  if (options.files.size() > 2 || options.colours || options.choice.view == "all" ||
      (extension != ".png" && extension != ".exr"))
    return false;
  const std::string layer = chosen_layer(input, options.choice);
  std::optional<ImageRows> file;
  file.emplace(input, layer, options.checksums());
  const ImagePlace place = file->place();
  if (!(place.window == CropWindow{0, 0, place.frame_width, place.frame_height})) return false;
  const auto rows = [&](int first, int n) {
    if (first == 0) {  // once more
      file.emplace(input, layer, options.checksums());
      file->convert_to(ColourSpace::rec709());
    }
    Image colours = file->read(first, n), alpha = file->has_alpha() ? file->read_alpha(first, n) : Image();
    for (size_t i = 0; file->has_straight_alpha() && i < alpha.data.size(); ++i)
      for (size_t c = 0; c < 3; ++c) colours.data[3 * i + c] *= alpha.data[i];
    expose(options, colours);
    return std::pair(std::move(colours), std::move(alpha));
  };
  if (extension == ".png")
    write_png_rows(output, place.frame_width, place.frame_height, rows);
  else
    write_exr_rows(output, place, attributes_of(options, false), rows);
  return true;
}

/// One image, or several side by side, to one.
void convert_one(const ConvertOptions& options) {
  const std::vector<std::string> inputs(options.files.begin(), options.files.end() - 1);
  const std::string& output = options.files.back();
  Outputs outputs;
  outputs.reads(inputs);
  outputs.writes_result(kOutput, output, OutputKind::kImage, "convert", options.overwrite);
  if (inputs.size() == 1 && lower_extension(output) == ".exr" && !options.colours && is_exr_image(inputs[0]))
    return convert_exr(options);
  if (convert_by_rows(options)) return;
  check_memory(options);
  std::vector<LoadedPicture> pictures;
  for (const std::string& input : inputs) read_pictures(options, input, pictures);
  LoadedPicture picture = joined(std::move(pictures));
  expose(options, picture.colours.image);
  write_image(output, picture.colours.image, picture.colours.place, attributes_of(options, false), picture.alpha);
}

bool names_frames(const std::string& path) { return is_frame_pattern(path) && !std::filesystem::exists(path); }

/// Converts numbered images, or several sequences side by side, to a video.
void convert_to_video(const ConvertOptions& options) {
  constexpr double kDefaultRate = 24;
  const std::vector<std::string> inputs(options.files.begin(), options.files.end() - 1);
  const std::string& output = options.files.back();
  for (const std::string& input : inputs)
    if (!is_frame_pattern(input))
      throw Error(ErrorCode::kUsage, fmt::format("'{}': of a video, expected names with '#' for the frame number, e.g. "
                                                 "out_####.exr",
                                                 input));
  const std::vector<int> frames = frames_on_disk(inputs[0]);
  if (frames.empty()) throw Error(ErrorCode::kInput, fmt::format("there are no frames '{}'", inputs[0]));
  note_gaps(inputs[0], frames);
  Outputs outputs;
  for (const int frame : frames)
    for (const std::string& input : inputs) {
      outputs.reads(frame_name(input, frame));
      inspect_image(frame_name(input, frame), options.checksums());  // before any frame is spent
    }
  outputs.writes_result(kOutput, output, OutputKind::kText, "convert", options.overwrite);
  VideoWriter video(output, options.rate.value_or(kDefaultRate));
  for (const int frame : frames) {
    std::vector<LoadedPicture> pictures;
    for (const std::string& input : inputs) read_pictures(options, frame_name(input, frame), pictures);
    const LoadedPicture picture = joined(std::move(pictures));
    Image image = framed(picture.colours.image, picture.colours.place);
    expose(options, image);
    video.add(image);
  }
  video.finish();
  fmt::print(stderr, "{}: {} at {:g} per second\n", output, counted(frames.size(), "frame"),
             options.rate.value_or(kDefaultRate));
}

/// Converts numbered images to numbered images; a file without a number is the same for all.
void convert_frames(const ConvertOptions& options) {
  const auto pattern = std::find_if(options.files.begin(), options.files.end() - 1, names_frames);
  if (pattern == options.files.end() - 1)
    throw Error(ErrorCode::kUsage, fmt::format("the output '{}' has a '#' for the number of a frame, but no input has",
                                               options.files.back()));
  const std::vector<int> frames = frames_on_disk(*pattern);
  if (frames.empty()) throw Error(ErrorCode::kInput, fmt::format("there are no frames '{}'", *pattern));
  std::vector<ConvertOptions> of_frames;
  for (const int frame : frames) {
    ConvertOptions& one = of_frames.emplace_back(options);
    for (std::string& file : one.files)
      if (names_frames(file)) file = frame_name(file, frame);
    for (size_t i = 0; i + 1 < one.files.size(); ++i) inspect_image(one.files[i], options.checksums());
  }
  note_gaps(*pattern, frames);
  for (const ConvertOptions& one : of_frames) convert_one(one);
  fmt::print(stderr, "{}: {}\n", options.files.back(), counted(frames.size(), "frame"));
}

void convert(const ConvertOptions& options) {
  if (options.files.size() < 2) throw Error(ErrorCode::kUsage, "convert needs an image to read and one to write");
  if (is_video_name(options.files.back())) return convert_to_video(options);
  if (options.rate) throw Error(ErrorCode::kUsage, "--fps is an option of videos (.mp4, .mkv, .mov, .webm)");
  if (names_frames(options.files.back())) return convert_frames(options);
  if (const auto frames = std::find_if(options.files.begin(), options.files.end(), names_frames);
      frames != options.files.end())
    throw Error(ErrorCode::kUsage, fmt::format("'{}' are frames: expected an output with a '#', too, or a video "
                                               "(.mp4, .mkv, .mov, .webm)",
                                               *frames));
  convert_one(options);
  if (!std::filesystem::is_regular_file(options.files.back())) return;  // such as /dev/stdout
  const ImagePlace place = inspect_image(options.files.back()).place;
  fmt::print(stderr, "{}: {} x {} pixels\n", options.files.back(), place.window.width, place.window.height);
}

}  // namespace

void add_convert(CLI::App& app) {
  const auto o = std::make_shared<ConvertOptions>();
  CLI::App* command =
      app.add_subcommand("convert", "Convert images, or layers of films, to EXR, PNG, HDR, PFM, JPEG or TIFF");
  add_value(*command, "FILES", o->files, kFileValue,
            "Images (EXR, HDR, PFM, …), put side by side, and last the output, whose name sets the format (.exr "
            ".pfm .tif: 32-bit linear, .hdr: linear, .png .jpg: 8-bit sRGB; out_####.png: of "
            "frames in_####.exr; .mp4 .mkv .mov .webm: a video of them, by ffmpeg)")
      ->option_text("IN... OUT")
      ->required();
  command->add_option("-e,--exposure", o->exposure, "Stops: the image is multiplied by 2^E")
      ->check(real_number(-100, 100))
      ->capture_default_str();
  command->add_option("--fps", o->rate, "Frames per second of a video; default: 24")->check(real_number(0.01, 1000));
  add_picture_options(*command, o->choice, "Convert", "default: the picture; 'all' puts views side by side");
  command->add_flag("--false-colours", o->colours,
                    "Show brightness in the colours of error maps, e.g. for --layer StdError; their scale is printed");
  command->add_flag("--accept-changed", o->accept_changed,
                    "Accept an image of covary that another program changed; the output records no origin");
  add_overwrite_option(*command, o->overwrite);
  command->callback([o] { convert(*o); });
}

}  // namespace covary
