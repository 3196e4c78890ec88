// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/parameters.h"

namespace covary {

/// The integrator that renders the image: `object` itself, or the one that `moment` or `aov` wraps; without what only
/// concerns how Mitsuba works (samples_per_pass, block_size, timeout). Warns of what is left out. Null after recording
/// an error.
ObjectPtr rendered_integrator(const ObjectPtr& object, Diagnostics& diagnostics);

}  // namespace covary
