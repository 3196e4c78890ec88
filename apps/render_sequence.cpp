// SPDX-License-Identifier: Apache-2.0
#include "render_steps.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <span>
#include <utility>
#include <vector>

#include "commands.h"
#include "core/content_hash.h"
#include "core/error.h"
#include "core/stopwatch.h"
#include "core/unfinished.h"
#include "denoising/mixed_denoising.h"
#include "film/image_file.h"
#include "io/scene_formats.h"
#include "passes/motion.h"
#include "plans/budget.h"
#include "plans/camera_path.h"
#include "plans/made_of.h"
#include "plans/pass_files.h"
#include "sequences/feature_slopes.h"
#include "sequences/reprojection.h"
#include "settled_files.h"
#include "usage_error.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

void check(const RenderOptions& options) {
  const RenderRequest& request = options.request();
  for (const auto& [name, given] :
       {std::pair{"--save-stages", !options.stages.empty()}, {"--save-training", !request.save_training.empty()}})
    if (given) usage(fmt::format("{} is an option of single images, not of --frames", name));
  const DenoisingChoice& denoising = options.settings.denoising;
  if (options.sequence.history && (!denoising.denoises() || request.splits_layers()))
    usage("--history is for frames with --denoise, and without --layers");
  if (options.sequence.history && options.sequence.frames->step != 1)
    usage("--history has no effect with a step in --frames: it is that of the frame just before");
  if (options.sequence.history && request.spp && *request.spp < kMinMixedSamples)
    usage(fmt::format(
        "--history has no effect with fewer than {} samples per pixel (--spp {}), which do not tell where it "
        "is right",
        kMinMixedSamples, *request.spp));
  for (const auto& [name, path] :
       {std::pair{"-o", request.output}, {"--passes", request.passes}, {"--json", options.json}})
    if (!path.empty() && !is_frame_pattern(path))
      usage(fmt::format("{} '{}': with --frames, expected a name with '#' for the frame number, e.g. {}", name, path,
                        std::string(name) == "-o" ? "out_####.exr" : "out_####"));
}

/// The options of a single frame.
RenderOptions frame_options(const RenderOptions& options, int frame) {
  RenderOptions one = options;
  RenderRequest& request = one.settings.request;
  if (is_frame_pattern(one.scene)) one.scene = frame_name(one.scene, frame);
  for (std::string* path : {&request.output, &request.passes, &one.json})
    if (!path->empty()) *path = frame_name(*path, frame);
  request.seed += SequenceSettings::seed_offset(frame);
  one.values["seed"] = std::to_string(request.seed);
  one.sequence.frames = FrameRange{frame, frame, 1};
  return one;
}

/// Everything that the frame's image depends on: scene and camera, previous camera, seed and settings; with a history,
/// also `earlier`, the same of the previous frame.
std::string frame_made_of(const RenderOptions& one, const LoadedScene& scene, const Transform& now,
                          const Transform& before, const std::string& earlier) {
  std::string cameras;
  for (const Transform* camera : {&now, &before})
    for (const auto& row : camera->matrix()) cameras += fmt::format(" {}", fmt::join(row, " "));
  OptionValues of_frame = {{kMadeAtPlace, hash_text(hash_bytes(cameras))}};
  if (scene.scene->moves()) of_frame[kMadeAtTime] = fmt::format("{:.9g}", scene.scene->time());
  if (one.sequence.history) of_frame["history"] = "on", of_frame[kMadeAfter] = hash_text(hash_bytes(earlier));
  const int frame = one.sequence.frames->first;
  of_frame["seed"] = std::to_string(one.request().seed - SequenceSettings::seed_offset(frame));  // as in the command
  return made_of(one, scene, of_frame);
}

/// Whether the file is the complete frame. Throws if it is a complete image of something else.
bool is_complete(const std::string& path, const std::string& made_of, double until) {
  if (!fs::exists(path)) return false;
  const MadeFile file = made_file(path);
  if (!file.complete) return false;
  const std::string& earlier = file.made_of;
  const std::string differ = earlier.empty() ? "no record of its settings" : differences(earlier, made_of);
  if (differ.empty() || reaches(file, made_of, until)) return true;
  const bool is_history = differ == fmt::format("another {}", kMadeAfter);
  throw Error(ErrorCode::kInput,
              fmt::format("--resume: '{}' is not a frame of this command ({}{}); --overwrite instead of --resume "
                          "replaces it",
                          path, differ, is_history ? ": it was rendered with another range of --frames" : ""));
}

