// SPDX-License-Identifier: Apache-2.0
// Films on disk, during a render and afterwards for other estimators.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "plans/made_of.h"
#include "plans/plan.h"
#include "plans/render.h"

namespace covary {

/// Attributes of films in addition to those in film/film.h.
namespace film_key {
inline constexpr const char* kTemporary = "temporary";     ///< "true": removed once the image of the render is written
inline constexpr const char* kTrial = "integrator_trial";  ///< the choice and its reason (integrator_trial.h)
inline constexpr const char* kBudgets = "budgets";         ///< of a render to a target error (budget.h): "96 168"
/// Of a render with a time limit: TimeChoice::text(), with which it is made again.
inline constexpr const char* kTimeChoice = "time_choice";
}  // namespace film_key

/// Whether the output's file is this film, which can be continued.
inline bool is_output(const Pass& pass, const RenderRequest& request) { return pass.path == request.output; }

/// The folder of the films while the plan runs; empty if the request names no file.
std::filesystem::path passes_folder(const RenderRequest& request);

/// The file of a pass's film; empty if the request names no file.
std::string pass_path(const Plan& plan, const RenderRequest& request, const PassPlan& pass);

/// Before rendering: throws Error(kInput) if the request neither resumes nor overwrites, but would restart films of an
/// interrupted render, at its output or in the folder next to it, or would use that folder although it contains films;
/// or replace an image that is made of something else, according to film_key::kMadeOf (made_of.h).
void check_earlier_films(const Plan& plan, const RenderRequest& request);

/// Looks for a film at pass.path. When resuming, it replaces the empty film, which it must match; if a folder keeps
/// films, their accumulated costs are read, too, and invalid ones are ignored with a warning. Returns whether the file
/// is temporary: it belongs neither to a folder named by the request nor to an earlier render's. Throws Error(kInput)
/// for a film that does not match, for a file that is neither resumed nor overwritten, for a file that is not a film,
/// and for a symbolic link, which might lead out of the folder.
void take_film_on_disk(const RenderRequest& request, const std::function<void(const std::string&)>& warn, Pass& pass);

/// Writes the films, so that the render can be resumed.
void save_passes(const RenderRequest& request, std::span<Pass> passes, bool complete);

/// Removes the temporary files, and their folder if it is then empty.
void remove_passes(const RenderRequest& request, std::span<const Pass> passes);

// The cost of a kept film's samples, in the JSON file beside it.

struct PassCosts {
  uint64_t samples = 0, rays = 0;
  double seconds = 0;            ///< of rendering
  double estimate_seconds = 0;   ///< part of `seconds`: fitting; 0 if a pass only renders
  double processor_seconds = 0;  ///< 0: unknown
};

/// Throws Error(kInput) if the text is not such a JSON object, or a value is impossible.
PassCosts parse_pass_costs(std::string_view text);

/// The text that parse_pass_costs() reads; without `estimate_seconds` and `processor_seconds` if they are 0.
std::string to_text(const PassCosts& costs);

}  // namespace covary
