// SPDX-License-Identifier: Apache-2.0
#include "render_sequence.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <utility>
#include <vector>

#include "commands.h"
#include "core/content_hash.h"
#include "core/error.h"
#include "core/stopwatch.h"
#include "core/unfinished.h"
#include "film/image_file.h"
#include "passes/motion.h"
#include "plans/budget.h"
#include "plans/camera_path.h"
#include "plans/pass_files.h"
#include "render_steps.h"
#include "sequences/reprojection.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

/// Where the camera is in every frame.
class FrameCameras {
 public:
  FrameCameras(const RenderOptions& options, const LoadedScene& scene) : resting_(scene.camera->settings().to_world) {
    if (!options.sequence.camera_path.empty()) path_ = read_camera_path(options.sequence.camera_path);
  }
  Transform at(int frame) const { return path_ ? path_->at_frame(frame) : resting_; }

 private:
  Transform resting_;
  std::optional<CameraPath> path_;
};

void check(const RenderOptions& options) {
  const auto usage = [](const std::string& message) { throw Error(ErrorCode::kUsage, message); };
  const RenderRequest& request = options.request();
  for (const auto& [name, given] : {std::pair{"--save-stages", !options.stages.empty()},
                                    {"--debug-strategies", !options.debug_strategies.empty()},
                                    {"--save-training", !request.save_training.empty()}})
    if (given) usage(fmt::format("{} is an option of single images, not of --frames", name));
  const DenoisingChoice& denoising = options.settings.denoising;
  if (options.sequence.history && (!denoising.denoises() || request.layers))
    usage("--history is for frames with --denoise, and without --layers");
  for (const auto& [name, path] :
       {std::pair{"-o", request.output}, {"--passes", request.passes}, {"--json", options.json}})
    if (!path.empty() && !is_frame_pattern(path))
      usage(
          fmt::format("{} '{}': with --frames, expected is a name with '#' in place of the frame's number, e.g. "
                      "{}",
                      name, path, std::string(name) == "-o" ? "out_####.exr" : "out_####"));
}

/// The options of one frame alone.
RenderOptions frame_options(const RenderOptions& options, int frame) {
  RenderOptions one = options;
  RenderRequest& request = one.settings.request;
  for (std::string* path : {&request.output, &request.passes, &one.json})
    if (!path->empty()) *path = frame_name(*path, frame);
  request.seed = options.sequence.seed_of(request.seed, frame);
  one.values["seed"] = std::to_string(request.seed);
  one.sequence.frames = FrameRange{frame, frame, 1};
  one.sequence.seeds = FrameSeeds::kSame;
  return one;
}

/// A hash of what the image of the frame depends on: scene and camera, the camera before, seed and settings; with a
/// history, `earlier`, the hash of the frame that it is made of.
std::string frame_hash(const RenderOptions& one, const LoadedScene& scene, const Transform& before,
                       const std::string& earlier) {
  OptionValues values = one.values;
  for (const char* option : {"output", "passes", "resume", "overwrite", "checkpoint", "no-preview"})
    values.erase(option);
  std::string text = scene.content_hash;
  if (one.sequence.history) text += " history " + earlier;
  for (const auto& row : before.matrix()) text += fmt::format(" {}", fmt::join(row, " "));
  for (const OptionValues& all : std::array{std::as_const(values), one.of_integrator, one.of_estimator})
    for (const auto& [name, value] : all) text += fmt::format("\n{}={}", name, value);
  return hash_text(hash_bytes(text));
}

/// Whether the file is the whole frame. Throws where it is a whole image, and another one.
bool is_complete(const std::string& path, const std::string& hash) {
  if (!fs::exists(path)) return false;
  const std::map<std::string, std::string> attributes = inspect_image(path).attributes;
  const auto value = [&](const char* key) {
    const auto it = attributes.find(std::string("covary:") + key);
    return it == attributes.end() ? std::string() : it->second;
  };
  if (value(film_key::kComplete) == "false") return false;
  if (value(film_key::kFrame) == hash) return true;
  throw Error(ErrorCode::kInput, fmt::format("--resume: '{}' is no frame of this command: its scene, camera, seed or "
                                             "options are others; without --resume it is replaced",
                                             path));
}

/// Puts the camera where it is in the frame, and gives its layers.
void prepare(const FrameCameras& cameras, int frame, LoadedScene& scene, RenderRequest& request) {
  place_camera(scene, cameras.at(frame - 1));
  const Camera previous = *scene.camera;
  place_camera(scene, cameras.at(frame));
  MotionImages images = motion_images(*scene.scene, previous, window_of(scene, request));
  request.beside["Depth"] = std::move(images.depth);
  request.beside["Motion"] = std::move(images.motion);
}

