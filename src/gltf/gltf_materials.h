// SPDX-License-Identifier: Apache-2.0
// glTF materials: `metallicroughness`, with textures, opacity, normal maps, emission and what is inside.
#pragma once

#include <compare>
#include <map>
#include <memory>
#include <set>

#include "formats/object_builder.h"
#include "gltf/gltf_file.h"

namespace covary {

struct GltfUse;
class GltfTextures;

/// What the vertices of a mesh multiply the base colour by.
struct GltfColours {
  bool colours = false, alphas = false;
  auto operator<=>(const GltfColours&) const = default;
};

/// What a material needs of its meshes.
struct GltfSets {
  int own = 0;            ///< the set of texture coordinates that normal maps follow
  std::set<int> others;   ///< further ones, as attributes
  bool tangents = false;  ///< it depends on the direction of the coordinates
};

class GltfMaterials {
 public:
  explicit GltfMaterials(GltfFile& file);
  ~GltfMaterials();

  /// The reflectance model of a material; glTF's default for -1.
  ObjectPtr model(int material, const GltfColours& vertices);
  /// The emission of surfaces with this material; null if none.
  ObjectPtr light(int material, const GltfColours& vertices);
  /// What solids of this material absorb; null if nothing.
  ObjectPtr medium(int material);
  GltfSets sets(int material) const { return sets_of(of(material)); }

 private:
  using Key = std::pair<int, GltfColours>;

  const tinygltf::Material& of(int material) const;
  ObjectPtr make(const tinygltf::Material& material, const GltfColours& vertices);
  ObjectPtr make_light(const tinygltf::Material& material, const GltfColours& vertices);
  ObjectPtr lit_model(const tinygltf::Material& material, const GltfColours& vertices);
  ObjectBuilder surface(const tinygltf::Material& material, const GltfColours& vertices);
  void set_layers(const tinygltf::Material& material, ObjectDescription& model);
  void set_transmission(const tinygltf::Material& material, ObjectDescription& model);
  ObjectBuilder specular_glossiness(const tinygltf::Value& khr, const GltfColours& vertices);
  /// A colour as a property: a texture if there is an image or there are colours of vertices.
  Value colour(const tinygltf::TextureInfo& image, const Spectrum& factor, bool vertices = false);
  void set_colour(ObjectDescription& model, const char* name, const tinygltf::TextureInfo& image,
                  const Spectrum& factor);
  /// Sets one channel of an image (0 to 3: R, G, B, A), times `factor`; the image counts if there is one.
  void set_number(ObjectDescription& model, const char* name, const tinygltf::TextureInfo& image, int channel,
                  double factor);
  ObjectPtr normal_map(int texture, int set, const tinygltf::ExtensionMap& extensions, double scale);
  void set_coat_normal(const tinygltf::Material& material, const tinygltf::Value& coat, ObjectDescription& model);
  ObjectPtr make_texture(const tinygltf::TextureInfo& image, const GltfUse& use);
  static GltfSets sets_of(const tinygltf::Material& material);
  /// A number or texture; nullopt if the surface is opaque.
  std::optional<Value> opacity(const tinygltf::Material& material, const GltfColours& vertices);

  GltfFile& file_;
  std::unique_ptr<GltfTextures> textures_;
  tinygltf::Material default_;
  std::map<Key, ObjectPtr> models_, lights_;
  std::map<int, ObjectPtr> media_;
  ObjectPtr base_normal_;  // of the material that is being made; null: none
};

}  // namespace covary
