// SPDX-License-Identifier: Apache-2.0
// What shapes take of memory, known before it is taken (core/memory_limit.h): a few lines of a scene can place a mesh
// thousands of times.
#pragma once

#include <string>

#include "scene/scene.h"

namespace covary {

/// Bytes of the shape's arrays, about.
double array_bytes(const Shape& shape);

/// Bytes that a scene takes for the shape beside that, about: the ray tracer's tree, and tables to sample what emits.
double table_bytes(const Shape& shape, bool emits);

/// Throws Error(kInput) where the tables of all shapes need too much. `file`: of the scene.
void require_table_memory(const std::string& file, const SceneParts& parts);

}  // namespace covary