/// The history that the frame in the file is for one with these layers.
std::shared_ptr<const History> history_of(const std::string& path, const RenderRequest& request) {
  const PlacedImage before = read_image(path);
  Image depth(before.image.width, before.image.height, 1);
  const std::vector<ExrPlane> planes = {{"Depth", ExrPlane::Type::kFloat, depth.data.data(), sizeof(float)}};
  ExrFile(path).read(planes);
  return std::make_shared<History>(
      reproject(before.image, depth, {request.beside.at("Depth"), request.beside.at("Motion")}));
}

class SequenceRender {
 public:
  SequenceRender(const RenderOptions& options, int threads)
      : options_(options), threads_(threads), frames_(options.sequence.frames->numbers()) {}

  void run() {
    check(options_);
    std::vector<Outputs> outputs;
    for (const int frame : frames_) {
      outputs.push_back(files_of(frame_options(options_, frame)));
      if (!options_.sequence.camera_path.empty()) outputs.back().reads(options_.sequence.camera_path);
    }
    display_ = display_of(options_);
    load_scene(outputs);
    const FrameCameras cameras(options_, *scene_);
    const StopFlag stop;
    for (const int frame : frames_) render_frame(cameras, frame, stop);
    if (stop.is_set()) throw Unfinished(stop.exit_code(), "interrupted when the last frame was written");
    if (!missed_.empty())
      throw Unfinished(kTargetMissed, fmt::format("frames {} did not reach their target", fmt::join(missed_, ", ")));
  }

 private:
  std::string stem() const { return fs::path(options_.scene).stem().string(); }

  void load_scene(std::vector<Outputs>& outputs) {
    ProgressLine progress(stem(), options_.quiet);
    progress.begin("loading");
    const Stopwatch watch;
    scene_ = load(options_);
    load_seconds_ = watch.seconds() - scene_->scene->build_seconds();
    progress.finish();
    for (Outputs& of_frame : outputs) of_frame.reads(scene_->files);
    warn_of_scene(options_, *scene_);
  }

  void render_frame(const FrameCameras& cameras, int frame, const StopFlag& stop) {
    RenderOptions one = frame_options(options_, frame);
    if (stop.is_set()) throw Unfinished(stop.exit_code(), interruption(frame));
    RenderRequest request = make_request(one, *scene_);
    prepare(cameras, frame, *scene_, request);
    const bool follows = frame - 1 == last_frame_;  // of frames that are farther apart nothing is known
    const std::string hash = frame_hash(one, *scene_, cameras.at(frame - 1), follows ? last_hash_ : "");
    last_frame_ = frame, last_hash_ = hash;
    if (request.resume && is_complete(request.output, hash)) {
      if (!options_.quiet) fmt::print(stderr, "{}: complete\n", request.output);
      return;
    }
    request.attributes[film_key::kFrame] = hash;
    if (options_.sequence.history && follows)
      one.settings.denoising.history = history_of(frame_name(options_.request().output, frame - 1), request);
    ProgressLine progress(fmt::format("{} frame {}", stem(), frame), options_.quiet);
    const RenderResult result = render_watched(one, *scene_, request, display_.get(), progress, stop);
    try {
      report({one, *scene_, result, load_seconds_, threads_}, stop);
    } catch (const Unfinished& unfinished) {
      if (unfinished.exit_code() != kTargetMissed) throw Unfinished(unfinished.exit_code(), interruption(frame));
      fmt::print(stderr, "warning: {}\n", unfinished.what());
      missed_.push_back(frame);
    }
  }

  std::string interruption(int frame) const {
    return fmt::format(
        "interrupted in frame {}: {} of {} frames are complete; the same command with --resume "
        "continues",
        frame, std::find(frames_.begin(), frames_.end(), frame) - frames_.begin(), frames_.size());
  }

  const RenderOptions& options_;
  const int threads_;
  const std::vector<int> frames_;
  std::unique_ptr<Display> display_;
  std::optional<LoadedScene> scene_;
  double load_seconds_ = 0;
  std::vector<int> missed_;
  int last_frame_ = -2;
  std::string last_hash_;
};

}  // namespace

void render_sequence(const RenderOptions& options, int threads) { SequenceRender(options, threads).run(); }

void place_frame(RenderOptions& options, LoadedScene& scene) {
  const std::vector<int> frames = options.sequence.frames->numbers();
  if (frames.size() != 1) throw Error(ErrorCode::kUsage, "--replay is about one frame, such as --frames 7");
  place_camera(scene, FrameCameras(options, scene).at(frames[0]));
  options.settings.request.seed = options.sequence.seed_of(options.request().seed, frames[0]);
}

}  // namespace covary
