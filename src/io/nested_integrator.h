// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/parameters.h"

namespace covary {

/// The integrator that renders the image: `object` itself, the one that it wraps, or one with the same picture, without
/// settings of Mitsuba's internals (samples_per_pass, block_size, timeout). Warns about what is dropped. Null after
/// recording an error.
ObjectPtr rendered_integrator(const ObjectPtr& object, Diagnostics& diagnostics);

}  // namespace covary
