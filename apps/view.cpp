// SPDX-License-Identifier: Apache-2.0
// covary view: an HTML page that compares images, opened in the browser or written to a file.
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "commands.h"
#include "core/error.h"
#include "film/alignment.h"
#include "film/image_file.h"
#include "film/metrics.h"
#include "report/report.h"

extern char** environ;

namespace covary {
namespace {

namespace fs = std::filesystem;

struct ViewOptions {
  std::vector<std::string> images, insets;
  std::string reference, layer, output, title;
};

/// An image as the page shows it.
struct Shown {
  std::string path, name;
  PlacedImage source;
  bool is_reference = false;
};

/// The shortest ends of the paths that differ from each other: "a/pt.exr" and "b/pt.exr", but "pt" where it is alone.
void name_images(std::vector<Shown>& images) {
  for (Shown& image : images) image.name = fs::path(image.path).stem().string();
  for (Shown& image : images) {
    const auto same = [&](const Shown& other) {
      return &other != &image && other.path != image.path && fs::path(other.path).stem() == fs::path(image.path).stem();
    };
    if (std::any_of(images.begin(), images.end(), same)) image.name = image.path;
  }
}

std::vector<Shown> read_images(const ViewOptions& options) {
  std::vector<Shown> images;
  const auto add = [&](const std::string& path, bool is_reference) {
    const auto same = [&](const Shown& image) { return image.path == path; };
    if (std::find_if(images.begin(), images.end(), same) != images.end()) return;
    images.push_back({path, "", read_image(path, options.layer), is_reference});
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
  int x = 0, y = 0, w = 0, h = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%d,%d,%d,%d%c", &x, &y, &w, &h, &rest) != 4)
    throw Error(ErrorCode::kUsage, "--inset '" + text + "': expected X,Y,WIDTH,HEIGHT in pixels, e.g. 240,160,80,60");
  if (x < 0 || y < 0 || w < 1 || h < 1 || x > window.width - w || y > window.height - h)
    throw Error(ErrorCode::kUsage, fmt::format("--inset '{}' does not fit into the {} x {} pixels of the images", text,
                                               window.width, window.height));
  return {{"x", x}, {"y", y}, {"w", w}, {"h", h}};
}

nlohmann::ordered_json image_entry(const Shown& image, const Image& pixels, const std::optional<Image>& reference) {
  nlohmann::ordered_json entry{{"name", image.name}, {"image", image.path}};
  if (image.is_reference) {
    entry["role"] = "reference";
    entry["label"] = "reference";
  } else if (reference) {
    const MetricResult error = compute_metric(Metric::kRelMse, pixels, {&*reference, 1});
    entry["label"] = fmt::format("relMSE {:.3g}", error.value);
  }
  return entry;
}

std::string names_of(const std::vector<Shown>& images) {
  std::vector<std::string> names;
  for (const Shown& image : images)
    if (!image.is_reference || images.size() == 1) names.push_back(image.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

void write_page(const ViewOptions& options, const std::string& path) {
  const std::vector<Shown> shown = read_images(options);
  const CropWindow window = window_of_all(shown);
  nlohmann::ordered_json entries = nlohmann::ordered_json::array(), insets = nlohmann::ordered_json::array();
  std::vector<ReportImage> images;
  std::optional<Image> reference;
  for (const Shown& image : shown) {
    Image pixels = cut(image.source, window);
    if (image.is_reference) reference = pixels;
    entries.push_back(image_entry(image, pixels, reference));
    images.push_back({image.path, std::move(pixels)});
  }
  for (const std::string& inset : options.insets) insets.push_back(parse_inset(inset, window));
  const std::string title = options.title.empty() ? names_of(shown) : options.title;
  const nlohmann::ordered_json scene{{"name", title}, {"images", entries}, {"insets", insets}};
  const nlohmann::ordered_json block{{"type", "comparer"}, {"id", "view"}, {"scenes", {scene}}};
  const nlohmann::ordered_json section{{"id", "images"}, {"blocks", {block}}};
  write_report(path, {{"title", title}, {"sections", {section}}}, images);
}

std::string temporary_page() {
  std::string path = (fs::temp_directory_path() / "covary-view-XXXXXX.html").string();
  const int descriptor = mkstemps(path.data(), 5);
  if (descriptor < 0) throw Error(ErrorCode::kIo, "cannot create a file in " + fs::temp_directory_path().string());
  close(descriptor);
  return path;
}

/// Asks the desktop to open the file; false where there is none.
bool open_in_browser(const std::string& path) {
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return false;
  std::string program = "xdg-open", argument = path;
  char* arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  int status = 0;
  return posix_spawnp(&child, "xdg-open", nullptr, nullptr, arguments, environ) == 0 &&
         waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

void view(const ViewOptions& options) {
  if (!options.output.empty()) {
    const std::string extension = fs::path(options.output).extension().string();
    if (extension != ".html" && extension != ".htm")
      throw Error(ErrorCode::kUsage, "-o '" + options.output + "': the page's name must end in .html");
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
  if (!open_in_browser(path)) fmt::print(stderr, "covary: no browser could be opened; open the file above in one\n");
}

}  // namespace

void add_view(CLI::App& app) {
  const auto o = std::make_shared<ViewOptions>();
  CLI::App* command = app.add_subcommand("view", "Compare images in the browser: one page without a network");
  command->add_option("IMAGES", o->images, "Images of any renderer (EXR, PNG, HDR, PFM, …), all of one frame")
      ->required();
  command->add_option("-r,--reference", o->reference, "Shows errors relative to this image");
  command->add_option("-o,--output", o->output, "Write the page (HTML) here instead of opening it");
  command->add_option("--layer", o->layer, "Show this layer (N, group03, …) in place of R G B");
  command->add_option("--inset", o->insets, "X,Y,WIDTH,HEIGHT: magnify this crop; may be given again")
      ->take_all()
      ->expected(1)
      ->allow_extra_args(false);
  command->add_option("--title", o->title, "Title of the page; default: the images' names");
  command->callback([o] { view(*o); });
}

}  // namespace covary
