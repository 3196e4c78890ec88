// SPDX-License-Identifier: Apache-2.0
// Polygons of mesh files as triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/vec.h"

namespace covary {

/// Concave polygons with more corners are refused: the time grows with the square of the number.
inline constexpr size_t kMaxConcaveCorners = size_t{1} << 16;

/// Appends the triangles of a polygon, two fewer than it has corners (none for fewer than three), in the order of its
/// corners, which are indices into `positions`. The triangles are a fan around the first corner if none of them turns
/// over, as in every convex polygon; otherwise ears are clipped [Meisters1975], seen along the axis closest to the
/// normal. A polygon without a normal, or with a corner that does not exist, becomes a fan; one that crosses itself
/// becomes triangles that cover its corners. Throws Error(kInput) for concave ones of more than kMaxConcaveCorners.
void add_polygon(std::span<const uint32_t> corners, std::span<const Vec3> positions,
                 std::vector<std::array<uint32_t, 3>>& triangles);

}  // namespace covary
