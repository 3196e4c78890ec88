// SPDX-License-Identifier: Apache-2.0
// Small glTF files for tests.
#pragma once

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "imageio/png.h"

namespace covary::test_support {

using nlohmann::json;

/// Builder of a file with one buffer.
struct Gltf {
  json scene = {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", json::array()}}}}};
  std::string buffer;

  int add(const char* list, json object) {
    scene[list].push_back(std::move(object));
    return static_cast<int>(scene[list].size()) - 1;
  }
  int add_view(const std::string& bytes) {
    buffer.resize((buffer.size() + 3) / 4 * 4);
    const size_t at = buffer.size();
    buffer += bytes;
    return add("bufferViews", {{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes.size()}});
  }
  template <typename T>
  int add_accessor(const std::vector<T>& values, int component, const char* type, int width) {
    std::string bytes(values.size() * sizeof(T), '\0');
    std::memcpy(bytes.data(), values.data(), bytes.size());
    const int view = add_view(bytes);
    return add("accessors", {{"bufferView", view},
                             {"componentType", component},
                             {"type", type},
                             {"count", values.size() / static_cast<size_t>(width)}});
  }
  /// Adds a square [-1, 1]^2 in z = 0 with texture coordinates, v downwards as in glTF; returns the mesh.
  int add_square(int material, bool normals = false) {
    const int p = add_accessor<float>({-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0}, 5126, "VEC3", 3);
    const int uv = add_accessor<float>({0, 1, 1, 1, 0, 0, 1, 0}, 5126, "VEC2", 2);
    const int i = add_accessor<uint16_t>({1, 2, 0, 1, 3, 2}, 5123, "SCALAR", 1);
    json primitive = {{"attributes", {{"POSITION", p}, {"TEXCOORD_0", uv}}}, {"indices", i}, {"material", material}};
    if (normals)
      primitive["attributes"]["NORMAL"] =
          add_accessor<float>({0, 0, 1, 0, 0, 1, .3f, 0, 1, 0, .2f, 1}, 5126, "VEC3", 3);
    return add("meshes", {{"primitives", {primitive}}});
  }
  void add_root(json node) { scene["scenes"][0]["nodes"].push_back(add("nodes", std::move(node))); }
  void add_camera() {
    const int camera = add(
        "cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.7}, {"aspectRatio", 1.5}, {"znear", 0.01}}}});
    add_root({{"camera", camera}, {"translation", {0.2, 0.1, 4}}});
  }
  /// Both forms of the file.
  std::string glb() const {
    json with_buffer = scene;
    if (!buffer.empty()) with_buffer["buffers"] = {{{"byteLength", buffer.size()}}};
    std::string text = with_buffer.dump(), data = buffer;
    text.resize((text.size() + 3) / 4 * 4, ' ');
    data.resize((data.size() + 3) / 4 * 4);
    const auto word = [](uint32_t x) { return std::string(reinterpret_cast<const char*>(&x), 4); };
    std::string result = word(static_cast<uint32_t>(text.size())) + "JSON" + text;
    if (!data.empty()) result += word(static_cast<uint32_t>(data.size())) + std::string("BIN\0", 4) + data;
    return "glTF" + word(2) + word(static_cast<uint32_t>(result.size() + 12)) + result;
  }
};

/// 4 x 2 texels: red and blue increase to the right, green downwards.
inline std::string picture() {
  std::string rgb;
  for (int i = 0; i < 8; ++i)
    for (const int x : {i % 4 * 80, i / 4 * 200 + 30, 255 - i % 4 * 60}) rgb += static_cast<char>(x);
  return rgb;
}
inline std::string png() {
  const std::string rgb = picture();
  const std::vector<unsigned char> bytes = encode_png(4, 2, {rgb.begin(), rgb.end()});
  return {bytes.begin(), bytes.end()};
}

}  // namespace covary::test_support
