// SPDX-License-Identifier: Apache-2.0
// A glTF 2.0 file read with tinygltf, and its diagnostics.
#pragma once

#include <tiny_gltf.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "formats/file_resolver.h"
#include "gltf/gltf_json.h"
#include "scene/parameters.h"

namespace covary {

class GltfFile {
 public:
  /// Reads JSON (.gltf) or binary files (.glb) with their buffers, not their images. Throws Error(kInput).
  GltfFile(std::string_view bytes, const std::string& name, FileResolver& files, Diagnostics& diagnostics);

  const tinygltf::Model& model() const { return model_; }
  const std::vector<GltfImage>& images() const { return images_; }
  const std::vector<GltfAnimation>& animations() const { return animations_; }
  /// Animations move other properties than those of nodes.
  bool moves_pointers() const { return moves_pointers_; }
  tinygltf::Node& node(int node) { return model_.nodes[static_cast<size_t>(node)]; }
  const SourceLocation& where() const { return where_; }
  void error(const std::string& message);
  /// Each message is reported once.
  void warn(const std::string& message);

  /// The values of an accessor with `width` numbers per element; normalised integers are scaled to [0, 1] or [-1, 1].
  /// Empty after an error, which names `what`.
  std::vector<double> numbers(int accessor, int width, const std::string& what);
  /// The accessor; null after an error.
  const tinygltf::Accessor* find_accessor(int accessor, const std::string& what);
  /// The bytes of a buffer view, decompressed; empty after an error.
  std::string_view bytes_of_view(int view, const std::string& what);
  /// The encoded image; empty after an error.
  std::string bytes_of_image(int image);
  /// The path of an image in a file of its own; empty if there is none, after an error if the file is missing.
  std::string path_of_image(int image);

 private:
  void check_extensions();
  std::string_view bytes_of_buffer(size_t buffer, size_t offset, size_t length, const std::string& what);
  std::string_view decompressed(size_t view, const tinygltf::Value& khr, const std::string& what);
  /// `size` bytes for each of the elements: values of one accessor, or of its sparse part.
  std::vector<double> dense(int view, size_t offset, size_t count, int width, int component_type, bool normalized,
                            const std::string& what);

  tinygltf::Model model_;
  std::vector<GltfImage> images_;
  std::vector<GltfAnimation> animations_;
  bool moves_pointers_ = false;
  SourceLocation where_;
  FileResolver& files_;
  Diagnostics& diagnostics_;
  std::set<std::string> warned_;
  std::map<size_t, std::string> decompressed_;  // by buffer view; empty after an error
};

/// An extension's object; null if absent.
const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const std::string& name);
/// The texture `name` of an extension, if it has one.
std::optional<tinygltf::TextureInfo> extension_texture(const tinygltf::Value& extension, const std::string& name);
double extension_number(const tinygltf::Value& extension, const std::string& name, double fallback);
/// The whole number `name`, or -1.
int extension_index(const tinygltf::Value& extension, const std::string& name);

}  // namespace covary
