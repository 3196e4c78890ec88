// SPDX-License-Identifier: Apache-2.0
#include "frame_checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
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

void warn_of_unfinished(const std::vector<std::string>& inputs) {
  for (const std::string& path : inputs)
    if (is_unfinished(inspect_image(path)))
      fmt::print(stderr, "warning: {}: the render was interrupted; the same `covary render` with --resume ends it\n",
                 printable(path));
}

namespace {

/// Whether nothing more will be written to the file, as far as can be told: a file of another format is not waited for.
bool is_finished(const std::string& path) {
  std::error_code ignored;
  const bool has_content = std::filesystem::file_size(path, ignored) > 0 && !ignored;
  return is_finished_exr(path) || (has_content && !is_exr(path));
}

/// The header of a frame's file, or why it cannot be read.
struct Header {
  int frame = 0;
  ImageInfo info;
  std::string problem;
};

Header header_of(int frame, const std::string& path) {
  try {
    Header header{frame, inspect_image(path), ""};
    if (!is_finished(path)) header.problem = fmt::format("'{}' is cut off, or still being written", path);
    return header;
  } catch (const Error& error) {
    return {frame, {}, error.what()};
  }
}

std::string text_of(const ImagePlace& place) {
  const CropWindow& window = place.window;
  const std::string frame = fmt::format(" of {} x {}", place.frame_width, place.frame_height);
  return fmt::format("{} x {} pixels at ({}, {}){}", window.width, window.height, window.x, window.y,
                     place.frame_width == window.width && place.frame_height == window.height ? "" : frame);
}

/// The first frame with the pixels that most have; null if none can be read.
const Header* usual_of(const std::vector<Header>& headers) {
  std::map<std::string, int> counts;
  const Header* usual = nullptr;
  for (const Header& header : headers)
    if (header.problem.empty()) ++counts[text_of(header.info.place)];
  for (const Header& header : headers)
    if (header.problem.empty() && (!usual || counts[text_of(header.info.place)] > counts[text_of(usual->info.place)]))
      usual = &header;
  return usual;
}

/// What is wrong with a frame; "" if nothing is.
std::string problem_of(const std::string& path, const Header& header, const Header& usual) {
  if (!header.problem.empty()) return header.problem;
  const ImageInfo &info = header.info, &other = usual.info;
  if (!(info.place == other.place))
    return fmt::format("'{}' has {}, frame {} has {}", path, text_of(info.place), usual.frame, text_of(other.place));
  for (const auto& [a, b] : {std::pair{&other, &info}, {&info, &other}})
    for (const ExrFile::Channel& channel : a->channels)
      if (std::none_of(b->channels.begin(), b->channels.end(), [&](const auto& c) { return c.name == channel.name; }))
        return fmt::format("'{}': the channel {} is {} frame {}{}", path, channel.name,
                           b == &info ? "missing, which is in" : "not in", usual.frame,
                           is_unfinished(info) ? "; the frame is unfinished, and `covary render … --resume` ends it"
                           : is_unfinished(other) ? ", which is unfinished; `covary render … --resume` ends it"
                                                  : "");
  return "";
}

}  // namespace

std::vector<std::string> read_patterns(const FramePatterns& patterns) {
  std::vector<std::string> all = patterns.images;
  for (const std::string& other : patterns.others)
    if (!other.empty() && is_frame_pattern_of_input(other)) all.push_back(other);
  return all;
}

std::string text_of_unfinished(const std::vector<int>& frames, const FramePatterns& patterns) {
  constexpr size_t kMaxNamed = 5;
  std::vector<std::string> all;
  for (const int frame : frames)
    for (const std::string& pattern : read_patterns(patterns)) {
      const std::string path = frame_name(pattern, frame);
      if (!is_finished(path)) all.push_back(path + (std::filesystem::exists(path) ? " is unfinished" : " is missing"));
    }
  const size_t more = all.size() - std::min(all.size(), kMaxNamed);
  all.resize(all.size() - more);
  return fmt::format("{}{}", fmt::join(all, ", "), more > 0 ? fmt::format(", and {} more", more) : "");
}

std::vector<int> take_unfinished(std::vector<int>& frames, const FramePatterns& patterns) {
  const std::vector<std::string> all = read_patterns(patterns);
  const auto unfinished = std::ranges::stable_partition(frames, [&](int frame) {
    return std::ranges::all_of(all,
                               [&](const std::string& pattern) { return is_finished(frame_name(pattern, frame)); });
  });
  std::vector<int> left(unfinished.begin(), unfinished.end());
  frames.erase(unfinished.begin(), unfinished.end());
  return left;
}

namespace {

/// What is wrong with the headers of all files, by frames.
std::map<int, std::vector<std::string>> problems_of(const std::vector<int>& frames, const FramePatterns& patterns) {
  std::map<int, std::vector<std::string>> problems;
  for (const std::string& pattern : read_patterns(patterns)) {
    std::vector<Header> headers;
    for (const int frame : frames) headers.push_back(header_of(frame, frame_name(pattern, frame)));
    const Header* const usual = usual_of(headers);
    for (const Header& header : headers)
      if (std::string problem = usual ? problem_of(frame_name(pattern, header.frame), header, *usual) : header.problem;
          !problem.empty())
        problems[header.frame].push_back(std::move(problem));
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
