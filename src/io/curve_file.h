// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "core/transform.h"
#include "scene/curve.h"

namespace covary {

/// Text of one control point a line, "x y z radius"; blank lines begin a new curve. Points are moved by `to_world`,
/// radii are not. Throws Error(kInput) that names the line.
std::shared_ptr<CurveShape> read_curves(std::string_view text, CurveKind kind, const Transform& to_world);

}  // namespace covary
