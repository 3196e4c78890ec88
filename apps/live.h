// SPDX-License-Identifier: Apache-2.0
// --live: the page of a command, from its options to what the terminal says of it.
#pragma once

#include <memory>
#include <string>

#include "live/live_page.h"
#include "live/live_render.h"
#include "render_options.h"

namespace covary {

/// Prints the page's address and, where the terminal is one of SSH, how to get there; opens a browser if it can.
void announce(const LivePage& page);

/// Throws Error(kUsage) if --live does not fit the other options.
void check_live(const RenderOptions& options);

/// The page of a render, announced, or null if none was asked for.
std::unique_ptr<LiveRender> live_of(const RenderOptions& options);

/// A page that follows a file or folder, until a signal comes.
void follow(const LiveOptions& options, const std::string& path);

}  // namespace covary
