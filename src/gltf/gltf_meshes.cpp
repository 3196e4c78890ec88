// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "gltf/gltf_compression.h"

namespace covary {
namespace {

using Numbers = std::vector<double>;

/// Triangle indices, three each, from the vertex order of a list, strip or fan.
Numbers triangles_of(const Numbers& order, int mode) {
  if (mode == TINYGLTF_MODE_TRIANGLES) return order;
  Numbers corners;
  for (size_t i = 2; i < order.size(); ++i) {
    const bool fan = mode == TINYGLTF_MODE_TRIANGLE_FAN, odd = i % 2 == 1;
    corners.push_back(fan ? order[0] : order[i - (odd ? 1 : 2)]);
    corners.push_back(fan ? order[i - 1] : order[i - (odd ? 2 : 1)]);
    corners.push_back(order[i]);
  }
  return corners;
}

/// The attributes of a primitive, in accessors or compressed by Draco.
class Primitive {
 public:
  Primitive(GltfFile& file, const tinygltf::Primitive& given, const std::string& what)
      : file_(file), given_(given), what_(what), khr_(find_extension(given.extensions, "KHR_draco_mesh_compression")) {
    if (khr_) decompress();
  }

  bool failed() const { return failed_; }
  bool has(const std::string& name) const { return given_.attributes.contains(name); }
  /// Numbers of an element; 0 if the attribute is absent.
  int width(const std::string& name) {
    const auto found = given_.attributes.find(name);
    const tinygltf::Accessor* a =
        found == given_.attributes.end() ? nullptr : file_.find_accessor(found->second, what_);
    return a ? tinygltf::GetNumComponentsInType(static_cast<uint32_t>(a->type)) : 0;
  }
  /// One element per vertex; empty if absent, or after an error.
  Numbers attribute(const std::string& name, int width) {
    if (!has(name)) return {};
    const int accessor = given_.attributes.at(name);
    Numbers values = compressed(name, accessor, width);
    if (values.empty()) values = file_.numbers(accessor, width, what_ + ": " + name);
    const size_t n = values.size() / static_cast<size_t>(width);
    if (n_vertices_ == 0) n_vertices_ = n;
    if (n > 0 && n != n_vertices_)
      file_.error(fmt::format("{}: {} has {} elements, but there are {} vertices", what_, name, n, n_vertices_));
    failed_ = failed_ || n == 0 || n != n_vertices_;
    return values;
  }
  /// Triangle indices; empty after an error or a warning.
  Numbers corners() {
    if (khr_) return mesh_.corners;
    Numbers order(n_vertices_);
    std::iota(order.begin(), order.end(), 0.0);
    if (given_.indices >= 0) order = file_.numbers(given_.indices, 1, what_ + ": indices");
    for (const double index : order)
      if (!(index >= 0 && index < static_cast<double>(n_vertices_))) {
        file_.error(fmt::format("{}: index {}; there are {} vertices", what_, index, n_vertices_));
        return {};
      }
    Numbers corners = triangles_of(order, given_.mode < 0 ? TINYGLTF_MODE_TRIANGLES : given_.mode);
    if (corners.size() % 3 != 0) {
      file_.error(fmt::format("{}: has {} indices, which are no triangles", what_, corners.size()));
      return {};
    }
    if (corners.empty() && !order.empty()) file_.warn(fmt::format("{}: has no triangles", what_));
    return corners;
  }

