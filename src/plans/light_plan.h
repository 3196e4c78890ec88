// SPDX-License-Identifier: Apache-2.0
// The light pass of a plan: whether there is one, how many light paths it takes, and how its film joins the image.
#pragma once

#include <span>

#include "plans/plan.h"
#include "plans/render.h"

namespace covary {

/// Whether a render of the scene by the plan has a light pass.
bool has_light_pass(const LoadedScene& scene, const Plan& plan, const RenderRequest& request);

/// A clone of the scene's integrator for one render: prepared, and told of the pixels and passes where it traces light.
/// Throws Error(kUsage) where it does not fit the request.
std::shared_ptr<Integrator> prepared_integrator(const LoadedScene& scene, const Plan& plan,
                                                const RenderRequest& request);

/// The light pass beside these passes of the plan. It has the most groups of them, and enough for its standard error
/// where the plan wants one.
PassPlan light_pass_plan(const Plan& plan, std::span<const PassPlan> passes);
/// That number of groups beside films that have begun and may have been on disk with another number.
int light_groups(const Plan& plan, std::span<const Pass> passes);

/// Sets how many samples the light pass is to have: as many light paths for the camera samples of these passes as the
/// integrator's weights assume, rounded to whole bundles for all groups, at least one in each.
void set_light_target(const Integrator& integrator, std::span<const Pass> cameras, Pass& light);

/// The film of the one camera pass plus the light film, group by group, which must be as many. The counts are those of
/// the camera. It cannot be continued, and says so by the attribute film_key::kLight.
Film sum_of_films(const Film& camera, const Film& light);

}  // namespace covary