/// Removes what a full disk or a killed copy left of a frame.
void remove_empty(const std::string& path) {
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored) && fs::file_size(path, ignored) == 0 && !ignored) fs::remove(path, ignored);
}

constexpr double kRateInSeconds = 24;  // of formats whose animations are in seconds

/// The times of frames, and the camera's place at each.
class FrameTimes {
 public:
  FrameTimes() = default;
  explicit FrameTimes(const RenderOptions& options) {
    const SequenceSettings& sequence = options.sequence;
    if (!sequence.camera_path.empty()) path_ = read_camera_path(sequence.camera_path);
    rate_ = sequence.frames_per_second > 0                    ? sequence.frames_per_second
            : path_                                           ? path_->frames_per_second()
            : scene_format_of(options.scene).moves_in_seconds ? kRateInSeconds
                                                              : 1;
  }

  double time(int frame) const { return frame / rate_; }
  /// The camera's place on the path, or by the scene's animation; nullopt if neither moves it.
  std::optional<Transform> camera(const LoadedScene& scene, int frame) const {
    if (path_) return path_->at(time(frame));
    if (scene.camera_to_world) return scene.camera_to_world->at(time(frame));
    return std::nullopt;
  }
  /// What to tell if the path's keys are all before or after the frames; "" otherwise.
  std::string standstill(const std::vector<int>& frames) const {
    if (!path_ || frames.size() < 2 || path_->first_time() == path_->last_time()) return "";
    const double first = time(frames.front()), last = time(frames.back());
    if (last > path_->first_time() && first < path_->last_time()) return "";
    return fmt::format(
        "the camera stands still: the frames are at times {:g} to {:g}, at {:g} per unit of time (--fps), "
        "and the path's keys at {:g} to {:g}",
        first, last, rate_, path_->first_time(), path_->last_time());
  }
  /// Moves everything to its place in the frame.
  void place(int frame, const Transform& camera, LoadedScene& scene) const {
    scene.scene->move_to(time(frame));
    try {
      place_camera(scene, camera);
    } catch (const Error& error) {
      throw Error(ErrorCode::kInput, fmt::format("the camera of frame {}: {}", frame, error.what()));
    }
  }

 private:
  std::optional<CameraPath> path_;
  double rate_ = 1;
};

bool is_framed(const LoadedScene& scene) { return std::ranges::count(scene.added, scene.sensor) > 0; }

/// Where the camera stands if nothing moves it. If the file has none, it is framed as in frame 0, whichever frames are
/// rendered, so that commands for different frames agree.
Transform own_camera(const RenderOptions& one, const LoadedScene& scene) {
  constexpr int kFramedIn = 0;
  if (!scene.is_animated || !is_framed(scene) || one.sequence.frames->first == kFramedIn)
    return scene.camera->settings().to_world;
  RenderOptions framed = one;
  framed.sequence.frames = FrameRange{kFramedIn, kFramedIn, 1};
  return load(framed).camera->settings().to_world;
}

/// Traces the frame's motion layers; `before` is the previous camera transformation, at time `then`.
void trace_motion(const Transform& before, double then, const LoadedScene& scene, RenderRequest& request) {
  CameraSettings settings = scene.camera->settings();
  settings.to_world = before;
  MotionImages images =
      motion_images(*scene.scene, Camera(settings, scene.width, scene.height), then, window_of(scene, request));
  request.beside["Depth"] = std::move(images.depth);
  request.beside["Motion"] = std::move(images.motion);
}

