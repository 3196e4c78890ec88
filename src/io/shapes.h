// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/transform.h"
#include "emitters/area.h"
#include "scene/curve.h"
#include "scene/parameters.h"
#include "scene/shape.h"

namespace covary {

/// All shapes that have a surface of their own, sorted by name ("shapegroup" and "instance" are made by the loader).
/// What they make has no material and emits nothing; the loader adds both.
std::span<const Plugin<Shape>> shape_plugins();

/// The names that textures `mesh_attribute` of the shape's models and lights ask its mesh for.
std::vector<std::string> wanted_attributes(const ObjectDescription& shape);

// Copies of shapes at other places: of members of a shapegroup that emit light, and of shapes that move.

/// The function that copies the shape, with BSDF and media, to where a transformation takes it. With `light`, which
/// need not live on, each copy is a light of its own. Copying throws Error(kInput), which begins with `where`, for a
/// transformation that the shape cannot have.
std::function<ShapePtr(const Transform&)> copies_of(const ShapePtr& shape, const AreaLight* light,
                                                    const SourceLocation& where);

/// A shape that moves by an <animation> of `to_world`, without that: in its own space. All others as they are.
ObjectPtr in_own_space(const ObjectPtr& shape, KeyedTransformPtr& to_world);

/// Text of one control point a line, "x y z radius"; blank lines begin a new curve. Points are moved by `to_world`,
/// radii are not. Throws Error(kInput) that names the line.
std::shared_ptr<CurveShape> read_curves(std::string_view text, CurveKind kind, const Transform& to_world);

}  // namespace covary
