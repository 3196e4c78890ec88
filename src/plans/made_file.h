// SPDX-License-Identifier: Apache-2.0
// Whether a render with `resume` finds that its picture is there already.
#pragma once

#include <optional>
#include <string>

#include "plans/render_request.h"

namespace covary {

/// How the file at `path` was made, according to its attributes.
struct MadeFile {
  std::string made_of;  ///< as of plans/made_of.h; empty: unknown, or there is no image
  bool complete = false;
  std::optional<double> predicted;  ///< relMSE
};
MadeFile made_file(const std::string& path);

/// The relMSE that the render is to reach; 0 if that is no goal.
inline double relmse_goal(const RenderRequest& request) { return request.until_in_blocks ? 0 : request.until; }

/// Whether it is complete, was made as `made_of` says apart from the goal, and its predicted relMSE is at most `until`.
bool reaches(const MadeFile& file, const std::string& made_of, double until);

}  // namespace covary
