// SPDX-License-Identifier: Apache-2.0
// What forks of Mitsuba add to its plugins without another picture: parameters of their sampling methods, and films
// that sort light by its time of arrival beside the usual picture. docs/scene-format.md lists them.
#pragma once

#include "scene/parameters.h"

namespace covary {

/// Turns a film of a fork into the usual one and removes parameters that do not change the picture. `old`: of Mitsuba
/// 0.x, which ignores what a plugin does not ask for.
void adopt_forms_of_forks(ObjectDescription& object, bool old, Diagnostics& diagnostics);

}  // namespace covary
