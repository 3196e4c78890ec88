// SPDX-License-Identifier: Apache-2.0
#include "frame_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "batch.h"
#include "core/error.h"
#include "core/number_text.h"
#include "core/printable.h"
#include "core/stopwatch.h"
#include "declared_options.h"
#include "film/image_file.h"
#include "frame_checks.h"
#include "frame_history.h"
#include "imageio/exr_image.h"
#include "motion_checks.h"
#include "numbers.h"
#include "sequences/frame_names.h"
#include "settled_files.h"
#include "usage_error.h"

namespace covary {
namespace {

/// Frames that exist in any of the images, or those asked for.
std::vector<int> frames_of_all(const FrameOptions& o, const FramePatterns& patterns) {
  if (!o.frames.empty()) return frames_of(o.frames, patterns.images[0]);
  std::set<int> frames;
  for (const std::string& pattern : patterns.images)
    for (const int frame : frames_of("", pattern)) frames.insert(frame);
  return {frames.begin(), frames.end()};
}

}  // namespace

void add_frame_options(CLI::App& command, FrameOptions& o, const std::string& what) {
  add_value(command, "--frames", o.frames, "FIRST-LAST", "Only these frames of in_####.exr; default: all");
  add_value(command, "--motion", o.motion.motion, "LAYER", "Layer with the motion to the previous frame")
      ->capture_default_str();
  add_value(command, "--depth", o.motion.depth, "LAYER", "Layer with the depth, if any")->capture_default_str();
  add_value(command, "--motion-scale", o.motion_scale, "X,Y",
            "Factors that turn motion into pixels to the right and down; 1,-1 if Y points up");
  command.add_flag("--resume", o.resume,
                   "Of in_####.exr, skip frames whose output exists, and leave out those whose files are incomplete");
  command.add_flag("--watch", o.watch,
                   "Of in_####.exr, wait for frames and process each when its files are complete, until all of "
                   "--frames are done, --idle or Ctrl-C; denoise: also of folders");
  command.add_option("--idle", o.idle, "With --watch, end after so many seconds without a new frame")
      ->check(positive_number());
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
    if (o.resume) usage("--resume: the input has no '#' for the frame's number");
    if (o.watch) usage("--watch: the input is no folder, and has no '#' for the frame's number");
    if (o.idle) usage("--idle is an option of --watch");
    return false;
  }
  if (o.idle && !o.watch) usage("--idle is an option of --watch");
  for (const std::string& path : patterns.images)
    if (!is_frame_pattern_of_input(path))
      usage(fmt::format("'{}' has no '#' for the frame number, but others do", path));
  if (patterns.output.empty() || !is_frame_pattern(patterns.output))
    usage(fmt::format("-o '{}': for frames, expected a name such as out_####.exr", patterns.output));
  return true;
}

namespace {

/// Runs of consecutive numbers: "1-4, 7".
std::string text_of(const std::vector<int>& numbers) {
  std::vector<std::string> runs;
  for (size_t i = 0, first = 0; i < numbers.size(); ++i)
    if (i + 1 == numbers.size() || numbers[i + 1] != numbers[i] + 1) {
      runs.push_back(first == i ? fmt::to_string(numbers[i]) : fmt::format("{}-{}", numbers[first], numbers[i]));
      first = i + 1;
    }
  return fmt::format("{}", fmt::join(runs, ", "));
}

}  // namespace

void note_gaps(const std::string& pattern, const std::vector<int>& frames) {
  std::vector<int> missing;
  for (size_t i = 1; i < frames.size(); ++i)
    for (int frame = frames[i - 1] + 1; frame < frames[i]; ++frame) missing.push_back(frame);
  if (!missing.empty() && missing.size() < frames.size())
    fmt::print(stderr, "note: '{}' has no frame{} {}\n", pattern, missing.size() == 1 ? "" : "s", text_of(missing));
}

namespace {

/// Tells what a user may not expect: gaps between frames, and files that look like frames but are none.
void note_unexpected(const FrameOptions& o, const std::vector<int>& frames, const FramePatterns& patterns) {
  constexpr size_t kMaxNamed = 3;
  if (o.quiet || !o.frames.empty()) return;
  note_gaps(patterns.images[0], frames);
  for (const std::string& pattern : patterns.images) {
    std::vector<std::string> others;
    frames_on_disk(pattern, &others);
    if (others.empty()) continue;
    const size_t more = others.size() - std::min(others.size(), kMaxNamed);
    others.resize(others.size() - more);
    fmt::print(stderr, "note: {}{} beside '{}' are not its frames: their numbers have another number of digits\n",
               fmt::join(others, ", "), more > 0 ? fmt::format(" and {} more", more) : "", pattern);
  }
}

/// Runs frames, and remembers what became of them.
class Frames {
 public:
  using Run = std::function<std::string(int frame, std::shared_ptr<const History> history)>;

