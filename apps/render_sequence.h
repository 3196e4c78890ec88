// SPDX-License-Identifier: Apache-2.0
// covary render --frames: a scene to numbered images. The scene is loaded and built once, or where it
// is a pattern of names, for each frame; each frame is the image that
// `render` makes of it alone with the same camera and seed, whichever other frames the command has.
#pragma once

#include "render_options.h"

namespace covary {

/// Renders all frames of options.sequence in their order. With --resume, those that are complete stay as they are.
/// Throws Error(kUsage) for options that fit no sequence, Error(kInput) for a complete frame of other settings, and
/// Unfinished after a signal and where frames missed --until.
void render_sequence(const RenderOptions& options, int threads);

/// For --replay: the options of the only frame of options.sequence; throws Error(kUsage) where there are more.
void take_frame(RenderOptions& options);
/// Then puts the camera where it is in that frame.
void place_frame(const RenderOptions& options, LoadedScene& scene);

}  // namespace covary
