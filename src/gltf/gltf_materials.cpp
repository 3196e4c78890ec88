// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_materials.h"

#include <fmt/format.h>

#include <algorithm>

#include "gltf/gltf_textures.h"

namespace covary {
namespace {

Spectrum colour_of(const std::vector<double>& numbers, float fallback) {
  Spectrum colour(fallback);
  for (size_t c = 0; c < 3 && c < numbers.size(); ++c) colour[c] = std::max(static_cast<float>(numbers[c]), 0.0f);
  return colour;
}

/// The textures of extensions that are read.
constexpr std::pair<const char*, const char*> kExtensionTextures[] = {
    {"KHR_materials_specular", "specularTexture"},
    {"KHR_materials_specular", "specularColorTexture"},
    {"KHR_materials_transmission", "transmissionTexture"},
    {"KHR_materials_clearcoat", "clearcoatTexture"},
    {"KHR_materials_clearcoat", "clearcoatRoughnessTexture"}};

double in_unit(double x) { return std::clamp(x, 0.0, 1.0); }

Spectrum extension_colour(const tinygltf::Value& extension, const std::string& name, float fallback) {
  std::vector<double> numbers;
  const tinygltf::Value& value = extension.Get(name);
  for (size_t c = 0; value.IsArray() && c < value.ArrayLen(); ++c)
    numbers.push_back(value.Get(c).IsNumber() ? value.Get(c).GetNumberAsDouble() : fallback);
  return colour_of(numbers, fallback);
}

bool is_transmissive(const tinygltf::Material& m) {
  const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_transmission");
  return khr && extension_number(*khr, "transmissionFactor", 0) > 0;
}

}  // namespace

GltfMaterials::GltfMaterials(GltfFile& file) : file_(file), textures_(std::make_unique<GltfTextures>(file)) {}
GltfMaterials::~GltfMaterials() = default;

const tinygltf::Material& GltfMaterials::of(int material) const {
  const auto& all = file_.model().materials;
  return material >= 0 && static_cast<size_t>(material) < all.size() ? all[material] : default_;
}

ObjectPtr GltfMaterials::model(int material) {
  const auto [made, is_new] = models_.try_emplace(material);
  if (is_new) made->second = make(of(material));
  return made->second;
}

int GltfMaterials::texture_set(int material) {
  const tinygltf::Material& m = of(material);
  int set = -1;
  const auto see = [&](const auto& info) {
    if (info.index < 0) return;
    if (set >= 0 && set != info.texCoord)
      file_.warn(
          fmt::format("material '{}' uses several sets of texture coordinates: set {} is taken for all", m.name, set));
    else
      set = info.texCoord;
  };
  see(m.pbrMetallicRoughness.baseColorTexture), see(m.pbrMetallicRoughness.metallicRoughnessTexture);
  see(m.normalTexture), see(m.emissiveTexture);
  for (const auto& [extension, name] : kExtensionTextures)
    if (const tinygltf::Value* khr = find_extension(m.extensions, extension))
      if (const auto info = extension_texture(*khr, name)) see(*info);
  return std::max(set, 0);
}

void GltfMaterials::set_colour(ObjectDescription& model, const char* name, const tinygltf::TextureInfo& image,
                               const Spectrum& factor) {
  if (image.index < 0) return set_property(model, name, ColourValue{factor});
  if (const ObjectPtr texture = textures_->make(image.index, image.extensions, {.factor = factor}))
    set_property(model, name, texture);
}

void GltfMaterials::set_number(ObjectDescription& model, const char* name, const tinygltf::TextureInfo& image,
                               int channel, double factor) {
  if (image.index < 0) return set_property(model, name, in_unit(factor));
  const Spectrum times(static_cast<float>(in_unit(factor)));
  if (const ObjectPtr texture = textures_->make(image.index, image.extensions, {GltfUse::kChannel, channel, times}))
    set_property(model, name, texture);
}

ObjectBuilder GltfMaterials::surface(const tinygltf::Material& m) {
  const tinygltf::PbrMetallicRoughness& pbr = m.pbrMetallicRoughness;
  auto model = make_object("bsdf", "metallicroughness", file_.where());
  set_colour(*model, "base_color", pbr.baseColorTexture, colour_of(pbr.baseColorFactor, 1));
  set_number(*model, "metallic", pbr.metallicRoughnessTexture, 2, pbr.metallicFactor);
  set_number(*model, "roughness", pbr.metallicRoughnessTexture, 1, pbr.roughnessFactor);
  const auto image = [](const tinygltf::Value& extension, const char* name) {
    return extension_texture(extension, name).value_or(tinygltf::TextureInfo());
  };
  if (const tinygltf::Value* ior = find_extension(m.extensions, "KHR_materials_ior"))
    set_property(*model, "ior", std::max(extension_number(*ior, "ior", 1.5), 0.0));
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_specular")) {
    set_number(*model, "specular", image(*khr, "specularTexture"), 3, extension_number(*khr, "specularFactor", 1));
    set_colour(*model, "specular_color", image(*khr, "specularColorTexture"),
               extension_colour(*khr, "specularColorFactor", 1));
  }
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_transmission"); is_transmissive(m))
    set_number(*model, "transmission", image(*khr, "transmissionTexture"), 0,
               extension_number(*khr, "transmissionFactor", 0));
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_volume")) {
    if (is_transmissive(m) && extension_number(*khr, "thicknessFactor", 0) > 0) set_property(*model, "thin", false);
    if (khr->Has("attenuationColor"))
      file_.warn(fmt::format("what the inside of material '{}' absorbs is not read", m.name));
  }
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_clearcoat")) {
    set_number(*model, "clearcoat", image(*khr, "clearcoatTexture"), 0, extension_number(*khr, "clearcoatFactor", 0));
    set_number(*model, "clearcoat_roughness", image(*khr, "clearcoatRoughnessTexture"), 1,
               extension_number(*khr, "clearcoatRoughnessFactor", 0));
    if (khr->Has("clearcoatNormalTexture"))
      file_.warn(fmt::format("the clear coat of material '{}' has the normals of its base, not its own", m.name));
  }
  return model;
}

