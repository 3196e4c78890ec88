// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_meshes.h"

#include <fmt/format.h>

#include <numeric>

namespace covary {
namespace {

/// Triangle indices, three each, from the vertex order of a list, strip or fan.
std::vector<double> triangles_of(const std::vector<double>& order, int mode) {
  if (mode == TINYGLTF_MODE_TRIANGLES) return order;
  std::vector<double> corners;
  for (size_t i = 2; i < order.size(); ++i) {
    const bool fan = mode == TINYGLTF_MODE_TRIANGLE_FAN, odd = i % 2 == 1;
    corners.push_back(fan ? order[0] : order[i - (odd ? 1 : 2)]);
    corners.push_back(fan ? order[i - 1] : order[i - (odd ? 2 : 1)]);
    corners.push_back(order[i]);
  }
  return corners;
}

/// An attribute with one element per vertex; empty if absent, nullopt after an error.
std::optional<std::vector<double>> attribute(GltfFile& file, const tinygltf::Primitive& primitive, const char* name,
                                             int width, size_t n_vertices, const std::string& what) {
  const auto found = primitive.attributes.find(name);
  if (found == primitive.attributes.end()) return std::vector<double>();
  std::vector<double> values = file.numbers(found->second, width, fmt::format("{}: {}", what, name));
  if (values.empty()) return std::nullopt;
  if (n_vertices > 0 && values.size() != n_vertices * width) {
    file.error(fmt::format("{}: {} has {} elements, but there are {} vertices", what, name, values.size() / width,
                           n_vertices));
    return std::nullopt;
  }
  return values;
}

/// Triangle indices; empty after an error or a warning.
std::vector<double> read_corners(GltfFile& file, const tinygltf::Primitive& primitive, size_t n_vertices,
                                 const std::string& what) {
  std::vector<double> order(n_vertices);
  std::iota(order.begin(), order.end(), 0.0);
  if (primitive.indices >= 0) order = file.numbers(primitive.indices, 1, what + ": indices");
  for (const double index : order)
    if (!(index >= 0 && index < static_cast<double>(n_vertices))) {
      file.error(fmt::format("{}: index {}; there are {} vertices", what, index, n_vertices));
      return {};
    }
  std::vector<double> corners = triangles_of(order, primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode);
  if (corners.size() % 3 != 0) {
    file.error(fmt::format("{}: has {} indices, which are no triangles", what, corners.size()));
    return {};
  }
  if (corners.empty() && !order.empty()) file.warn(fmt::format("{}: has no triangles", what));
  return corners;
}

}  // namespace

std::optional<GltfMesh> read_gltf_mesh(GltfFile& file, const tinygltf::Primitive& primitive, int texture_set,
                                       const std::string& what) {
  if (primitive.mode >= 0 && primitive.mode < TINYGLTF_MODE_TRIANGLES) {
    file.warn(fmt::format("{}: points and lines are left out", what));
    return std::nullopt;
  }
  for (const char* extension : {"KHR_draco_mesh_compression", "EXT_meshopt_compression"})
    if (primitive.extensions.contains(extension)) {
      file.error(fmt::format("{}: is compressed; export without compression of meshes", what));
      return std::nullopt;
    }
  GltfMesh result;
  EmbeddedMesh& mesh = result.mesh;
  auto positions = attribute(file, primitive, "POSITION", 3, 0, what);
  if (!positions) return std::nullopt;
  if (positions->empty()) {
    file.warn(fmt::format("{}: has no positions", what));
    return std::nullopt;
  }
  const size_t n = positions->size() / 3;
  auto normals = attribute(file, primitive, "NORMAL", 3, n, what);
  auto uvs = attribute(file, primitive, fmt::format("TEXCOORD_{}", texture_set).c_str(), 2, n, what);
  if (!normals || !uvs) return std::nullopt;
  for (size_t i = 1; i < uvs->size(); i += 2) (*uvs)[i] = 1 - (*uvs)[i];  // v points downwards in the file
  if (primitive.attributes.contains("COLOR_0")) file.warn(fmt::format("{}: colours of vertices are not read", what));
  if (!primitive.targets.empty()) file.warn(fmt::format("{}: is taken as it is before it is deformed", what));
  mesh.positions = std::move(*positions), mesh.normals = std::move(*normals), mesh.uvs = std::move(*uvs);
  mesh.corners = read_corners(file, primitive, n, what);
  if (mesh.corners.empty()) return std::nullopt;
  result.smooth = !mesh.normals.empty();
  return result;
}

}  // namespace covary
