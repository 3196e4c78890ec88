// SPDX-License-Identifier: Apache-2.0
#include "formats/object_builder.h"

#include <fmt/format.h>
#include <cstdint>
#include <cstring>

namespace covary {

ObjectBuilder make_object(const std::string& kind, const std::string& type, const SourceLocation& where,
                          std::initializer_list<std::pair<std::string, Value>> properties) {
  auto object = std::make_shared<ObjectDescription>();
  object->kind = kind, object->type = type, object->where = where;
  for (const auto& [name, value] : properties) set_property(*object, name, value);
  return object;
}

void set_property(ObjectDescription& object, const std::string& name, Value value) {
  if (const Transform* transform = std::get_if<Transform>(&value)) {
    try {
      value = Transform(transform->matrix()) * Transform();  // as for <matrix> in XML
    } catch (const Error&) {                                 // scaled down so much that it appears singular
    }
  }
  object.properties.push_back({name, std::move(value), object.where});
}

namespace {

template <typename T>
void append(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

}  // namespace

std::string ply_text(const EmbeddedMesh& mesh) {
  const size_t n = mesh.positions.size() / 3;
  std::string text = fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", n);
  for (const char* name : {"x", "y", "z"}) text += fmt::format("property float {}\n", name);
  if (!mesh.normals.empty()) text += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!mesh.uvs.empty()) text += "property float u\nproperty float v\n";
  if (!mesh.colours.empty()) text += "property float r\nproperty float g\nproperty float b\n";
  if (!mesh.alphas.empty()) text += "property float alpha\n";
  if (!mesh.tangents.empty()) text += "property float tx\nproperty float ty\nproperty float tz\nproperty float tw\n";
  for (const auto& [name, values] : mesh.pairs)
    for (int c = 0; c < 3; ++c) text += fmt::format("property float {}_{}\n", name, c);
  text += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.corners.size() / 3);
  const auto add = [&](const std::vector<double>& values, size_t i, size_t width) {
    for (size_t k = 0; k < width && !values.empty(); ++k) append(text, static_cast<float>(values[i * width + k]));
  };
  for (size_t i = 0; i < n; ++i) {
    add(mesh.positions, i, 3), add(mesh.normals, i, 3), add(mesh.uvs, i, 2);
    add(mesh.colours, i, 3), add(mesh.alphas, i, 1), add(mesh.tangents, i, 4);
    for (const auto& [name, values] : mesh.pairs) add(values, i, 2), append(text, 0.0f);
  }
  for (size_t i = 0; i < mesh.corners.size(); ++i) {
    if (i % 3 == 0) append(text, uint8_t{3});
    append(text, static_cast<int32_t>(mesh.corners[i]));
  }
  return text;
}

}  // namespace covary
