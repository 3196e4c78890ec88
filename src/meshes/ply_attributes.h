// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "meshes/ply_header.h"
#include "scene/mesh.h"

namespace covary {

/// Marks the properties of the vertices or faces that are channels of the wanted attributes, and adds these to the
/// mesh, still without values. Colours of vertices are not among them: they have slots of their own.
void assign_attributes(PlyElement& element, std::span<const std::string> wanted, MeshData& mesh);

}  // namespace covary
