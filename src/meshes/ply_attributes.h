// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "meshes/ply_header.h"
#include "scene/mesh.h"

namespace covary {

/// Marks the vertex or face properties that are channels of the wanted attributes, and adds those attributes to the
/// mesh without values yet. Excludes vertex colours, which have slots of their own.
void assign_attributes(PlyElement& element, std::span<const std::string> wanted, MeshData& mesh);

}  // namespace covary
