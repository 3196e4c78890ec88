// SPDX-License-Identifier: Apache-2.0
#include "sequences/frame_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <regex>
#include <string_view>
#include <system_error>

#include "core/error.h"
#include "core/number_text.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

constexpr int kLastFrame = 999'999;

std::optional<int> frame_number(const std::string& text) {
  if (text.empty() || text.size() > 6 || text.find_first_not_of("0123456789") != std::string::npos) return {};
  return std::stoi(text);
}

/// A pattern split at the place of the frame's number.
struct Parts {
  std::string before, after;
  size_t digits = 0;
};

/// The last run of '#', or else %04d or <frame>; none if the name has no such place.
std::optional<Parts> find_parts(const std::string& pattern) {
  if (const size_t last = pattern.rfind('#'); last != std::string::npos) {
    size_t first = last;
    while (first > 0 && pattern[first - 1] == '#') --first;
    return Parts{pattern.substr(0, first), pattern.substr(last + 1), last + 1 - first};
  }
  static const std::regex others(R"(^([\s\S]*)(%(0([1-6]))?d|<[Ff][Rr][Aa][Mm][Ee]>)([\s\S]*)$)");
  std::smatch found;
  if (!std::regex_match(pattern, found, others)) return std::nullopt;
  constexpr size_t kDigitsOfFrame = 4;  // of <frame>, as Maya pads by default
  const size_t digits = found[4].matched ? std::stoul(found[4]) : found[2].str()[0] == '%' ? 1 : kDigitsOfFrame;
  return Parts{found[1], found[5], digits};
}

Parts parts_of(const std::string& pattern) {
  if (const std::optional<Parts> parts = find_parts(pattern)) return *parts;
  throw Error(ErrorCode::kUsage, fmt::format("'{}': expected a name with '#' for the frame number, e.g. "
                                             "out_####.exr, out_%04d.exr or out_<frame>.exr",
                                             pattern));
}

}  // namespace

std::vector<int> FrameRange::numbers() const {
  std::vector<int> all;
  for (int frame = first; frame <= last; frame += step) all.push_back(frame);
  return all;
}

bool read_frame_range(const std::string& text, FrameRange& range) {
  const size_t colon = text.find(':'), dash = text.find('-');
  const std::string frames = text.substr(0, colon);
  const std::optional<int> step = colon == std::string::npos ? 1 : frame_number(text.substr(colon + 1));
  const std::optional<int> first = frame_number(frames.substr(0, dash));
  const std::optional<int> last = dash == std::string::npos ? first : frame_number(frames.substr(dash + 1));
  if (!first || !last || !step || *step < 1 || *last < *first) return false;
  range = {*first, *last, *step};
  return true;
}

bool is_frame_pattern(const std::string& pattern) {
  return find_parts(fs::path(pattern).filename().string()).has_value();
}

bool is_frame_pattern_of_input(const std::string& pattern) {
  if (!find_parts(pattern)) return false;
  if (pattern.find('#') != std::string::npos && is_frame_pattern(pattern)) return true;
  std::error_code ignored;
  return !fs::exists(pattern, ignored);
}

std::string frame_name(const std::string& pattern, int frame) {
  const Parts parts = parts_of(pattern);
  return fmt::format("{}{:0{}}{}", parts.before, frame, parts.digits, parts.after);
}

std::vector<int> frames_on_disk(const std::string& pattern, std::vector<std::string>* others) {
  parts_of(pattern);                   // throws if there is no place for the number
  fs::path head = pattern, in_folder;  // up to the component with the number, and the rest
  for (; !is_frame_pattern(head.string()); head = head.parent_path())
    in_folder = in_folder.empty() ? head.filename() : head.filename() / in_folder;
  const Parts parts = parts_of(head.filename().string());
  const fs::path folder = head.parent_path();
  std::error_code error;
  std::vector<int> frames;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= parts.before.size() + parts.after.size() || !name.starts_with(parts.before) ||
        !name.ends_with(parts.after))
      continue;
    const std::string digits = name.substr(parts.before.size(), name.size() - parts.before.size() - parts.after.size());
    const std::optional<int> frame = frame_number(digits);
    // Only names that frame_name() gives: "out_7.exr" is not a frame of "out_####.exr".
    if (frame && *frame <= kLastFrame && digits == fmt::format("{:0{}}", *frame, parts.digits)) {
      if (in_folder.empty() || fs::exists(entry.path() / in_folder)) frames.push_back(*frame);
    } else if (others && digits.find_first_not_of("-0123456789") == std::string::npos) {
      others->push_back(name);
    }
  }
  if (error) throw Error(ErrorCode::kIo, fmt::format("cannot read the folder of '{}': {}", pattern, error.message()));
  std::sort(frames.begin(), frames.end());
  if (others) std::sort(others->begin(), others->end());
  return frames;
}

}  // namespace covary
