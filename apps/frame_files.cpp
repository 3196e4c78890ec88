// SPDX-License-Identifier: Apache-2.0
#include "frame_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <string_view>

#include "combine/grouped_file.h"
#include "combine/grouped_source.h"
#include "core/error.h"
#include "core/number_text.h"
#include "declared_options.h"
#include "estimators/mean.h"
#include "film/image_file.h"
#include "sequences/frame_names.h"

namespace covary {
namespace {

[[noreturn]] void usage(const std::string& message) { throw Error(ErrorCode::kUsage, message); }

/// A fault of the whole sequence, not of one frame.
class WrongSequence : public Error {
 public:
  explicit WrongSequence(const std::string& message) : Error(ErrorCode::kInput, message) {}
};

/// If the motion does not match, the signs of another convention with which it does; nullopt if there are none.
std::optional<std::array<float, 2>> better_signs(const Image& before, const Image& now, const MotionLayers& motion,
                                                 double fit) {
  constexpr double kClearly = 0.95;
  std::optional<std::array<float, 2>> best;
  for (const std::array<float, 2> signs : {std::array{-1.0f, -1.0f}, {1.0f, -1.0f}, {-1.0f, 1.0f}}) {
    MotionLayers turned = motion;
    for (size_t i = 0; i < turned.motion.data.size(); ++i)
      if (i % 3 < 2) turned.motion.data[i] *= signs[i % 3];
    const double fit_of_turned = misfit(before, now, turned);
    if (fit_of_turned < kClearly * fit) fit = fit_of_turned / kClearly, best = signs;
  }
  return best;
}

/// Motion that explains less of the changes than no motion, or than motion with other signs, is wrong. (Warping a noisy
/// image by fractions of pixels smooths it, so any motion may fit better than none.)
void check_motion(const std::string& before, const std::string& now, const std::string& layer,
                  const MotionLayers& motion) {
  const auto picture = [&](const std::string& path) {
    const GroupedFile file({path}, layer);
    const GroupedSource source = source_of(file);
    return mean_of_groups(source.all()).estimate;
  };
  const Image image_before = picture(before), image_now = picture(now);
  const double fit = misfit(image_before, image_now, motion);
  const std::optional<std::array<float, 2>> signs = better_signs(image_before, image_now, motion, fit);
  if (fit <= 1 && !signs) return;
  const std::string instead =
      signs ? fmt::format("; multiplied by {},{} (--motion-scale) it fits better", (*signs)[0], (*signs)[1]) : "";
  throw WrongSequence(
      fmt::format("'{}': its motion does not match '{}': after warping, the difference is {:.2f} times that "
                  "without motion{}. Expected are pixels to the right and down, from a pixel to its point's "
                  "position in the previous frame; see --motion-scale, or --no-history",
                  now, before, fit, instead));
}

/// Frames with the same seed share errors, which held-out samples cannot reveal.
void check_seeds(const std::string& before, const std::string& now) {
  const auto seed = [](const std::string& path) {
    const auto attributes = inspect_image(path).attributes;
    const auto found = attributes.find("covary:seed");
    return found == attributes.end() ? std::string() : found->second;
  };
  const std::string own = seed(now);
  if (!own.empty() && own == seed(before))
    throw WrongSequence(
        fmt::format("'{}' and '{}' have the same seed, {}; each frame needs its own seed, "
                    "or --no-history",
                    before, now, own));
}

MotionSource motion_source(const FrameOptions& o) {
  MotionSource source = o.motion;
  if (o.motion_scale.empty()) return source;
  const std::string_view text = o.motion_scale;
  const size_t comma = std::min(text.find(','), text.size());
  const auto x = parse_real(text.substr(0, comma)), y = parse_real(text.substr(std::min(comma + 1, text.size())));
  if (!x || !y) usage(fmt::format("--motion-scale '{}': expected X,Y, e.g. 1,-1", o.motion_scale));
  source.scale_x = static_cast<float>(*x), source.scale_y = static_cast<float>(*y);
  return source;
}

/// The pattern of the files that contain motion; nullopt if none does, and the user did not name its layer.
std::optional<std::string> motion_pattern(const MotionSource& source, const FramePatterns& patterns, int frame) {
  std::vector<std::string> all = patterns.images;
  all.insert(all.end(), patterns.others.begin(), patterns.others.end());
  for (const std::string& pattern : all)
    if (is_frame_pattern_of_input(pattern) && has_motion(frame_name(pattern, frame), source)) return pattern;
  if (source.motion == MotionSource().motion) return std::nullopt;
  return patterns.images[0];  // whose layers the error then lists
}

/// Frames that exist in any of the images, or those asked for.
std::vector<int> frames_of_all(const FrameOptions& o, const FramePatterns& patterns) {
  if (!o.frames.empty()) return frames_of(o.frames, patterns.images[0]);
  std::set<int> frames;
  for (const std::string& pattern : patterns.images)
    for (const int frame : frames_of("", pattern)) frames.insert(frame);
  return {frames.begin(), frames.end()};
}

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
          return fmt::format("'{}': the channel {} is {}", path, channel.name,
                             b == &info ? "missing, which the first frame has" : "not in the first frame");
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

/// Reads the headers of all files before the first frame is spent. Throws Error(kInput) naming the first problems.
void check_frames(const std::vector<int>& frames, const FramePatterns& patterns) {
  constexpr size_t kMostNamed = 5;
  std::vector<std::string> all = patterns.images, problems;
  for (const std::string& other : patterns.others)
    if (!other.empty() && is_frame_pattern_of_input(other)) all.push_back(other);
  for (const std::string& pattern : all) {
    std::optional<ImageInfo> first;
    for (const int frame : frames)
      if (std::string problem = problem_of(frame_name(pattern, frame), first); !problem.empty())
        problems.push_back(std::move(problem));
  }
  if (problems.empty()) return;
  const size_t more = problems.size() - std::min(problems.size(), kMostNamed);
  problems.resize(problems.size() - more);
  throw Error(ErrorCode::kInput,
              fmt::format("{}{}; nothing was written", fmt::join(problems, "; "),
                          more > 0 ? fmt::format("; and {} more problems of frames", more) : std::string()));
}

}  // namespace

void add_frame_options(CLI::App& command, FrameOptions& o, const std::string& what) {
  add_value(command, "--frames", o.frames, "FIRST-LAST", "Only these frames of in_####.exr; default: all");
  add_value(command, "--motion", o.motion.motion, "LAYER", "Layer with the motion to the previous frame")
      ->capture_default_str();
  add_value(command, "--depth", o.motion.depth, "LAYER", "Layer with the depth, if any")->capture_default_str();
  add_value(command, "--motion-scale", o.motion_scale, "X,Y",
            "Factors that turn motion into pixels to the right and down; 1,-1 if Y points up");
  command.add_flag("--no-history", o.no_history, what + " each frame alone");
}

std::vector<int> frames_of(const std::string& text, const std::string& pattern) {
  if (text.empty()) {
    const std::vector<int> frames = frames_on_disk(pattern);
    if (frames.empty()) throw Error(ErrorCode::kInput, fmt::format("there are no frames '{}'", pattern));
    return frames;
  }
  FrameRange range;
  if (!read_frame_range(text, range))
    usage(fmt::format("--frames '{}': expected FIRST-LAST[:STEP] or one number, e.g. 1-48", text));
  return range.numbers();
}

std::string file_of_frame(const std::string& path, int frame) {
  return is_frame_pattern_of_input(path) ? frame_name(path, frame) : path;
}

bool are_frames(const FrameOptions& o, const FramePatterns& patterns) {
  motion_source(o);  // reports an invalid --motion-scale before any file is read
  if (patterns.images.empty() || !is_frame_pattern_of_input(patterns.images[0])) {
    if (!o.frames.empty()) usage("--frames: the input has no '#' for the frame's number");
    return false;
  }
  for (const std::string& path : patterns.images)
    if (!is_frame_pattern_of_input(path))
      usage(fmt::format("'{}' has no '#' for the frame number, but others do", path));
  if (patterns.output.empty() || !is_frame_pattern(patterns.output))
    usage(fmt::format("-o '{}': for frames, expected a name such as out_####.exr", patterns.output));
  return true;
}

void for_each_frame(const FrameOptions& o, const FramePatterns& patterns, bool has_history,
                    const std::function<void(int frame, std::shared_ptr<const History> history)>& run) {
  const MotionSource source = motion_source(o);
  const std::string& images = patterns.images[0];
  const std::vector<int> frames = frames_of_all(o, patterns);
  check_frames(frames, patterns);
  const bool wants_history = has_history && !o.no_history && frames.size() > 1;
  const std::optional<std::string> motion = wants_history ? motion_pattern(source, patterns, frames[0]) : std::nullopt;
  if (wants_history && !motion)
    fmt::print(stderr, "note: the frames have no layer '{}' (--motion); each is treated alone, without history\n",
               source.motion);
  std::optional<int> last;  // the frame before, if it succeeded
  std::vector<int> failed;
  for (const int frame : frames) {
    try {
      std::shared_ptr<const History> history;
      if (motion && last == frame - 1) {
        const std::string before = frame_name(images, *last), now = frame_name(images, frame);
        const MotionLayers layers = read_motion(frame_name(*motion, frame), source);
        const MotionLayers old = read_motion(frame_name(*motion, *last), source);
        check_seeds(before, now);
        check_motion(before, now, patterns.layer, layers);
        const PlacedImage earlier =
            read_image(frame_name(patterns.output, *last), patterns.layer, ChecksumPolicy::kCheck, std::nullopt);
        history = std::make_shared<History>(reproject(earlier.image, old.depth, layers));
      }
      run(frame, std::move(history));
      last = frame;
    } catch (const WrongSequence&) {
      throw;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kInput || frames.size() == 1) throw;
      fmt::print(stderr, "warning: frame {} failed: {}\n", frame, error.what());
      failed.push_back(frame);
      last.reset();
    }
  }
  if (!failed.empty())
    throw Error(ErrorCode::kInput,
                fmt::format("{} of {} frames failed: {}", failed.size(), frames.size(), fmt::join(failed, ", ")));
}

}  // namespace covary
