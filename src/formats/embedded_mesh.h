// SPDX-License-Identifier: Apache-2.0
// Meshes that stand in a scene's own file become PLY files in memory, the property `data` of a shape `ply`.
#pragma once

#include <string>
#include <vector>

namespace covary {

struct EmbeddedMesh {
  std::vector<double> positions, normals, uvs;  ///< three, three and two numbers a vertex; the last two may be empty
  std::vector<double> corners;                  ///< three indices a triangle, whole and in range
};

/// The mesh as a binary PLY file.
std::string ply_text(const EmbeddedMesh& mesh);

}  // namespace covary