ObjectPtr GltfMaterials::make(const tinygltf::Material& m) {
  if (m.extensions.contains("KHR_materials_unlit"))
    file_.warn(fmt::format("material '{}' is unlit; it is rendered lit", m.name));
  ObjectPtr whole = with_normals(m, surface(m));
  if (!is_transmissive(m))  // opaque models are black from behind
    whole = ObjectPtr(make_object("bsdf", "twosided", file_.where(), {{"", whole}}));
  const ObjectPtr result = with_opacity(m, whole);
  if (!m.name.empty()) std::const_pointer_cast<ObjectDescription>(result)->id = m.name;
  return result;
}

ObjectPtr GltfMaterials::with_normals(const tinygltf::Material& m, ObjectPtr model) {
  if (m.normalTexture.index < 0) return model;
  if (m.normalTexture.scale != 1)
    file_.warn(fmt::format("the normals of material '{}' are taken as they are, without their scale", m.name));
  const ObjectPtr map = textures_->make(m.normalTexture.index, m.normalTexture.extensions, {GltfUse::kVector});
  if (!map) return model;
  return make_object("bsdf", "normalmap", file_.where(), {{"normalmap", map}, {"", std::move(model)}});
}

ObjectPtr GltfMaterials::with_opacity(const tinygltf::Material& m, ObjectPtr model) {
  if (m.alphaMode != "MASK" && m.alphaMode != "BLEND") return model;
  const std::vector<double>& factor = m.pbrMetallicRoughness.baseColorFactor;
  const double alpha = in_unit(factor.size() > 3 ? factor[3] : 1), cutoff = m.alphaMode == "MASK" ? m.alphaCutoff : -1;
  auto mask = make_object("bsdf", "mask", file_.where());
  const tinygltf::TextureInfo& info = m.pbrMetallicRoughness.baseColorTexture;
  if (info.index >= 0) {
    const ObjectPtr texture = textures_->make(info.index, info.extensions,
                                              {GltfUse::kChannel, 3, Spectrum(static_cast<float>(alpha)), cutoff});
    if (!texture) return model;
    set_property(*mask, "opacity", texture);
  } else {
    set_property(*mask, "opacity", cutoff >= 0 ? (alpha >= cutoff ? 1.0 : 0.0) : alpha);
  }
  set_property(*mask, "", std::move(model));
  return mask;
}

ObjectPtr GltfMaterials::light(int material) {
  const auto [made, is_new] = lights_.try_emplace(material);
  if (!is_new) return made->second;
  const tinygltf::Material& m = of(material);
  Spectrum radiance = colour_of(m.emissiveFactor, 0);
  if (const tinygltf::Value* strength = find_extension(m.extensions, "KHR_materials_emissive_strength"))
    radiance = radiance * static_cast<float>(std::max(extension_number(*strength, "emissiveStrength", 1), 0.0));
  if (!(max_component(radiance) > 0)) return nullptr;
  auto light = make_object("emitter", "area", file_.where());
  if (m.emissiveTexture.index < 0) {
    set_property(*light, "radiance", ColourValue{radiance});
  } else {
    const ObjectPtr texture =
        textures_->make(m.emissiveTexture.index, m.emissiveTexture.extensions, {.factor = radiance});
    if (!texture) return nullptr;
    set_property(*light, "radiance", texture);
  }
  if (m.doubleSided) file_.warn(fmt::format("material '{}' shines from its front alone", m.name));
  return made->second = light;
}

}  // namespace covary