/// The history from the previous frame's file for a frame with these layers.
std::shared_ptr<const History> history_of(const std::string& path, const RenderRequest& request) {
  const PlacedImage before = read_image(path);
  Image depth(before.image.width, before.image.height, 1);
  const std::vector<ExrPlane> planes = {{"Depth", ExrPlane::Type::kFloat, depth.data.data(), sizeof(float)}};
  ExrFile(path).read(planes);
  const std::vector<std::string> layers = image_layers(inspect_image(path).channels);
  const auto kept = [&](size_t i) {
    const bool is_kept = std::find(layers.begin(), layers.end(), kKeptSamples[i]) != layers.end();
    return is_kept ? read_image(path, kKeptSamples[i]).image : Image();
  };
  return std::make_shared<History>(reproject(before.image, depth,
                                             {request.beside.at("Depth"), request.beside.at("Motion")},
                                             {kept(0), kept(1)}, history_features(kept(2), kept(3))));
}

class SequenceRender {
 public:
  SequenceRender(const RenderOptions& options, int threads)
      : options_(options), threads_(threads), frames_(options.sequence.frames->numbers()) {}

  void run() {
    check(options_);
    const Plan plan = make_plan(options_);
    for (const int frame : frames_) {
      if (options_.request().resume) remove_empty(frame_options(options_, frame).request().output);
      outputs_.push_back(files_of(frame_options(options_, frame)));
      check_earlier_films(plan, frame_options(options_, frame).request());
      if (const std::string scene = frame_options(options_, frame).scene; has_many_scenes() && !fs::exists(scene))
        throw Error(ErrorCode::kIo, fmt::format("cannot read '{}', the scene of frame {}: no such file", scene, frame));
      if (!options_.sequence.camera_path.empty()) outputs_.back().reads(options_.sequence.camera_path);
    }
    display_ = display_of(options_);
    times_ = FrameTimes(options_);
    if (!has_many_scenes()) load_scene(frame_options(options_, frames_.front()), outputs_);
    const StopFlag stop;
    for (size_t i = 0; i < frames_.size(); ++i) render_frame(i, stop);
    if (stop.is_set()) throw Unfinished(stop.exit_code(), "interrupted when the last frame was written");
    if (!options_.quiet && n_made_ > 0) print_frames(options_, n_made_, static_cast<int>(frames_.size()), times_made_);
    if (!missed_.empty())
      throw Unfinished(kTargetMissed, fmt::format("frames {} did not reach their target", fmt::join(missed_, ", ")));
  }

 private:
  std::string stem() const { return fs::path(options_.scene).stem().string(); }
  bool has_many_scenes() const { return is_frame_pattern(options_.scene); }

  /// Files with animations of their own are loaded again for each frame: the first time tells of the scene.
  void load_scene(const RenderOptions& options, std::span<Outputs> outputs) {
    const bool again = scene_ && scene_->is_animated && !has_many_scenes();
    ProgressLine progress(stem(), options.quiet);
    progress.begin("loading");
    const Stopwatch watch;
    scene_.reset();  // two might not fit in memory
    scene_ = load(options);
    load_seconds_ = watch.seconds() - scene_->scene->build_seconds();
    if (!again || !is_framed(*scene_)) own_camera_ = own_camera(options, *scene_);
    progress.finish();
    for (Outputs& of_frame : outputs) of_frame.reads(scene_->files);
    if (!again) warn_of_scene(options, *scene_);
  }

  void warn_of(const Transform& camera) const {
    if (camera.flips_handedness() != own_camera_.flips_handedness())
      fmt::print(stderr, "warning: {}: its cameras mirror the picture; x points to the left\n",
                 options_.sequence.camera_path);
    if (const std::string still = times_.standstill(frames_); !still.empty())
      fmt::print(stderr, "warning: {}: {}\n", options_.sequence.camera_path, still);
    if (options_.sequence.history && frames_.size() == 1 && !options_.quiet)
      fmt::print(stderr, "note: the first frame of a command has no history, and --frames {} has no other\n",
                 frames_.front());
  }

