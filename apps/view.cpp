// SPDX-License-Identifier: Apache-2.0
// covary view: an HTML page that compares images, opened in the browser or written to a file.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "browser.h"
#include "commands.h"
#include "comparison_warnings.h"
#include "core/error.h"
#include "declared_options.h"
#include "film/film_file.h"
#include "film/image_file.h"
#include "film/outputs.h"
#include "frame_files.h"
#include "live.h"
#include "metrics/alignment.h"
#include "metrics/metrics.h"
#include "numbers.h"
#include "picture_options.h"
#include "report/report.h"
#include "risk/predicted_error.h"
#include "sequences/frame_names.h"
#include "value_names.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxLayers = 100;  // of a file

struct ViewOptions {
  std::vector<std::string> images, insets;
  std::string reference, output, title, frames;
  PictureChoice choice;
  double fps = 24;
  bool small = false;
  LiveOptions live;

  bool is_sequence() const { return is_frame_pattern_of_input(images[0]); }
};

/// An image as the page shows it.
struct Shown {
  std::string path, name;
  PlacedImage source;
  bool is_reference = false;
  PictureChoice choice = {};
  std::string layer;
  std::string id() const { return choice.view.empty() ? path : path + ":" + choice.view; }
};

constexpr double kPixels = 3 * sizeof(float);  // bytes per pixel

/// The shortest distinct suffixes of the paths: "a/pt.exr" and "b/pt.exr", but "pt" if it is alone.
void name_images(std::vector<Shown>& images) {
  for (Shown& image : images) image.name = fs::path(image.path).stem().string();
  for (Shown& image : images) {
    const auto same = [&](const Shown& other) {
      return &other != &image && other.path != image.path && fs::path(other.path).stem() == fs::path(image.path).stem();
    };
    if (std::any_of(images.begin(), images.end(), same)) image.name = image.path;
  }
  for (Shown& image : images)
    if (!image.choice.view.empty()) image.name += " " + image.choice.view;
}

/// The same for frames, named after their sequences: "pt" of "pt_####.exr".
void name_frames(const ViewOptions& options, int frame, std::vector<Shown>& images) {
  std::vector<std::string> patterns = options.images;
  if (!options.reference.empty()) patterns.push_back(options.reference);
  std::vector<Shown> sequences;
  for (const std::string& pattern : patterns) sequences.push_back({pattern, "", {}});
  name_images(sequences);
  for (Shown& image : images)
    for (const Shown& sequence : sequences)
      if (file_of_frame(sequence.path, frame) == image.path) {
        image.name = sequence.name;
        while (image.name.size() > 1 && std::strchr("#_-.", image.name.back())) image.name.pop_back();
      }
}

std::vector<Shown> read_images(const ViewOptions& options) {
  std::vector<Shown> images;
  const auto add = [&](const std::string& path, bool is_reference) {
    const auto same = [&](const Shown& image) { return image.path == path; };
    if (std::find_if(images.begin(), images.end(), same) != images.end()) return;
    const std::vector<PictureChoice> views = each_view(path, options.choice);
    const CropWindow window = inspect_image(path).place.window;  // the page holds two more copies, cropped and encoded
    require_image_memory(path, window.width, window.height, 3 * kPixels * static_cast<double>(views.size()));
    for (const PictureChoice& view : views)
      images.push_back({path, "", read_image(path, chosen_layer(path, view)), is_reference && views.size() == 1, view,
                        chosen_layer(path, view)});
  };
  if (!options.reference.empty()) add(options.reference, true);
  for (const std::string& path : options.images) add(path, false);
  name_images(images);
  return images;
}

CropWindow window_of_all(const std::vector<Shown>& images) {
  const Shown& first = images[0];
  CropWindow window = first.source.place.window;
  for (const Shown& image : images)
    window = common_window(first.path, first.source.place, window, image.path, image.source.place);
  return window;
}

/// "X,Y,WIDTH,HEIGHT" in pixels of the page's images.
nlohmann::ordered_json parse_inset(const std::string& text, const CropWindow& window) {
  const auto v = parse_numbers("--inset", text, ',', 4, "X,Y,WIDTH,HEIGHT in pixels, e.g. 240,160,80,60");
  if (v[2] < 1 || v[3] < 1 || v[0] + v[2] > window.width || v[1] + v[3] > window.height)
    throw Error(ErrorCode::kUsage, fmt::format("--inset '{}' does not fit into the {} x {} pixels of the images", text,
                                               window.width, window.height));
  return {{"x", v[0]}, {"y", v[1]}, {"w", v[2]}, {"h", v[3]}};
}

