// SPDX-License-Identifier: Apache-2.0
// Steps of `covary render` that an image and the frames of a sequence have in common.
#pragma once

#include <memory>

#include "film/display.h"
#include "film/outputs.h"
#include "interruption.h"
#include "progress.h"
#include "render_options.h"
#include "render_report.h"

namespace covary {

/// What the command reads and writes, as far as it is known before the scene is loaded.
Outputs files_of(const RenderOptions& options);

/// The viewer that the options name, or null.
std::unique_ptr<Display> display_of(const RenderOptions& options);

/// Warnings and a note on stderr.
void warn_of_scene(const RenderOptions& options, const LoadedScene& scene);

/// Renders with a line of progress and, where there is one, a viewer.
RenderResult render_watched(const RenderOptions& options, const LoadedScene& scene, const RenderRequest& request,
                            Display* display, ProgressLine& progress, const StopFlag& stop);

/// Writes --json and prints the summary. Throws Unfinished for a render that was interrupted or missed its target.
void report(const RenderReport& report, const StopFlag& stop);

}  // namespace covary
