// SPDX-License-Identifier: Apache-2.0
// When a render to a target error checks it for the first time.
#pragma once

#include <algorithm>
#include <cstdint>

#include "plans/budget.h"
#include "plans/plan.h"
#include "plans/render_request.h"

namespace covary {

/// Samples per pixel, of all passes together, before the first check: few for means, denoised or not, two for each of
/// twelve groups. Without a target error, as many as there may be.
inline uint32_t samples_before_check(const LoadedScene& scene, const Plan& plan, const RenderRequest& request) {
  constexpr uint32_t kOfMeans = 24;
  const bool is_mean = plan.phases.size() == 1 && !plan.method->pair() && !plan.has_crn_pass;
  const uint32_t usual = first_budget(scene, request);
  return request.until > 0 && is_mean ? std::min(usual, kOfMeans) : usual;
}

}  // namespace covary
