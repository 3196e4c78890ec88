// SPDX-License-Identifier: Apache-2.0
// The light pass of a plan: whether there is one, its number of light paths, and how its film is added to the image.
#pragma once

#include <span>

#include "plans/plan.h"
#include "plans/render.h"

namespace covary {

/// Whether a render of the scene by this plan has a light pass.
bool has_light_pass(const LoadedScene& scene, const Plan& plan, const RenderRequest& request);

/// A clone of the scene's integrator for one render: prepared and, if it traces light, informed of pixels and passes.
/// Throws Error(kUsage) if it does not fit the request.
std::shared_ptr<Integrator> prepared_integrator(const LoadedScene& scene, const Plan& plan,
                                                const RenderRequest& request);

/// The light pass that accompanies these passes of the plan. It has as many groups as the pass with the most, and
/// enough for its standard error if the plan needs one.
PassPlan light_pass_plan(const Plan& plan, std::span<const PassPlan> passes);
/// The same number of groups for existing films, which may have been begun on disk with another number.
int light_groups(const Plan& plan, std::span<const Pass> passes);

/// Sets the number of samples of the light pass: as many light paths for the camera samples of these passes as the
/// integrator's weights assume, rounded to whole bundles for all groups, at least one in each.
void set_light_target(const Integrator& integrator, std::span<const Pass> cameras, Pass& light);

/// Whether the method gets the sum of both films, and so denoises the light paths, too: a method of one pass whose film
/// and the light film have the same groups.
bool denoises_light(const Plan& plan, const Film& camera, const Film& light);

/// The film of the only camera pass plus the light film, group by group; both must have the same number of groups. The
/// counts are the camera's. It cannot be resumed, as its attribute film_key::kLight says.
Film sum_of_films(const Film& camera, const Film& light);

}  // namespace covary
