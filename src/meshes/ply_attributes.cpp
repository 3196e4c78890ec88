// SPDX-License-Identifier: Apache-2.0
// Names of attributes in PLY files follow Mitsuba: properties with a common prefix are channels of one attribute.
#include "meshes/ply_attributes.h"

#include <algorithm>
#include <vector>

namespace covary {
namespace {

PlyProperty* find(PlyElement& element, const std::string& name) {
  for (PlyProperty& p : element.properties)
    if (p.name == name && !p.is_list) return &p;
  return nullptr;
}

/// The properties that make up the attribute; empty if they are absent.
std::vector<PlyProperty*> channels_of(PlyElement& element, const std::string& prefix) {
  static const char* const kSuffixes[][3] = {{"0", "1", "2"}, {"1", "2", "3"}, {"x", "y", "z"}, {"r", "g", "b"}};
  const auto all = [&](const std::string& a, const std::string& b, const std::string& c) {
    std::vector<PlyProperty*> found = {find(element, a), find(element, b), find(element, c)};
    if (std::find(found.begin(), found.end(), nullptr) != found.end()) found.clear();
    return found;
  };
  for (const auto& s : kSuffixes)
    if (auto found = all(prefix + "_" + s[0], prefix + "_" + s[1], prefix + "_" + s[2]); !found.empty()) return found;
  if (prefix == "color") {
    if (auto found = all("r", "g", "b"); !found.empty()) return found;
    if (auto found = all("red", "green", "blue"); !found.empty()) return found;
  }
  if (PlyProperty* one = find(element, prefix)) return {one};
  for (const auto& s : kSuffixes)
    if (PlyProperty* one = find(element, prefix + "_" + s[0]); one && !find(element, prefix + "_" + s[1])) return {one};
  return {};
}

}  // namespace

void assign_attributes(PlyElement& element, std::span<const std::string> wanted, MeshData& mesh) {
  const std::string kind = element.name + "_";
  for (const std::string& name : wanted) {
    if (!name.starts_with(kind) || name == "vertex_color") continue;
    const std::vector<PlyProperty*> channels = channels_of(element, name.substr(kind.size()));
    if (channels.empty()) continue;
    for (size_t c = 0; c < channels.size(); ++c) {
      if (channels[c]->attribute >= 0) continue;  // already belongs to another attribute
      channels[c]->attribute = static_cast<int>(mesh.attributes.size()), channels[c]->channel = static_cast<int>(c);
    }
    mesh.attributes.push_back({name, element.name == "face", static_cast<int>(channels.size()), {}});
  }
}

}  // namespace covary