  Frames(const FrameOptions& o, const FramePatterns& patterns, const std::vector<int>& frames, bool has_history,
         const Run& run)
      : o_(o), patterns_(patterns), run_(run), source_(motion_source(o)), history_(o, patterns, frames, has_history) {}

  bool is_there(int frame) const { return std::filesystem::exists(frame_name(patterns_.output, frame)); }

  /// `which`: "frame 3 (3 of 8)". Returns false if the frame failed.
  bool add(int frame, const std::string& which) {
    const bool has_before = history_.motion && last_ == frame - 1;
    if (o_.resume && is_there(frame) && is_whole(frame) && !(has_before && is_outdated(frame))) {
      kept_.push_back(frame);
      last_ = frame;
      return true;
    }
    const bool is_done = attempt(which, o_.quiet, [&] {
      return run_(frame, has_before ? history_of(history_, source_, patterns_, frame) : nullptr);
    });
    if (is_done)
      last_ = frame, ++n_done_;
    else
      last_.reset(), failed_.push_back(frame);
    return is_done;
  }

  /// Frames whose headers do not fit: they failed.
  void add_unfit(const std::vector<int>& frames) { failed_.insert(failed_.end(), frames.begin(), frames.end()); }

  /// The summary; throws Error(kInput) if frames failed, or some are not there because files are not complete.
  void finish(const std::vector<int>& unfinished) {
    std::vector<int> left;
    for (const int frame : unfinished) (o_.resume && is_there(frame) ? kept_ : left).push_back(frame);
    std::ranges::sort(kept_), std::ranges::sort(failed_);
    if (!o_.quiet)
      fmt::print(stderr, "{} in {:.1f} s{}\n", counted(n_done_, "frame"), watch_.seconds(),
                 kept_.empty() ? "" : fmt::format("; {} existed already: {}", kept_.size(), text_of(kept_)));
    const size_t n_all = n_done_ + kept_.size() + failed_.size() + left.size();
    std::vector<std::string> problems;
    if (!failed_.empty())
      problems.push_back(fmt::format("{} of {} failed: {}{}", failed_.size(), counted(n_all, "frame"), text_of(failed_),
                                     o_.watch ? "; --resume tries again" : ""));
    if (!left.empty())
      problems.push_back(fmt::format("{} of {} incomplete: {}; {}", left.size(), counted(n_all, "frame"), text_of(left),
                                     text_of_unfinished(left, patterns_)));
    if (!problems.empty()) throw Error(ErrorCode::kInput, fmt::format("{}", fmt::join(problems, "; ")));
  }

 private:
  /// Whether the result can be read; if it is empty or a damaged EXR file, it is removed. Throws Error(kInput) if it
  /// was made with other settings, or is no EXR file.
  bool is_whole(int frame) const {
    const std::string path = frame_name(patterns_.output, frame);
    if (const std::string damage = damage_of(path); !damage.empty()) {
      if (std::filesystem::file_size(path) > 0 && !is_exr(path)) throw Error(ErrorCode::kInput, damage);
      fmt::print(stderr, "warning: {}; it is made again\n", printable(damage));
      std::filesystem::remove(path);
      return false;
    }
    const ImageInfo image = inspect_image(path);
    if (!(image.place == inspect_image(frame_name(patterns_.images[0], frame)).place)) {
      fmt::print(stderr, "note: '{}' has another size than its renders; it is made again\n", printable(path));
      return false;
    }
    const std::map<std::string, std::string>& attributes = image.attributes;
    const auto found = attributes.find("covary:estimator");
    if (found == attributes.end() || found->second == patterns_.made_by) return true;
    throw Error(
        ErrorCode::kInput,
        fmt::format("--resume: '{}' was made by '{}', and not by {}; --overwrite instead of --resume replaces it", path,
                    found->second, patterns_.made_by.empty() ? "the network alone" : "'" + patterns_.made_by + "'"));
  }