  void render_frame(size_t index, const StopFlag& stop) {
    const int frame = frames_[index];
    RenderOptions one = frame_options(options_, frame);
    if (stop.is_set()) throw Unfinished(stop.exit_code(), interruption(index));
    if (has_many_scenes() || (scene_->is_animated && index > 0)) load_scene(one, std::span(outputs_).subspan(index, 1));
    RenderRequest request = make_request(one, *scene_);
    if (preview_stops_) request.exposure = *preview_stops_;
    const bool follows = frame - 1 == last_frame_;  // the previous frame is unknown otherwise
    const Transform now = times_.camera(*scene_, frame).value_or(own_camera_);
    const Transform before = times_.camera(*scene_, frame - 1).value_or(follows ? last_camera_ : now);
    if (index == 0) warn_of(now);
    times_.place(frame, now, *scene_);
    const std::string made_of = frame_made_of(one, *scene_, now, before, follows ? last_made_of_ : "");
    last_frame_ = frame, last_made_of_ = made_of, last_camera_ = now;
    if (request.resume && is_complete(request.output, made_of, relmse_goal(request))) {
      const std::string damage = damage_of(request.output);
      if (damage.empty() && !options_.quiet) fmt::print(stderr, "{}: complete\n", request.output);
      if (damage.empty()) return;
      fmt::print(stderr, "warning: {}; the frame is rendered again\n", damage);
      request.resume = false, request.overwrite = true;
    }
    trace_motion(before, times_.time(frame - 1), *scene_, request);
    request.attributes[film_key::kMadeOf] = made_of;
    MixingHistory& history = one.settings.denoising.history;
    history.keep_samples = options_.sequence.history;
    if (options_.sequence.history && follows)
      history.before = history_of(frame_name(options_.request().output, frame - 1), request);
    const std::string name = fmt::format("frame {} ({} of {})", frame, index + 1, frames_.size());
    const Stopwatch of_frame;
    ProgressLine progress(fmt::format("{} {}", stem(), name), options_.quiet);
    progress.repeats(static_cast<int>(frames_.size() - index - 1), n_made_ ? seconds_made_ / n_made_ : 0);
    const RenderResult result = render_watched(one, *scene_, request, display_.get(), progress, stop);
    if (!preview_stops_) preview_stops_ = result.preview_stops;  // or the frames would flicker
    const RenderReport made{one, *scene_, result, load_seconds_, threads_, progress.phase()};
    PhaseTimes times = phase_times(made);
    if (n_made_ > 0 && !has_many_scenes()) times.loading = 0;
    times_made_ += times;
    ++n_made_;
    seconds_made_ += of_frame.seconds();
    try {
      report(made, stop, name);
    } catch (const Unfinished& unfinished) {
      if (unfinished.exit_code() != kTargetMissed) throw Unfinished(unfinished.exit_code(), interruption(index));
      fmt::print(stderr, "warning: {}\n", unfinished.what());
      missed_.push_back(frame);
    }
  }

  std::string interruption(size_t index) const {
    return fmt::format(
        "interrupted in frame {}: {} of {} frames are complete; the same command with --resume continues",
        frames_[index], index, frames_.size());
  }

  const RenderOptions& options_;
  const int threads_;
  const std::vector<int> frames_;
  std::vector<Outputs> outputs_;  // of each frame
  std::unique_ptr<Display> display_;
  FrameTimes times_;
  std::optional<LoadedScene> scene_;
  Transform own_camera_;  // of the scene, without the path
  double load_seconds_ = 0;
  int n_made_ = 0;  // frames, by this call
  double seconds_made_ = 0;
  PhaseTimes times_made_;
  std::optional<double> preview_stops_;
  std::vector<int> missed_;
  int last_frame_ = -2;
  Transform last_camera_;
  std::string last_made_of_;
};

}  // namespace

void render_sequence(const RenderOptions& options, int threads) { SequenceRender(options, threads).run(); }

std::optional<double> time_of_frame(const RenderOptions& options) {
  if (!options.sequence.frames) return std::nullopt;
  return FrameTimes(options).time(options.sequence.frames->first);
}

void take_frame(RenderOptions& options) {
  const std::vector<int> frames = options.sequence.frames->numbers();
  if (frames.size() != 1) throw Error(ErrorCode::kUsage, "--replay needs a single frame, e.g. --frames 7");
  options = frame_options(options, frames[0]);
}

void place_frame(const RenderOptions& options, LoadedScene& scene) {
  const FrameTimes times(options);
  const int frame = options.sequence.frames->first;
  times.place(frame, times.camera(scene, frame).value_or(own_camera(options, scene)), scene);
}

}  // namespace covary
