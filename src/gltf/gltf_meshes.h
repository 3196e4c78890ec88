// SPDX-License-Identifier: Apache-2.0
// glTF meshes: triangles, strips and fans as shapes `ply`.
#pragma once

#include <optional>
#include <string>

#include "formats/object_builder.h"
#include "gltf/gltf_file.h"

namespace covary {

struct GltfMesh {
  EmbeddedMesh mesh;
  bool smooth = false;  ///< has normals
};

/// The triangles of a primitive with the texture coordinates of `texture_set`; nullopt after an error, or, with a
/// warning, if it has no triangles. Messages call it `what`.
std::optional<GltfMesh> read_gltf_mesh(GltfFile& file, const tinygltf::Primitive& primitive, int texture_set,
                                       const std::string& what);

}  // namespace covary
