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

double in_unit(double x) { return std::clamp(x, 0.0, 1.0); }

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
  return std::max(set, 0);
}

ObjectBuilder GltfMaterials::surface(const tinygltf::Material& m) {
  const tinygltf::PbrMetallicRoughness& pbr = m.pbrMetallicRoughness;
  const tinygltf::Value* transmission = find_extension(m.extensions, "KHR_materials_transmission");
  const double let_through = transmission ? in_unit(extension_number(*transmission, "transmissionFactor", 0)) : 0;
  const tinygltf::Value* volume = find_extension(m.extensions, "KHR_materials_volume");
  const bool thin = let_through > 0 && !(volume && extension_number(*volume, "thicknessFactor", 0) > 0);
  auto model = make_object("bsdf", thin ? "principledthin" : "principled", file_.where());
  const Spectrum colour = colour_of(pbr.baseColorFactor, 1);
  if (pbr.baseColorTexture.index >= 0) {
    if (const ObjectPtr texture =
            textures_->make(pbr.baseColorTexture.index, pbr.baseColorTexture.extensions, {.factor = colour}))
      set_property(*model, "base_color", texture);
  } else {
    set_property(*model, "base_color", ColourValue{colour});
  }
  const auto channel = [&](const char* name, int of, double factor) {
    const tinygltf::TextureInfo& info = pbr.metallicRoughnessTexture;
    if (info.index < 0) return set_property(*model, name, in_unit(factor));
    const Spectrum times(static_cast<float>(in_unit(factor)));
    if (const ObjectPtr texture = textures_->make(info.index, info.extensions, {GltfUse::kChannel, of, times}))
      set_property(*model, name, texture);
  };
  channel("roughness", 1, pbr.roughnessFactor);
  if (!thin) channel("metallic", 2, pbr.metallicFactor);
  if (let_through > 0) set_property(*model, "spec_trans", let_through);
  if (transmission && transmission->Has("transmissionTexture"))
    file_.warn(fmt::format("the texture of material '{}' for what it lets through is not read", m.name));
  if (const tinygltf::Value* ior = find_extension(m.extensions, "KHR_materials_ior"))
    set_property(*model, "eta", std::max(extension_number(*ior, "ior", 1.5), 1.0));
  if (volume && volume->Has("attenuationColor"))
    file_.warn(fmt::format("what the inside of material '{}' absorbs is not read", m.name));
  if (const tinygltf::Value* coat = find_extension(m.extensions, "KHR_materials_clearcoat"); coat && !thin) {
    set_property(*model, "clearcoat", in_unit(extension_number(*coat, "clearcoatFactor", 0)));
    set_property(*model, "clearcoat_gloss", 1 - in_unit(extension_number(*coat, "clearcoatRoughnessFactor", 0)));
  }
  return model;
}

ObjectPtr GltfMaterials::make(const tinygltf::Material& m) {
  if (m.extensions.contains("KHR_materials_unlit"))
    file_.warn(fmt::format("material '{}' is unlit; it is rendered lit", m.name));
  ObjectBuilder model = surface(m);
  const bool thin = model->type == "principledthin";
  const bool solid_glass = std::any_of(model->properties.begin(), model->properties.end(),
                                       [](const Property& p) { return p.name == "spec_trans"; });
  if (!thin && !solid_glass) {  // both sides are visible
    auto sides = make_object("bsdf", "twosided", file_.where(), {{"", with_normals(m, model)}});
    model = sides;
  }
  const ObjectPtr whole = thin || solid_glass ? with_normals(m, model) : ObjectPtr(model);
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
