// SPDX-License-Identifier: Apache-2.0
// Films of a render on disk while it goes on, and for other estimators after it.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "plans/plan.h"
#include "plans/render.h"

namespace covary {

/// Whether the result's file is the film itself.
bool output_is_film(const Plan& plan, const RenderRequest& request);

/// Where the films are while the plan runs; empty where the request names no file.
std::filesystem::path passes_folder(const RenderRequest& request);

/// Where the film of a pass is; empty where the request names no file.
std::string pass_path(const Plan& plan, const RenderRequest& request, const PassPlan& pass);

/// Puts the film at pass.path in the place of the empty one, which it must match, and where a folder keeps them the costs so far.
/// Throws Error(kInput) where it does not match.
void resume(const RenderRequest& request, Pass& pass);

/// Keeps the films, so that resume() can go on from here.
void save_passes(const RenderRequest& request, std::span<Pass> passes, bool complete);

/// Removes films that were kept for an interruption alone.
void remove_passes(const Plan& plan, const RenderRequest& request, std::span<const Pass> passes);

}  // namespace covary
