// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_nodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace covary {
namespace {

using Numbers = std::vector<double>;

Transform from_columns(const double* numbers) {
  Matrix4 m{};
  for (size_t i = 0; i < 16; ++i) m[i % 4][i / 4] = numbers[i];
  return Transform(m);
}

/// Throws Error(kInput) if it is singular.
Transform from_parts(const Numbers& t, Numbers q, const Numbers& s) {
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(norm > 0)) throw Error(ErrorCode::kInput, "the rotation is zero");
  for (double& x : q) x /= norm;
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
  Matrix4 m = Transform().matrix();
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k) m[i][k] = r[i][k] * s[k];
    m[i][3] = t[i];
  }
  return Transform(m);
}

Transform transform_of(const tinygltf::Node& node) {
  if (node.matrix.size() == 16) return from_columns(node.matrix.data());
  const auto or_else = [](const Numbers& given, Numbers fallback) {
    return given.size() == fallback.size() ? given : fallback;
  };
  return from_parts(or_else(node.translation, {0, 0, 0}), or_else(node.rotation, {0, 0, 0, 1}),
                    or_else(node.scale, {1, 1, 1}));
}

}  // namespace

GltfNodes::GltfNodes(GltfFile& file) : file_(file), world_(file.model().nodes.size()) {
  std::vector<bool> seen(world_.size());
  std::vector<Place> open;
  const auto push = [&](const std::vector<int>& nodes, const Transform& to_world) {
    for (auto it = nodes.rbegin(); it != nodes.rend(); ++it) open.push_back({*it, to_world});
  };
  push(roots(), Transform());
  while (!open.empty()) {
    const Place place = open.back();
    open.pop_back();
    if (place.node < 0 || static_cast<size_t>(place.node) >= seen.size() || seen[place.node]) {
      file_.error(fmt::format("node {} is not there, or has several parents", place.node));
      continue;
    }
    seen[place.node] = true;
    const tinygltf::Node& node = file_.model().nodes[place.node];
    try {
      const Transform to_world = place.to_world * transform_of(node);
      // The test for singularity uses the 16 numbers.
      places_.push_back({place.node, place.to_world.is_identity() ? to_world : Transform(to_world.matrix())});
      world_[place.node] = places_.back().to_world;
      push(node.children, to_world);
    } catch (const Error& error) {
      file_.warn(fmt::format("node {} '{}' is left out: {}", place.node, node.name, error.what()));
    }
  }
}

std::vector<int> GltfNodes::roots() const {
  const tinygltf::Model& model = file_.model();
  if (!model.scenes.empty()) {
    const int scene = model.defaultScene;
    return model.scenes[scene >= 0 && static_cast<size_t>(scene) < model.scenes.size() ? scene : 0].nodes;
  }
  std::vector<bool> is_child(model.nodes.size());
  for (const tinygltf::Node& node : model.nodes)
    for (const int child : node.children)
      if (child >= 0 && static_cast<size_t>(child) < is_child.size()) is_child[child] = true;
  std::vector<int> all;
  for (size_t i = 0; i < is_child.size(); ++i)
    if (!is_child[i]) all.push_back(static_cast<int>(i));
  return all;
}

std::vector<Transform> GltfNodes::joints(int skin) {
  const tinygltf::Model& model = file_.model();
  if (skin < 0 || static_cast<size_t>(skin) >= model.skins.size()) return {};
  const tinygltf::Skin& given = model.skins[skin];
  const std::string what = fmt::format("skin {} '{}'", skin, given.name);
  const Numbers inverse =
      given.inverseBindMatrices >= 0 ? file_.numbers(given.inverseBindMatrices, 16, what) : Numbers();
  std::vector<Transform> joints;
  for (size_t i = 0; i < given.joints.size(); ++i) {
    const int node = given.joints[i];
    if (node < 0 || static_cast<size_t>(node) >= world_.size() || !world_[node]) {
      file_.warn(what + " has joints that are not in the scene: its meshes are as they are before they are deformed");
      return {};
    }
    try {
      const bool has_inverse = inverse.size() >= 16 * (i + 1);
      joints.push_back(has_inverse ? *world_[node] * from_columns(&inverse[16 * i]) : *world_[node]);
    } catch (const Error& error) {
      file_.warn(fmt::format("{}, joint {}: {}", what, i, error.what()));
      return {};
    }
  }
  return joints;
}

std::vector<Transform> GltfNodes::instances(const tinygltf::Node& node) {
  const tinygltf::Value* khr = find_extension(node.extensions, "EXT_mesh_gpu_instancing");
  if (!khr) return {};
  const std::string what = fmt::format("the instances of node '{}'", node.name);
  size_t n = 0;
  const auto read = [&](const char* name, int width) {
    const int accessor = extension_index(khr->Get("attributes"), name);
    const Numbers values = accessor < 0 ? Numbers() : file_.numbers(accessor, width, what);
    n = std::max(n, values.size() / static_cast<size_t>(width));
    return values;
  };
  const Numbers t = read("TRANSLATION", 3), q = read("ROTATION", 4), s = read("SCALE", 3);
  const auto part = [](const Numbers& values, size_t i, Numbers fallback) {
    const size_t width = fallback.size();
    for (size_t k = 0; k < width && (i + 1) * width <= values.size(); ++k) fallback[k] = values[i * width + k];
    return fallback;
  };
  std::vector<Transform> places;
  for (size_t i = 0; i < n; ++i) try {
      places.push_back(from_parts(part(t, i, {0, 0, 0}), part(q, i, {0, 0, 0, 1}), part(s, i, {1, 1, 1})));
    } catch (const Error& error) {
      file_.warn(fmt::format("{}: number {} is left out: {}", what, i, error.what()));
    }
  return places;
}

}  // namespace covary
