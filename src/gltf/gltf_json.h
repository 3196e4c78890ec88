// SPDX-License-Identifier: Apache-2.0
// The JSON of a glTF file, before tinygltf reads it. Removed is what changes no still picture but stops tinygltf in
// files that are valid or nearly so (animations of pointers, which have no node), and what is read here instead:
// images, which may be in formats that it does not know, and what compressed meshes replace.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace covary {

struct GltfImage {
  std::string name, uri;
  int view = -1;  ///< buffer view, if there is no URI
};

struct GltfJson {
  std::string bytes;  ///< for tinygltf: JSON, or a binary file if the given one is
  bool is_binary = false, is_animated = false;
  std::vector<GltfImage> images;
};

/// Throws Error(kInput) if the file is damaged, or of another version than 2.
GltfJson prepare_gltf(std::string_view bytes, const std::string& name);

/// The bytes of a data URI, in base64 or percent-encoded; empty if there are none.
std::string bytes_of_data_uri(std::string_view uri);

/// The file name in a URI, with percent-encoding decoded.
std::string file_of_uri(std::string_view uri);

}  // namespace covary
