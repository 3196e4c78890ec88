// SPDX-License-Identifier: Apache-2.0
// glTF meshes: triangles, strips and fans as shapes `ply`, deformed as they are at rest.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/transform.h"
#include "formats/object_builder.h"
#include "gltf/gltf_file.h"
#include "gltf/gltf_materials.h"

namespace covary {

struct GltfMesh {
  EmbeddedMesh mesh;
  bool smooth = false;       ///< has normals
  bool transparent = false;  ///< a vertex colour has an alpha below 1
};

/// How a node deforms its mesh.
struct GltfPose {
  std::span<const double> weights;    ///< of the morph targets
  std::span<const Transform> joints;  ///< from the mesh's space to world space; empty: no skin
};

/// The triangles of a primitive with the texture coordinates of `sets`; nullopt after an error, or, with a warning, if
/// it has no triangles. Messages call it `what`.
std::optional<GltfMesh> read_gltf_mesh(GltfFile& file, const tinygltf::Primitive& primitive, const GltfSets& sets,
                                       const GltfPose& pose, const std::string& what);

}  // namespace covary
