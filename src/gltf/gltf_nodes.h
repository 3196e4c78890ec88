// SPDX-License-Identifier: Apache-2.0
// The nodes of a glTF scene and their places in the world.
#pragma once

#include <optional>
#include <vector>

#include "core/transform.h"
#include "gltf/gltf_file.h"

namespace covary {

class GltfNodes {
 public:
  /// Places all nodes below the roots of the scene; nodes whose transformation is singular are left out, with those
  /// below them and a warning.
  explicit GltfNodes(GltfFile& file);

  struct Place {
    int node;
    Transform to_world;
  };
  /// In file order, each before its children.
  const std::vector<Place>& places() const { return places_; }

  /// The maps from the mesh's space to world space of the joints of a skin; empty after a warning.
  std::vector<Transform> joints(int skin);

  /// Copies of a node's mesh (EXT_mesh_gpu_instancing), in the node's space; empty: one at its place.
  std::vector<Transform> instances(const tinygltf::Node& node);

 private:
  std::vector<int> roots() const;

  GltfFile& file_;
  std::vector<Place> places_;
  std::vector<std::optional<Transform>> world_;
};

}  // namespace covary
