// SPDX-License-Identifier: Apache-2.0
// glTF materials: `metallicroughness`, with textures, opacity, normal maps and emission.
#pragma once

#include <map>
#include <memory>

#include "formats/object_builder.h"
#include "gltf/gltf_file.h"

namespace covary {

class GltfTextures;

class GltfMaterials {
 public:
  explicit GltfMaterials(GltfFile& file);
  ~GltfMaterials();

  /// The reflectance model of a material; glTF's default for -1.
  ObjectPtr model(int material);
  /// The emission of surfaces with this material; null if none.
  ObjectPtr light(int material);
  /// The set of texture coordinates used by all its textures.
  int texture_set(int material);

 private:
  const tinygltf::Material& of(int material) const;
  ObjectPtr make(const tinygltf::Material& material);
  ObjectBuilder surface(const tinygltf::Material& material);
  /// Sets a colour, or one channel of an image (0 to 3: R, G, B, A), times `factor`; the image counts if there is one.
  void set_colour(ObjectDescription& model, const char* name, const tinygltf::TextureInfo& image,
                  const Spectrum& factor);
  void set_number(ObjectDescription& model, const char* name, const tinygltf::TextureInfo& image, int channel,
                  double factor);
  ObjectPtr with_normals(const tinygltf::Material& material, ObjectPtr model);
  ObjectPtr with_opacity(const tinygltf::Material& material, ObjectPtr model);

  GltfFile& file_;
  std::unique_ptr<GltfTextures> textures_;
  tinygltf::Material default_;
  std::map<int, ObjectPtr> models_, lights_;
};

}  // namespace covary