 private:
  void decompress() {
    try {
      const std::string_view bytes = file_.bytes_of_view(extension_index(*khr_, "bufferView"), what_);
      std::vector<int> ids;
      const tinygltf::Value& names = khr_->Get("attributes");
      if (names.IsObject())
        for (const std::string& name : names.Keys()) ids.push_back(extension_index(names, name));
      failed_ = bytes.empty();
      if (!failed_) mesh_ = decode_draco(bytes, ids);
      n_vertices_ = mesh_.n_vertices;
    } catch (const Error& problem) {
      file_.error(fmt::format("{}: {}", what_, problem.what()));
      failed_ = true;
    }
  }
  /// Empty if the attribute is not compressed.
  Numbers compressed(const std::string& name, int accessor, int width) {
    if (!khr_ || failed_) return {};
    const auto found = mesh_.attributes.find(extension_index(khr_->Get("attributes"), name));
    const tinygltf::Accessor* a = file_.find_accessor(accessor, what_);
    if (found == mesh_.attributes.end() || found->second.width != width || !a) return {};
    Numbers values = found->second.values;
    static constexpr double kLargest[] = {127, 255, 32767, 65535};
    const int type = a->componentType - TINYGLTF_COMPONENT_TYPE_BYTE;
    if (a->normalized && type >= 0 && type < 4 && *std::max_element(values.begin(), values.end()) > 1)
      for (double& value : values) value = std::max(value / kLargest[type], -1.0);
    return values;
  }