/// How the page displays a layer: normals and other vectors are not colours.
const char* display_of(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                       const std::string& layer) {
  const std::vector<std::string> names = layer_channels(path, channels, layer);
  std::string lower = layer;
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (names[0] == names[1] || layer == "Bias") return "range";
  if (lower == "n" || lower == "nn" || lower.find("normal") != std::string::npos) return "direction";
  return holds_colours(names) ? "picture" : "range";
}

/// The layers that the page offers: all but the image itself, alpha and the groups of a film.
std::vector<std::string> offered_layers(const std::vector<ExrFile::Channel>& channels, const std::string& shown) {
  std::vector<std::string> layers = image_layers(channels);
  std::erase_if(layers, [&](const std::string& layer) {
    const bool is_group =
        layer.size() > 5 && layer.starts_with("group") && layer.find_first_not_of("0123456789", 5) == std::string::npos;
    return layer.empty() || layer == shown || layer == "A" || is_group;
  });
  return layers;
}

/// The unfinished page.
struct Page {
  CropWindow window;
  bool small = false;
  std::optional<Image> reference;
  bool reference_low_range = false;
  std::vector<ReportImage> images;

  nlohmann::ordered_json add(const Shown& image);

 private:
  void add_layers(const Shown& image, const std::string& shown, nlohmann::ordered_json& entry);
  /// Label and note: relMSE and what the standard errors predict of it.
  void add_errors(const Shown& image, const Image& pixels, nlohmann::ordered_json& entry) const;
};

void Page::add_errors(const Shown& image, const Image& pixels, nlohmann::ordered_json& entry) const {
  if (reference)
    entry["label"] = fmt::format("relMSE {:.3g}", compute_metric(Metric::kRelMse, pixels, {&*reference, 1}).value);
  const std::string errors = image.id() + ":StdError";
  const auto layer = std::find_if(images.begin(), images.end(), [&](const auto& i) { return i.id == errors; });
  if (layer == images.end() || layer->pixels.channels != 3) return;
  std::string predicted = fmt::format("{:.3g}", predicted_relmse({pixels, layer->pixels}));
  const bool is_whole = image.source.place.window == window;  // bounds are those of the whole image
  if (const auto bounds = predicted_bounds(inspect_image(image.path)); bounds && is_whole)
    predicted += fmt::format(" ({:.2g} to {:.2g})", (*bounds)[0], (*bounds)[1]);
  if (reference)
    entry["note"] = "predicted " + predicted;
  else
    entry["label"] = "predicted relMSE " + predicted;
}

/// Adds the other layers of the image's file, keeping single channels as such.
void Page::add_layers(const Shown& image, const std::string& shown, nlohmann::ordered_json& entry) {
  const ImageInfo info = inspect_image(image.path);
  std::vector<std::string> layers = offered_layers(info.channels, shown);
  if (layers.size() > kMaxLayers) {
    fmt::print(stderr,
               "covary: {}: {} layers beside the image; the page has the first {} (--layer shows another one)\n",
               image.path, layers.size(), kMaxLayers);
    layers.resize(kMaxLayers);
  }
  if (layers.empty()) return;
  std::vector<Image> read = read_layers(image.path, layers);
  for (size_t l = 0; l < layers.size(); ++l) {
    const std::string& layer = layers[l];
    Image pixels = cut({image.source.place, std::move(read[l])}, window);
    const std::vector<std::string> names = layer_channels(image.path, info.channels, layer);
    if (names[0] == names[1]) {
      Image grey(pixels.width, pixels.height, 1);
      for (size_t i = 0; i < grey.data.size(); ++i) grey.data[i] = pixels.data[3 * i];
      pixels = std::move(grey);
    }
    const std::string id = image.id() + ":" + layer;
    entry["layers"].push_back(
        {{"name", layer}, {"image", id}, {"display", display_of(image.path, info.channels, layer)}});
    images.push_back({id, std::move(pixels)});
  }
}

