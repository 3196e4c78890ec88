// SPDX-License-Identifier: Apache-2.0
#include "frame_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
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
  throw Error(ErrorCode::kInput,
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
    throw Error(ErrorCode::kInput, fmt::format("'{}' and '{}' have the same seed, {}; each frame needs its own seed, "
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

/// The pattern of the files that contain motion; if none does, the first, whose channels the error then lists.
std::string motion_pattern(const MotionSource& source, const FramePatterns& patterns, int frame) {
  std::vector<std::string> all = patterns.images;
  all.insert(all.end(), patterns.others.begin(), patterns.others.end());
  for (const std::string& pattern : all)
    if (is_frame_pattern_of_input(pattern) && has_motion(frame_name(pattern, frame), source)) return pattern;
  return patterns.images[0];
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
  std::optional<int> last;
  for (const int frame : frames_of(o.frames, images)) {
    std::shared_ptr<const History> history;
    if (has_history && !o.no_history && last == frame - 1) {
      const std::string motion = motion_pattern(source, patterns, frame);
      const std::string before = frame_name(images, *last), now = frame_name(images, frame);
      const MotionLayers layers = read_motion(frame_name(motion, frame), source);
      const MotionLayers old = read_motion(frame_name(motion, *last), source);
      check_seeds(before, now);
      check_motion(before, now, patterns.layer, layers);
      history =
          std::make_shared<History>(reproject(read_image(frame_name(patterns.output, *last)).image, old.depth, layers));
    }
    run(frame, std::move(history));
    last = frame;
  }
}

}  // namespace covary
