// SPDX-License-Identifier: Apache-2.0
// Compressed parts of glTF files, by the libraries that covary was built with: meshoptimizer, Draco, WebP.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace covary {

/// Decodes `count` elements of `stride` bytes (EXT_meshopt_compression). `mode`: ATTRIBUTES, TRIANGLES or INDICES;
/// `filter`: NONE or empty, OCTAHEDRAL, QUATERNION, EXPONENTIAL. Throws Error(kInput) if the data are damaged, or the
/// library is missing.
std::string decode_meshopt(std::string_view bytes, size_t count, size_t stride, const std::string& mode,
                           const std::string& filter);

struct DracoMesh {
  size_t n_vertices = 0;
  std::vector<double> corners;  ///< three indices per triangle
  struct Attribute {
    int width = 0;
    std::vector<double> values;  ///< as stored: integers are not scaled
  };
  std::map<int, Attribute> attributes;  ///< by the identifier in the extension
};
/// Decodes a mesh (KHR_draco_mesh_compression) with the attributes of these identifiers. Throws Error(kInput) if the
/// data are damaged, an attribute is missing, or the library is.
DracoMesh decode_draco(std::string_view bytes, const std::vector<int>& attributes);

struct WebpImage {
  int width = 0, height = 0;
  std::vector<uint8_t> rgba;  ///< empty: damaged, or the library is missing
};
bool is_webp(std::string_view bytes);
bool reads_webp();
/// Width and height from the header; zeros if that is damaged.
WebpImage webp_size(std::string_view bytes);
WebpImage decode_webp(std::string_view bytes);

}  // namespace covary