  bool is_outdated(int frame) const {
    const std::string why = outdated(patterns_, frame);
    if (!why.empty() && !o_.quiet) fmt::print(stderr, "note: {}; it is made again\n", why);
    return !why.empty();
  }

  const FrameOptions& o_;
  const FramePatterns& patterns_;
  const Run& run_;
  const MotionSource source_;
  const HistorySource history_;
  const Stopwatch watch_;
  std::optional<int> last_;  // the frame before, if it succeeded
  size_t n_done_ = 0;
  std::vector<int> failed_, kept_;
};

/// Frames of files that a farm is writing.
class WatchedFrames {
 public:
  WatchedFrames(const FrameOptions& o, const FramePatterns& patterns) : patterns_(patterns), source_(motion_source(o)) {
    if (!o.frames.empty()) wanted_ = frames_of(o.frames, patterns.images[0]);
  }

  bool are_all_done() const { return !wanted_.empty() && done_.size() == wanted_.size(); }

  /// The frames that have become ready: all of their files are there and settled. With `in_order`, frames with motion
  /// wait for the frame before, which is their history.
  std::vector<int> next(bool in_order) {
    std::vector<int> ready;
    const std::vector<int> frames = wanted_.empty() ? frames_on_disk(patterns_.images[0]) : wanted_;
    for (const int frame : frames) {
      if (done_.contains(frame)) continue;
      size_t n = 0;  // of all files, so that each begins to settle
      for (const std::string& pattern : patterns_.images) n += files_.is_settled(frame_name(pattern, frame));
      if (n < patterns_.images.size()) continue;
      const bool follows = std::ranges::find(frames, frame - 1) != frames.end() && !done_.contains(frame - 1);
      if (in_order && follows && motion_pattern(source_, patterns_, frame)) continue;
      done_.insert(frame), ready.push_back(frame);
    }
    return ready;
  }

  /// Frames with files that are missing or incomplete.
  std::vector<int> unfinished() const {
    std::vector<int> left;
    for (const int frame : wanted_.empty() ? frames_on_disk(patterns_.images[0]) : wanted_)
      if (!done_.contains(frame)) left.push_back(frame);
    return left;
  }

 private:
  const FramePatterns& patterns_;
  const MotionSource source_;
  std::vector<int> wanted_;
  std::set<int> done_;
  SettledFiles files_;
};

/// Waits for frames and runs those that are ready and not done, until all of --frames are, or nothing comes any more.
void watch_frames(const FrameOptions& o, const FramePatterns& patterns, bool has_history, const Frames::Run& run) {
  WatchedFrames watched(o, patterns);
  std::optional<Frames> frames;
  if (!o.quiet)
    fmt::print(stderr, "waiting for frames '{}'; Ctrl-C{} ends, and --resume continues\n", patterns.images[0],
               o.idle ? fmt::format(", or {:g} s without a new frame,", *o.idle) : "");
  const auto run_ready = [&](bool in_order) {
    const std::vector<int> ready = watched.next(in_order);
    for (const int frame : ready) {
      if (!frames) frames.emplace(o, patterns, std::vector{frame, frame + 1}, has_history, run);
      frames->add(frame, fmt::format("frame {}", frame));
    }
    return ready.empty() ? Found::kNothing : Found::kWork;
  };
  const bool in_order = has_history && !o.no_history;
  poll(o.idle, [&] { return watched.are_all_done() ? Found::kEnd : run_ready(in_order); });
  if (in_order) run_ready(false);  // those that waited for a frame in vain
  if (!frames) frames.emplace(o, patterns, std::vector<int>(), has_history, run);
  frames->finish(watched.unfinished());
}

}  // namespace

void for_each_frame(const FrameOptions& o, const FramePatterns& patterns, bool has_history,
                    const std::function<std::string(int frame, std::shared_ptr<const History> history)>& run) {
  if (o.watch) return watch_frames(o, patterns, has_history, run);
  std::vector<int> numbers = frames_of_all(o, patterns);
  note_unexpected(o, numbers, patterns);
  const std::vector<int> left = o.resume ? take_unfinished(numbers, patterns) : std::vector<int>();
  const std::vector<int> unfit = take_unfit(o, numbers, patterns);
  Frames frames(o, patterns, numbers, has_history, run);
  frames.add_unfit(unfit);
  for (size_t i = 0; i < numbers.size(); ++i)
    frames.add(numbers[i], fmt::format("frame {} ({} of {})", numbers[i], i + 1, numbers.size()));
  frames.finish(left);
}

}  // namespace covary
