// SPDX-License-Identifier: Apache-2.0
#include "frame_checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/printable.h"
#include "film/film.h"
#include "film/image_file.h"
#include "imageio/exr_image.h"
#include "sequences/frame_names.h"
#include "settled_files.h"

namespace covary {

bool is_unfinished(const ImageInfo& image) {
  const auto found = image.attributes.find(std::string("covary:") + film_key::kComplete);
  return found != image.attributes.end() && found->second == "false";
}

namespace {

/// What is wrong with the header of a frame; `first`: that of the sequence's first frame, if it was read.
std::string problem_of(const std::string& path, std::optional<ImageInfo>& first) {
  try {
    ImageInfo info = inspect_image(path);
    if (!first) {
      first = std::move(info);
      return "";
    }
    const CropWindow &here = info.place.window, &there = first->place.window;
    if (!(info.place == first->place))
      return fmt::format("'{}' has {} x {} pixels at ({}, {}), the first frame {} x {} at ({}, {})", path, here.width,
                         here.height, here.x, here.y, there.width, there.height, there.x, there.y);
    for (const auto& [a, b] : {std::pair{&*first, &info}, {&info, &*first}})
      for (const ExrFile::Channel& channel : a->channels)
        if (std::none_of(b->channels.begin(), b->channels.end(), [&](const auto& c) { return c.name == channel.name; }))
          return fmt::format("'{}': the channel {} is {}{}", path, channel.name,
                             b == &info ? "missing, which the first frame has" : "not in the first frame",
                             is_unfinished(info) ? "; the frame is unfinished, and `covary render … --resume` ends it"
                             : is_unfinished(*first) ? ", which is unfinished; `covary render … --resume` ends it"
                                                     : "");
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

/// Whether nothing more will be written to the file, as far as can be told: a file of another format is not waited for.
bool is_finished(const std::string& path) {
  std::error_code ignored;
  const bool has_content = std::filesystem::file_size(path, ignored) > 0 && !ignored;
  return is_finished_exr(path) || (has_content && !is_exr(path));
}

}  // namespace

std::vector<std::string> read_patterns(const FramePatterns& patterns) {
  std::vector<std::string> all = patterns.images;
  for (const std::string& other : patterns.others)
    if (!other.empty() && is_frame_pattern_of_input(other)) all.push_back(other);
  return all;
}

std::vector<int> take_unfinished(std::vector<int>& frames, const FramePatterns& patterns) {
  const std::vector<std::string> all = read_patterns(patterns);
  std::vector<int> finished, left;
  for (const int frame : frames)
    (std::ranges::all_of(all, [&](const std::string& p) { return is_finished(frame_name(p, frame)); }) ? finished
                                                                                                       : left)
        .push_back(frame);
  frames = std::move(finished);
  return left;
}

namespace {

/// What is wrong with the headers of all files, by frames.
std::map<int, std::vector<std::string>> problems_of(const std::vector<int>& frames, const FramePatterns& patterns) {
  std::map<int, std::vector<std::string>> problems;
  for (const std::string& pattern : read_patterns(patterns)) {
    std::optional<ImageInfo> first;
    for (const int frame : frames)
      if (std::string problem = problem_of(frame_name(pattern, frame), first); !problem.empty())
        problems[frame].push_back(std::move(problem));
  }
  return problems;
}

}  // namespace

std::vector<int> take_unfit(const FrameOptions& o, std::vector<int>& frames, const FramePatterns& patterns) {
  constexpr size_t kMaxNamed = 5;
  const std::map<int, std::vector<std::string>> problems = problems_of(frames, patterns);
  std::vector<int> unfit;
  std::vector<std::string> all;
  for (const auto& [frame, some] : problems) {
    unfit.push_back(frame);
    all.insert(all.end(), some.begin(), some.end());
  }
  if (unfit.empty()) return unfit;
  if (!o.resume || 2 * unfit.size() > frames.size()) {
    const size_t n_named = std::min(all.size(), kMaxNamed);
    throw Error(ErrorCode::kInput,
                fmt::format("{}{}; nothing was written. --resume leaves out such frames, and those whose files are "
                            "missing or unfinished; --frames takes others",
                            fmt::join(all.begin(), all.begin() + n_named, "; "),
                            all.size() > n_named ? fmt::format("; and {} more problems of frames", all.size() - n_named)
                                                 : std::string()));
  }
  for (const auto& [frame, some] : problems)
    fmt::print(stderr, "warning: frame {} is left out: {}\n", frame,
               printable(fmt::format("{}", fmt::join(some, "; "))));
  std::erase_if(frames, [&](int frame) { return problems.contains(frame); });
  return unfit;
}

}  // namespace covary