  GltfFile& file_;
  const tinygltf::Primitive& given_;
  std::string what_;
  const tinygltf::Value* khr_;
  DracoMesh mesh_;
  size_t n_vertices_ = 0;
  bool failed_ = false;
};

/// Adds the weighted differences of the morph targets.
void morph(GltfFile& file, const tinygltf::Primitive& primitive, std::span<const double> weights,
           const std::string& what, EmbeddedMesh& mesh) {
  for (size_t t = 0; t < std::min(primitive.targets.size(), weights.size()); ++t) {
    if (weights[t] == 0) continue;
    for (const auto& [name, values] : {std::pair("POSITION", &mesh.positions), std::pair("NORMAL", &mesh.normals)}) {
      const auto found = primitive.targets[t].find(name);
      if (found == primitive.targets[t].end() || values->empty()) continue;
      const Numbers moves = file.numbers(found->second, 3, fmt::format("{}: morph target {}", what, t));
      for (size_t i = 0; i < std::min(moves.size(), values->size()); ++i) (*values)[i] += weights[t] * moves[i];
    }
  }
}

/// Moves tangents, whose fourth number is their side, by a matrix for each vertex.
void turn(double* tangent, const Matrix4& m) {
  const double given[3] = {tangent[0], tangent[1], tangent[2]};
  for (size_t i = 0; i < 3; ++i) tangent[i] = m[i][0] * given[0] + m[i][1] * given[1] + m[i][2] * given[2];
}

/// Texture coordinates whose v points upwards; downwards in the file.
Numbers coordinates(Primitive& primitive, int set) {
  Numbers uvs = primitive.attribute(fmt::format("TEXCOORD_{}", set), 2);
  for (size_t i = 1; i < uvs.size(); i += 2) uvs[i] = 1 - uvs[i];
  return uvs;
}

/// Moves each vertex by the weighted mean of its joints; normals by its inverse transpose.
void skin(Primitive& primitive, std::span<const Transform> joints, EmbeddedMesh& mesh) {
  const size_t n = mesh.positions.size() / 3;
  std::vector<Matrix4> blended(n, Matrix4{});
  Numbers sums(n);
  for (int set = 0; primitive.has(fmt::format("JOINTS_{}", set)); ++set) {
    const Numbers indices = primitive.attribute(fmt::format("JOINTS_{}", set), 4);
    const Numbers weights = primitive.attribute(fmt::format("WEIGHTS_{}", set), 4);
    if (primitive.failed() || weights.size() != indices.size()) return;
    for (size_t i = 0; i < indices.size(); ++i) {
      const auto joint = static_cast<size_t>(std::max(indices[i], 0.0));
      if (joint >= joints.size() || weights[i] == 0) continue;
      const Matrix4& m = joints[joint].matrix();
      for (size_t row = 0; row < 3; ++row)
        for (size_t k = 0; k < 4; ++k) blended[i / 4][row][k] += weights[i] * m[row][k];
      sums[i / 4] += weights[i];
    }
  }
  for (size_t v = 0; v < n; ++v) {
    if (!(sums[v] > 0)) continue;
    const Matrix4& m = blended[v];
    const Numbers p(mesh.positions.begin() + static_cast<ptrdiff_t>(3 * v),
                    mesh.positions.begin() + static_cast<ptrdiff_t>(3 * v + 3));
    for (size_t i = 0; i < 3; ++i)
      mesh.positions[3 * v + i] = (m[i][0] * p[0] + m[i][1] * p[1] + m[i][2] * p[2] + m[i][3]) / sums[v];
    if (!mesh.tangents.empty()) turn(&mesh.tangents[4 * v], m);
    if (mesh.normals.empty()) continue;
    double* normal = &mesh.normals[3 * v];
    const double given[3] = {normal[0], normal[1], normal[2]};
    for (size_t i = 0; i < 3; ++i) {  // by the cofactors
      const size_t a = (i + 1) % 3, b = (i + 2) % 3;
      normal[i] = 0;
      for (size_t k = 0; k < 3; ++k) {
        const size_t c = (k + 1) % 3, d = (k + 2) % 3;
        normal[i] += (m[a][c] * m[b][d] - m[a][d] * m[b][c]) * given[k];
      }
    }
    const double length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (size_t i = 0; i < 3 && length > 0; ++i) normal[i] /= length;
  }
}

/// Splits COLOR_0 into colours and, if one is not opaque, alphas.
bool read_colours(Primitive& primitive, EmbeddedMesh& mesh) {
  const int width = primitive.width("COLOR_0");
  if (width != 3 && width != 4) return false;
  const Numbers given = primitive.attribute("COLOR_0", width);
  bool transparent = false;
  for (size_t i = 0; i < given.size(); i += static_cast<size_t>(width)) {
    for (size_t c = 0; c < 3; ++c) mesh.colours.push_back(std::clamp(given[i + c], 0.0, 1.0));
    if (width == 4) mesh.alphas.push_back(std::clamp(given[i + 3], 0.0, 1.0));
    transparent = transparent || (width == 4 && mesh.alphas.back() < 1);
  }
  if (!transparent) mesh.alphas.clear();
  if (std::all_of(mesh.colours.begin(), mesh.colours.end(), [](double x) { return x == 1; })) mesh.colours.clear();
  return transparent;
}

}  // namespace

std::optional<GltfMesh> read_gltf_mesh(GltfFile& file, const tinygltf::Primitive& given, const GltfSets& sets,
                                       const GltfPose& pose, const std::string& what) {
  if (given.mode >= 0 && given.mode < TINYGLTF_MODE_TRIANGLES) {
    file.warn(fmt::format("{}: points and lines are left out", what));
    return std::nullopt;
  }
  Primitive primitive(file, given, what);
  if (!primitive.has("POSITION")) {
    file.warn(fmt::format("{}: has no positions", what));
    return std::nullopt;
  }
  GltfMesh result;
  EmbeddedMesh& mesh = result.mesh;
  mesh.positions = primitive.attribute("POSITION", 3);
  mesh.normals = primitive.attribute("NORMAL", 3);
  mesh.uvs = coordinates(primitive, sets.own);
  for (const int set : sets.others) {
    Numbers& others = mesh.pairs[fmt::format("uv{}", set)] = coordinates(primitive, set);
    if (others.empty()) others.resize(mesh.positions.size() / 3 * 2);
  }
  if (sets.tangents && !mesh.normals.empty() && primitive.width("TANGENT") == 4)
    mesh.tangents = primitive.attribute("TANGENT", 4);
  result.transparent = read_colours(primitive, mesh);
  morph(file, given, pose.weights, what, mesh);
  if (!pose.joints.empty()) skin(primitive, pose.joints, mesh);
  if (primitive.failed()) return std::nullopt;
  mesh.corners = primitive.corners();
  if (mesh.corners.empty()) return std::nullopt;
  result.smooth = !mesh.normals.empty();
  return result;
}

}  // namespace covary
