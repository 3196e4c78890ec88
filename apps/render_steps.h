// SPDX-License-Identifier: Apache-2.0
// Steps of `covary render` that images and frames of sequences share.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>

#include "film/display.h"
#include "film/outputs.h"
#include "interruption.h"
#include "live/live_render.h"
#include "phase_times.h"
#include "plans/render.h"
#include "progress.h"
#include "render_options.h"

namespace covary {

// Reports on a render: statistics, summary, unusable samples.

/// What is reported.
struct RenderReport {
  const RenderOptions& options;
  const LoadedScene& scene;
  const RenderResult& result;
  double load_seconds = 0;  ///< for reading the scene, without building the BVH
  int threads = 0;
  std::string last_phase;  ///< that the render began
};

/// The object of --json.
nlohmann::ordered_json statistics(const RenderReport& report);

/// Prints lines on stderr about samples that were negative or not finite, with the commands that replay them.
void report_bad_samples(const RenderOptions& options, const Pass& pass);

PhaseTimes phase_times(const RenderReport& report);

/// Prints lines on stderr about a finished render: what was written, where the time went, how good it is, and what
/// would help next; with --verbose, also speeds and figures.
void print_summary(const RenderReport& report);
/// The same about a frame of a sequence, in one line; `frame`: "frame 12 (3 of 8)".
void print_frame(const RenderReport& report, const std::string& frame);
/// The last lines about a sequence, of whose frames this command made some.
void print_frames(const RenderOptions& options, int n_made, int n_frames, const PhaseTimes& times);

// covary render --frames: a scene to numbered images. The scene is loaded and built once or, if it is a pattern of
// names, once per frame. Each frame is the image that `render` makes of it alone with the same camera and seed,
// whichever other frames the command has.

/// Renders all frames of options.sequence in order. With --resume, complete frames stay as they are. Throws
/// Error(kUsage) for options that do not fit a sequence, Error(kInput) for a complete frame with other settings, and
/// Unfinished after a signal or if frames missed --until.
void render_sequence(const RenderOptions& options, int threads);

/// For --replay: the options of the only frame of options.sequence; throws Error(kUsage) if there are more.
void take_frame(RenderOptions& options);
/// The time in seconds of a single frame, at which the animations of a glTF file are; nullopt without --frames.
std::optional<double> time_of_frame(const RenderOptions& options);
/// Then moves the camera to its place in that frame.
void place_frame(const RenderOptions& options, LoadedScene& scene);

/// The files that the command reads and writes, as far as known before the scene is loaded.
Outputs files_of(const RenderOptions& options);

/// The viewer that the options name, or null.
std::unique_ptr<Display> display_of(const RenderOptions& options);

/// Warnings and a note on stderr.
void warn_of_scene(const RenderOptions& options, const LoadedScene& scene);

/// Renders with a progress line and, if requested, a viewer and a page.
RenderResult render_watched(const RenderOptions& options, const LoadedScene& scene, const RenderRequest& request,
                            Display* display, ProgressLine& progress, const StopFlag& stop, LiveRender* live = nullptr);

/// Writes --json and prints the summary; of a `frame`, its line. Throws Unfinished for a render that was interrupted or
/// missed its target.
void report(const RenderReport& report, const StopFlag& stop, const std::string& frame = "");

}  // namespace covary
