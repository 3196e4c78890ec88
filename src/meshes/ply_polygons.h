// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "meshes/ply_header.h"
#include "meshes/polygon.h"
#include "scene/mesh.h"

namespace covary {

/// Turns faces into triangles: at once, or if the vertices come later in the file, at its end.
class PlyPolygons {
 public:
  explicit PlyPolygons(MeshData& mesh) : mesh_(mesh) {}

  void add(std::span<const uint32_t> corners, uint64_t face) {
    if (mesh_.positions.empty() && corners.size() > 3) early_.push_back({mesh_.triangles.size(), corners.size(), face});
    split(corners, face, mesh_.triangles);
  }
  /// Splits the polygons again whose vertices were not known: each is a fan until then.
  void finish() {
    std::vector<std::array<uint32_t, 3>> triangles;
    std::vector<uint32_t> corners;
    for (const auto& [first, n, face] : early_) {
      corners = {mesh_.triangles[first][0], mesh_.triangles[first][1]};
      for (size_t i = 0; i < n - 2; ++i) corners.push_back(mesh_.triangles[first + i][2]);
      triangles.clear();
      split(corners, face, triangles);
      std::copy(triangles.begin(), triangles.end(), mesh_.triangles.begin() + static_cast<std::ptrdiff_t>(first));
    }
  }

 private:
  void split(std::span<const uint32_t> corners, uint64_t face, std::vector<std::array<uint32_t, 3>>& triangles) const {
    try {
      add_polygon(corners, mesh_.positions, triangles);
    } catch (const Error& error) {
      fail_ply(fmt::format("face {}: {}", face, error.what()));
    }
  }

  struct Early {
    size_t first_triangle, n_corners;
    uint64_t face;
  };
  MeshData& mesh_;
  std::vector<Early> early_;
};

}  // namespace covary
