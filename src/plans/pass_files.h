// SPDX-License-Identifier: Apache-2.0
// Films of a render on disk while it goes on, and for other estimators after it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "plans/plan.h"
#include "plans/render.h"

namespace covary {

/// Attributes of films beside those of film/film.h.
namespace film_key {
inline constexpr const char* kTemporary = "temporary";     ///< "true": removed once the image of the render is written
inline constexpr const char* kTrial = "integrator_trial";  ///< which one was chosen and why (integrator_trial.h)
inline constexpr const char* kBudgets = "budgets";         ///< of a render to a wanted error (budget.h): "96 168"
/// Of a frame of a sequence, in film and result: a hash of all that its image depends on.
inline constexpr const char* kFrame = "frame";
}  // namespace film_key

/// Whether the result's file is the film itself, which can be continued.
bool output_is_film(const Plan& plan, const RenderRequest& request);

/// Where the films are while the plan runs; empty where the request names no file.
std::filesystem::path passes_folder(const RenderRequest& request);

/// Where the film of a pass is; empty where the request names no file.
std::string pass_path(const Plan& plan, const RenderRequest& request, const PassPlan& pass);

/// Before anything is rendered: throws Error(kInput) where the request, which neither resumes nor overwrites, would
/// begin films of an interrupted render anew, at its output or in the folder beside it, or take that folder for its own
/// although films are in it.
void check_earlier_films(const Plan& plan, const RenderRequest& request);

/// Looks for a film at pass.path. To resume, it takes the place of the empty one, which it must match, and where a
/// folder keeps films their costs so far are read, too; costs that make no sense are left out with a warning. Says
/// whether the file is temporary: it is when it belongs to no folder that the request names, nor to that of an earlier
/// render. Throws Error(kInput) for a film that does not match, for any file that is neither resumed nor overwritten,
/// for one that is no film, and for a link, which would lead out of the folder.
void take_film_on_disk(const Plan& plan, const RenderRequest& request,
                       const std::function<void(const std::string&)>& warn, Pass& pass);

/// Keeps the films, so that the render can be resumed.
void save_passes(const RenderRequest& request, std::span<Pass> passes, bool complete);

/// Removes the temporary files, and their folder when it is empty then.
void remove_passes(const RenderRequest& request, std::span<const Pass> passes);

// What the samples of a kept film cost: the text of the JSON file beside it.

struct PassCosts {
  uint64_t samples = 0, rays = 0;
  double seconds = 0;           ///< of rendering
  double estimate_seconds = 0;  ///< part of `seconds`: what fitting took; 0 where a pass only renders
};

/// Throws Error(kInput) where the text is not such a JSON object, or a value cannot be right.
PassCosts parse_pass_costs(std::string_view text);

/// The text that parse_pass_costs() reads; without `estimate_seconds` where that is 0.
std::string to_text(const PassCosts& costs);

}  // namespace covary
