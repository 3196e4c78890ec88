// SPDX-License-Identifier: Apache-2.0
// Films of a render on disk while it goes on, and for other estimators after it.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "plans/plan.h"
#include "plans/render.h"

namespace covary {

/// Whether the result's file is the film itself, which can be continued.
bool output_is_film(const Plan& plan, const RenderRequest& request);

/// Where the films are while the plan runs; empty where the request names no file.
std::filesystem::path passes_folder(const RenderRequest& request);

/// Where the film of a pass is; empty where the request names no file.
std::string pass_path(const Plan& plan, const RenderRequest& request, const PassPlan& pass);

/// Looks for a film at pass.path. To resume, it takes the place of the empty one, which it must match, and where a
/// folder keeps films their costs so far are read, too; costs that make no sense are left out with a warning. Throws
/// Error(kInput) for a film that does not match, and in the folder that the request names for any film that it neither
/// resumes nor overwrites.
void take_film_on_disk(const RenderRequest& request, const std::function<void(const std::string&)>& warn, Pass& pass);

/// Keeps the films, so that the render can be resumed.
void save_passes(const RenderRequest& request, std::span<Pass> passes, bool complete);

/// Removes films that were kept for an interruption alone.
void remove_passes(const Plan& plan, const RenderRequest& request, std::span<const Pass> passes);

}  // namespace covary
