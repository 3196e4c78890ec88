// SPDX-License-Identifier: Apache-2.0
// glTF textures as bitmaps. Images in separate files that are used unchanged stay there; others become part of the
// description: single channels, colours with a factor, embedded images, WebP.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "core/spectrum.h"
#include "formats/object_builder.h"
#include "gltf/gltf_file.h"

namespace covary {

/// How an image is used.
struct GltfUse {
  enum Kind {
    kColour,   ///< sRGB, times `factor`
    kVector,   ///< three linear channels, unchanged
    kNormal,   ///< a normal whose x and y are scaled by factor.r
    kChannel,  ///< one linear channel, times factor.r, plus `offset`
  } kind = kColour;
  int channel = 0;  ///< of kChannel; 3: alpha
  Spectrum factor{1};
  double cutoff = -1;  ///< of kChannel: 1 from this value on, otherwise 0; negative: none
  float offset = 0;
};

class GltfTextures {
 public:
  explicit GltfTextures(GltfFile& file) : file_(file) {}
  /// The texture with this index, with the extensions of its reference, at the coordinates of a set; null after an
  /// error.
  ObjectPtr make(int texture, int set, const tinygltf::ExtensionMap& extensions, const GltfUse& use);
  /// The set that meshes have as their own coordinates; they have others as attributes vertex_uvN.
  void take_as_own(int set) { own_set_ = set; }

 private:
  ObjectPtr make_bitmap(int texture, const tinygltf::ExtensionMap& extensions, const GltfUse& use);
  struct Pixels {
    int width = 0, height = 0, channels = 0;
    std::vector<uint8_t> values;
  };
  /// The image of a texture in a format that is read, if it has one; -1 after an error.
  int source_of(int texture);
  /// Null after an error.
  const Pixels* decoded(int image);
  std::string embedded(const Pixels& pixels, const GltfUse& use) const;

  GltfFile& file_;
  std::map<int, Pixels> images_;
  int own_set_ = 0;
};

/// The set of coordinates of a texture: KHR_texture_transform overrides it.
int gltf_texture_set(int set, const tinygltf::ExtensionMap& extensions);

}  // namespace covary
