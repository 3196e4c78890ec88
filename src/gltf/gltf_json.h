// SPDX-License-Identifier: Apache-2.0
// The JSON of a glTF file, before tinygltf reads it. Removed is what is read here instead: images, which may be in
// formats that it does not know, what compressed meshes replace, and animations, of which those of pointers, which have
// no node, stop it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace covary {

struct GltfImage {
  std::string name, uri;
  int view = -1;  ///< buffer view, if there is no URI
};

/// What moves one property of a node over time.
struct GltfChannel {
  int node = -1, input = -1, output = -1;  ///< accessors of times in seconds and of values
  std::string path;                        ///< translation, rotation, scale or weights
  std::string interpolation;               ///< LINEAR, STEP or CUBICSPLINE
};
struct GltfAnimation {
  std::string name;
  std::vector<GltfChannel> channels;
};

struct GltfJson {
  std::string bytes;  ///< for tinygltf: JSON, or a binary file if the given one is
  bool is_binary = false;
  bool moves_pointers = false;  ///< animations move other properties than those of nodes
  std::vector<GltfImage> images;
  std::vector<GltfAnimation> animations;  ///< those with channels
};

/// Throws Error(kInput) if the file is damaged, or of another version than 2.
GltfJson prepare_gltf(std::string_view bytes, const std::string& name);

/// The bytes of a data URI, in base64 or percent-encoded; empty if there are none.
std::string bytes_of_data_uri(std::string_view uri);

/// The file name in a URI, with percent-encoding decoded.
std::string file_of_uri(std::string_view uri);

}  // namespace covary
