// SPDX-License-Identifier: Apache-2.0
#include "watched_folders.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <set>
#include <system_error>

#include "batch.h"
#include "core/error.h"
#include "core/number_text.h"
#include "core/printable.h"
#include "core/stopwatch.h"
#include "film/outputs.h"
#include "imageio/output_folder.h"
#include "settled_files.h"
#include "usage_error.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

/// The EXR files of a folder, without hidden ones, which are names of files that are not finished.
std::set<std::string> images_in(const std::string& folder) {
  std::set<std::string> names;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    std::string extension = entry.path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (!name.starts_with('.') && extension == ".exr" && entry.is_regular_file(ignored)) names.insert(name);
  }
  return names;
}

/// Images that appear in folders.
class FolderImages {
 public:
  explicit FolderImages(const std::vector<std::string>& folders) : folders_(folders) {}

  std::vector<std::string> paths(const std::string& name) const {
    std::vector<std::string> all;
    for (const std::string& folder : folders_) all.push_back((fs::path(folder) / name).string());
    return all;
  }

  /// The names that have become ready: their files are in all folders and settled.
  std::vector<std::string> next() {
    std::vector<std::string> ready;
    for (const std::string& name : images_in(folders_[0])) {
      if (seen_.contains(name)) continue;
      const std::vector<std::string> files = paths(name);
      size_t n = 0;  // of all files, so that each begins to settle
      for (const std::string& path : files) n += files_.is_settled(path);
      if (n == files.size()) seen_.insert(name), ready.push_back(name);
    }
    return ready;
  }

  /// Names with files that are incomplete, or missing in a folder.
  std::vector<std::string> unfinished() const {
    std::set<std::string> all;
    for (const std::string& folder : folders_) all.merge(images_in(folder));
    std::vector<std::string> left;
    std::set_difference(all.begin(), all.end(), seen_.begin(), seen_.end(), std::back_inserter(left));
    return left;
  }

 private:
  const std::vector<std::string>& folders_;
  std::set<std::string> seen_;
  SettledFiles files_;
};

bool is_denoised_result(const std::string& path) { return is_made_by(path, "denoise"); }

}  // namespace

bool are_folders(const FrameOptions& o, const std::vector<std::string>& inputs, const std::string& output) {
  std::error_code ignored;
  const auto is_folder = [&](const std::string& path) { return fs::is_directory(path, ignored); };
  if (std::none_of(inputs.begin(), inputs.end(), is_folder)) return false;
  if (const auto file = std::find_if_not(inputs.begin(), inputs.end(), is_folder); file != inputs.end())
    usage(fmt::format("'{}' is not a folder, but other inputs are", *file));
  if (!o.watch)
    usage(
        fmt::format("'{0}' is a folder; --watch denoises the images that are in it or come into it. Otherwise name "
                    "the renders of one picture, or frames such as '{0}/a.####.exr'",
                    inputs[0]));
  if (!o.frames.empty()) usage("--frames: the input is a folder, whose images have no numbers");
  if (o.no_history || !o.motion_scale.empty())
    usage("--no-history, --motion-scale: images of a folder have no history");
  if (output.empty() || (fs::exists(output, ignored) && !is_folder(output)))
    usage(fmt::format("-o '{}': for images of a folder, expected another folder", output));
  for (const std::string& input : inputs)
    if (is_same_file(input, output)) usage(fmt::format("-o '{}': expected another folder than the input", output));
  return true;
}

void for_each_image(
    const FrameOptions& o, const std::vector<std::string>& inputs, const std::string& output,
    const std::function<std::string(const std::vector<std::string>& paths, const std::string& result)>& run) {
  make_output_folder(output);
  FolderImages images(inputs);
  size_t n_done = 0, n_kept = 0;
  std::vector<std::string> failed;
  const Stopwatch watch;
  if (!o.quiet)
    fmt::print(stderr, "waiting for images in '{}'; Ctrl-C{} ends, and --resume continues\n", fmt::join(inputs, "', '"),
               o.idle ? fmt::format(", or {:g} s without a new one,", *o.idle) : "");
  poll(o.idle, [&] {
    const std::vector<std::string> ready = images.next();
    for (const std::string& name : ready) {
      const std::vector<std::string> paths = images.paths(name);
      const std::string result = (fs::path(output) / name).string();
      if (std::any_of(paths.begin(), paths.end(), is_denoised_result)) {
        fmt::print(stderr, "note: {} is left out: 'covary denoise' made it\n", printable(paths[0]));
      } else if (o.resume && fs::exists(result)) {
        ++n_kept;
      } else if (attempt(name, o.quiet, [&] { return run(paths, result); })) {
        ++n_done;
      } else {
        failed.push_back(name);
      }
    }
    return ready.empty() ? Found::kNothing : Found::kWork;
  });
  if (!o.quiet)
    fmt::print(stderr, "{} in {:.1f} s{}\n", counted(n_done, "image"), watch.seconds(),
               n_kept > 0 ? fmt::format("; {} existed already", n_kept) : "");
  const std::vector<std::string> left = images.unfinished();
  const size_t n_all = n_done + n_kept + failed.size() + left.size();
  std::vector<std::string> problems;
  if (!failed.empty())
    problems.push_back(fmt::format("{} of {} failed: {}; --resume tries again", failed.size(), counted(n_all, "image"),
                                   fmt::join(failed, ", ")));
  if (!left.empty())
    problems.push_back(fmt::format("{} of {} incomplete: {}; unfinished, or missing in one of '{}'", left.size(),
                                   counted(n_all, "image"), fmt::join(left, ", "), fmt::join(inputs, "', '")));
  if (!problems.empty()) throw Error(ErrorCode::kInput, fmt::format("{}", fmt::join(problems, "; ")));
}

}  // namespace covary
