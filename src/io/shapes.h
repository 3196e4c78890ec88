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

/// All shapes with a surface of their own, sorted by name ("shapegroup" and "instance" are created by the loader). They
/// are created without material and emitter; the loader adds both.
std::span<const Plugin<Shape>> shape_plugins();

/// Attributes that `mesh_attribute` textures of the shape's models and lights read from its mesh.
std::vector<std::string> wanted_attributes(const ObjectDescription& shape);

// Copies of shapes with other transformations: of emissive members of a shape group, and of moving shapes.

/// A function that copies the shape, with BSDF and media, to a given transformation. With `light`, which need not
/// outlive the call, each copy is a light of its own. The function throws Error(kInput), starting with `where`, for a
/// transformation that the shape does not support.
std::function<ShapePtr(const Transform&)> copies_of(const ShapePtr& shape, const AreaLight* light,
                                                    const SourceLocation& where);

/// For a shape with an animated `to_world`: the shape in object space, without it. Other shapes unchanged.
ObjectPtr in_own_space(const ObjectPtr& shape, KeyedTransformPtr& to_world);

/// Parses text with one control point per line, "x y z radius"; blank lines start a new curve. Points are transformed
/// by `to_world`, radii are not. Throws Error(kInput) naming the line.
std::shared_ptr<CurveShape> read_curves(std::string_view text, CurveKind kind, const Transform& to_world);

/// Records an error if the shape cannot be a light.
void require_emission(Parameters& parameters, const Shape& shape);

}  // namespace covary
