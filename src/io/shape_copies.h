// SPDX-License-Identifier: Apache-2.0
// Copies of shapes at other places: of members of a shapegroup that emit light, and of shapes that move.
#pragma once

#include <functional>

#include "emitters/area.h"
#include "scene/parameters.h"
#include "scene/shape.h"

namespace covary {

/// The function that copies the shape, with BSDF and media, to where a transformation takes it. With `light`, which
/// need not live on, each copy is a light of its own. Copying throws Error(kInput), which begins with `where`, for a
/// transformation that the shape cannot have.
std::function<ShapePtr(const Transform&)> copies_of(const ShapePtr& shape, const AreaLight* light,
                                                    const SourceLocation& where);

/// A shape that moves by an <animation> of `to_world`, without that: in its own space. All others as they are.
ObjectPtr in_own_space(const ObjectPtr& shape, KeyedTransformPtr& to_world);

}  // namespace covary
