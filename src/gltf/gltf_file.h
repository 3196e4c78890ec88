// SPDX-License-Identifier: Apache-2.0
// A glTF 2.0 file read with tinygltf, and its diagnostics.
#pragma once

#include <tiny_gltf.h>

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "formats/file_resolver.h"
#include "scene/parameters.h"

namespace covary {

class GltfFile {
 public:
  /// Reads JSON (.gltf) or binary files (.glb) with their buffers; images stay encoded. Throws Error(kInput).
  GltfFile(std::string_view bytes, const std::string& name, FileResolver& files, Diagnostics& diagnostics);

  const tinygltf::Model& model() const { return model_; }
  const SourceLocation& where() const { return where_; }
  void error(const std::string& message);
  /// Registers another file that is read, for the hash of the scene; an error if it is missing.
  void reads(const std::string& uri);
  /// Each message is reported once.
  void warn(const std::string& message);

  /// The values of an accessor with `width` numbers per element; normalised integers are scaled to [0, 1] or [-1, 1].
  /// Empty after an error, which names `what`.
  std::vector<double> numbers(int accessor, int width, const std::string& what);
  /// The bytes of a buffer view; empty after an error.
  std::string_view bytes_of_view(int view, const std::string& what);

 private:
  void check_extensions();

  tinygltf::Model model_;
  SourceLocation where_;
  FileResolver& files_;
  Diagnostics& diagnostics_;
  std::set<std::string> warned_;
};

/// The file name in a URI, with percent-encoding decoded.
std::string file_of_uri(const std::string& uri);
/// An extension's object; null if absent.
const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const std::string& name);
/// The texture `name` of an extension, if it has one.
std::optional<tinygltf::TextureInfo> extension_texture(const tinygltf::Value& extension, const std::string& name);
double extension_number(const tinygltf::Value& extension, const std::string& name, double fallback);

}  // namespace covary
