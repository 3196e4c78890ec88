// SPDX-License-Identifier: Apache-2.0
// Shapes as Embree's geometries. Only this and ray_tracer.h use Embree, version 3 or 4.
#pragma once

// CMakeLists.txt also prefers Embree 4 if both are installed.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "scene/shape.h"

namespace covary {

/// A geometry with the shape, committed. `instanced`: it belongs to a group that instances place; otherwise, if
/// enlargement() is not 1, it is an instance of the shape.
RTCGeometry make_geometry(RTCDevice device, const Shape& shape, bool instanced);

/// Sets the geometry to another shape of the same class; neither is enlarged.
void set_shape(RTCGeometry geometry, const Shape& shape);

/// By what power of two a shape is enlarged inside Embree, as an instance of itself: 1 if it is not. Linear curves are
/// enlarged if a segment is shorter than kShortSegment (curve.h).
float enlargement(const Shape& shape);

/// Builds the hierarchy; outside of the surrounding work, because each of Embree's scenes keeps a task group.
void commit_scene(RTCScene scene);

/// The transformation as Embree has it, in floats.
Transform rounded(const Transform& to_world);

/// Places an instance, and commits it.
void set_placement(RTCGeometry instance, const Transform& to_world);

}  // namespace covary