nlohmann::ordered_json Page::add(const Shown& image) {
  nlohmann::ordered_json entry{{"name", image.name}, {"image", image.id()}};
  constexpr double kFlip = 150;  // bytes per pixel
  require_image_memory(image.path, window.width, window.height, 2 * kPixels + (reference && !small ? kFlip : 0));
  Image pixels = cut(image.source, window);
  if (!small) add_layers(image, image.layer, entry);
  if (image.is_reference) {
    entry["role"] = "reference";
    reference = pixels;
    reference_low_range = image.source.low_dynamic_range;
  } else if (reference && !small) {
    const bool low_range = image.source.low_dynamic_range && reference_low_range;
    MetricResult flip = compute_metric(Metric::kFlip, pixels, {&*reference, 1}, low_range);
    entry["flip"] = image.id() + ":FLIP";
    images.push_back({image.id() + ":FLIP", std::move(flip.map)});
  }
  if (image.is_reference)
    entry["label"] = "reference";
  else
    add_errors(image, pixels, entry);
  const auto is_it = [&](const ReportImage& other) { return other.id == image.id(); };  // an image of all frames
  if (std::none_of(images.begin(), images.end(), is_it)) images.push_back({image.id(), std::move(pixels)});
  return entry;
}

std::string names_of(const std::vector<Shown>& images) {
  std::vector<std::string> names;
  for (const Shown& image : images)
    if (!image.is_reference || images.size() == 1) names.push_back(image.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Images beside a reference, or alone; an image that is also the reference is not listed as an image.
std::vector<std::string> warnings_of(const ViewOptions& options) {
  std::vector<std::string> images = options.images, references, all;
  if (!options.reference.empty()) {
    references.push_back(options.reference);
    std::erase(images, options.reference);
  }
  std::set<std::string> printed;
  for (const std::vector<std::string>& warnings : warn_of_comparison(images, references, printed, false))
    for (const std::string& warning : warnings)
      if (std::find(all.begin(), all.end(), warning) == all.end()) all.push_back(warning);
  return all;
}

/// Adds images of one frame to the page: a scene of its comparer, with the images' names as its name.
nlohmann::ordered_json add_scene(const ViewOptions& options, std::optional<int> frame, Page& page) {
  ViewOptions one = options;
  if (frame) {
    for (std::string& path : one.images) path = file_of_frame(path, *frame);
    if (!one.reference.empty()) one.reference = file_of_frame(one.reference, *frame);
  }
  std::vector<Shown> shown = read_images(one);
  if (frame) name_frames(options, *frame, shown);
  page.window = window_of_all(shown);
  page.reference.reset();
  for (const Shown& image : shown)
    if (!(image.source.place.window == page.window))
      fmt::print(stderr, "covary: {}: shown are the pixels in common, {}\n", image.path, text_of(page.window));
  nlohmann::ordered_json entries = nlohmann::ordered_json::array(), insets = nlohmann::ordered_json::array();
  for (const Shown& image : shown) entries.push_back(page.add(image));
  for (const std::string& inset : options.insets) insets.push_back(parse_inset(inset, page.window));
  return {{"name", names_of(shown)}, {"images", entries}, {"insets", insets}};
}

/// Adds frames as scenes of the comparer, which plays them; all must fit in memory.
nlohmann::ordered_json add_frames(const ViewOptions& options, Page& page) {
  const std::vector<int> frames = frames_of(options.frames, options.images[0]);
  page.small = true;
  nlohmann::ordered_json scenes = nlohmann::ordered_json::array();
  for (const int frame : frames) {
    scenes.push_back(add_scene(options, frame, page));
    scenes.back()["name"] = fmt::format("frame {}", frame);
    double bytes = 0;
    for (const ReportImage& image : page.images) bytes += static_cast<double>(image.pixels.data.size()) * sizeof(float);
    const double pixels = static_cast<double>(page.window.width) * page.window.height;
    require_image_memory(file_of_frame(options.images[0], frame), page.window.width, page.window.height,
                         2 * bytes / pixels);
  }
  return scenes;
}

void write_page(const ViewOptions& options, const std::string& path) {
  Page page{{}, options.small};
  nlohmann::ordered_json block{{"type", "comparer"}, {"id", "view"}};
  std::vector<std::string> warnings;
  std::string title = options.title;
  if (options.is_sequence()) {
    block["fps"] = options.fps;
    block["scenes"] = add_frames(options, page);
    if (title.empty()) title = fmt::format("{}", fmt::join(options.images, ", "));
  } else {
    nlohmann::ordered_json scene = add_scene(options, std::nullopt, page);
    warnings = warnings_of(options);
    if (title.empty()) title = scene["name"];
    scene["name"] = title;
    block["scenes"] = {scene};
  }
  nlohmann::ordered_json section{{"id", "images"}, {"blocks", {block}}};
  if (!warnings.empty()) section["blocks"].push_back({{"type", "notes"}, {"kind", "warning"}, {"items", warnings}});
  write_report(path, {{"title", title}, {"sections", {section}}}, page.images);
}

std::string temporary_page() {
  const char* folder = std::getenv("TMPDIR");
  std::string path = (fs::path(folder && *folder ? folder : "/tmp") / "covary-view-XXXXXX.html").string();
  const int descriptor = mkstemps(path.data(), 5);
  if (descriptor < 0)
    throw Error(ErrorCode::kIo, fmt::format("cannot make a page in {} ({}); name one by -o, or a folder by TMPDIR",
                                            fs::path(path).parent_path().string(), std::strerror(errno)));
  close(descriptor);
  return path;
}

/// Throws Error(kUsage) if only some of the images are frames.
void check_frames(const ViewOptions& options) {
  for (const std::string& path : options.images)
    if (is_frame_pattern_of_input(path) != options.is_sequence())
      throw Error(ErrorCode::kUsage,
                  fmt::format("'{}' and '{}': either all images are names with '#', or none", options.images[0], path));
  if (!options.is_sequence() && !options.frames.empty())
    throw Error(ErrorCode::kUsage, "--frames needs frames, whose names have a '#' for the number");
}

void view(const ViewOptions& options) {
  if (options.live.wanted()) {
    if (options.images.size() != 1 || !options.reference.empty() || !options.output.empty())
      throw Error(ErrorCode::kUsage, "--live follows one file or folder, and writes no page");
    return follow(options.live, options.images[0]);
  }
  check_frames(options);
  Outputs outputs;
  std::vector<std::string> read = options.images;
  if (!options.reference.empty()) read.push_back(options.reference);
  for (const int frame : options.is_sequence() ? frames_of(options.frames, options.images[0]) : std::vector{0})
    for (const std::string& path : read) outputs.reads(file_of_frame(path, frame));
  if (!options.output.empty()) {
    outputs.writes("-o", options.output, OutputKind::kPage);
    return write_page(options, options.output);
  }
  const std::string path = temporary_page();
  try {
    write_page(options, path);
  } catch (...) {
    fs::remove(path);
    throw;
  }
  fmt::print("{}\n", path);
  std::fflush(stdout);
  if (!open_in_browser(path))
    fmt::print(stderr, "note: no browser could be opened; open {} in one, or give the page a name by -o PAGE.html\n",
               path);
}

}  // namespace

void add_view(CLI::App& app) {
  const auto o = std::make_shared<ViewOptions>();
  CLI::App* command = app.add_subcommand("view", "Compare images in the browser: one page without a network");
  add_value(*command, "IMAGES", o->images, kFileValue,
            "Images (EXR, PNG, HDR, PFM, …) of the same frame, or sequences (out_####.exr) to play side by side")
      ->required();
  add_value(*command, "-r,--reference", o->reference, kFileValue, "Show errors relative to this image");
  add_value(*command, "-o,--output", o->output, kFileValue, "Write the page (HTML) here instead of opening it");
  add_picture_options(*command, o->choice, "Show", "default: the picture");
  add_value(*command, "--inset", o->insets, "X,Y,WIDTH,HEIGHT", "Magnify this crop; may be repeated")
      ->take_all()
      ->expected(1)
      ->allow_extra_args(false);
  command->add_flag(
      "--small", o->small,
      "Leave out FLIP and the files' other layers (StdError, Albedo, N, …): a smaller page, written faster");
  add_live_options(*command, o->live,
                   "Follow a file or folder while others write it: a running render, a cluster's films, frames");
  add_value(*command, "--frames", o->frames, "FIRST-LAST", "Only these frames of out_####.exr; default: all");
  command->add_option("--fps", o->fps, "Frames per second at which a sequence is played")
      ->check(positive_number())
      ->capture_default_str();
  add_value(*command, "--title", o->title, "TITLE", "Title of the page; default: the images' names");
  command->callback([o] { view(*o); });
}

}  // namespace covary
