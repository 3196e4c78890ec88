// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "scene/parameters.h"
#include "scene/shape.h"

namespace covary {

/// All shapes that have a surface of their own, sorted by name ("shapegroup" and "instance" are made by the loader).
/// What they make has no material and emits nothing; the loader adds both.
std::span<const Plugin<Shape>> shape_plugins();

}  // namespace covary
