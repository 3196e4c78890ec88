// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gltf/gltf_reader.h"
#include "gltf/gltf_textures.h"

namespace covary {
namespace {

using tinygltf::TextureInfo;

Spectrum colour_of(const std::vector<double>& numbers, float fallback) {
  Spectrum colour(fallback);
  for (size_t c = 0; c < 3 && c < numbers.size(); ++c) colour[c] = std::max(static_cast<float>(numbers[c]), 0.0f);
  return colour;
}

/// The textures of extensions that are read.
constexpr std::pair<const char*, const char*> kExtensionTextures[] = {
    {"KHR_materials_anisotropy", "anisotropyTexture"},
    {"KHR_materials_clearcoat", "clearcoatTexture"},
    {"KHR_materials_clearcoat", "clearcoatRoughnessTexture"},
    {"KHR_materials_diffuse_transmission", "diffuseTransmissionTexture"},
    {"KHR_materials_diffuse_transmission", "diffuseTransmissionColorTexture"},
    {"KHR_materials_iridescence", "iridescenceTexture"},
    {"KHR_materials_iridescence", "iridescenceThicknessTexture"},
    {"KHR_materials_pbrSpecularGlossiness", "diffuseTexture"},
    {"KHR_materials_pbrSpecularGlossiness", "specularGlossinessTexture"},
    {"KHR_materials_sheen", "sheenColorTexture"},
    {"KHR_materials_sheen", "sheenRoughnessTexture"},
    {"KHR_materials_specular", "specularTexture"},
    {"KHR_materials_specular", "specularColorTexture"},
    {"KHR_materials_transmission", "transmissionTexture"}};

double in_unit(double x) { return std::clamp(x, 0.0, 1.0); }

std::vector<double> numbers_of(const tinygltf::Value& extension, const std::string& name) {
  std::vector<double> numbers;
  const tinygltf::Value& value = extension.Get(name);
  for (size_t c = 0; value.IsArray() && c < value.ArrayLen(); ++c)
    numbers.push_back(value.Get(c).IsNumber() ? value.Get(c).GetNumberAsDouble() : 0);
  return numbers;
}
Spectrum extension_colour(const tinygltf::Value& extension, const std::string& name, float fallback) {
  return colour_of(numbers_of(extension, name), fallback);
}
TextureInfo image_of(const tinygltf::Value& extension, const char* name) {
  return extension_texture(extension, name).value_or(TextureInfo());
}

/// Whether light passes: the factor of an extension.
bool passes(const tinygltf::Material& m, const char* extension, const char* factor) {
  const tinygltf::Value* khr = find_extension(m.extensions, extension);
  return khr && extension_number(*khr, factor, 0) > 0;
}
bool is_transmissive(const tinygltf::Material& m) {
  return passes(m, "KHR_materials_transmission", "transmissionFactor");
}
bool is_translucent(const tinygltf::Material& m) {
  return passes(m, "KHR_materials_diffuse_transmission", "diffuseTransmissionFactor");
}
bool is_solid(const tinygltf::Material& m) {
  return is_transmissive(m) && passes(m, "KHR_materials_volume", "thicknessFactor");
}
bool is_unlit(const tinygltf::Material& m) { return find_extension(m.extensions, "KHR_materials_unlit") != nullptr; }

/// Colour and alpha, of the extension if the material has one.
struct Base {
  std::vector<double> factor;
  TextureInfo image;
};
Base base_of(const tinygltf::Material& m) {
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_pbrSpecularGlossiness"))
    return {numbers_of(*khr, "diffuseFactor"), image_of(*khr, "diffuseTexture")};
  return {m.pbrMetallicRoughness.baseColorFactor, m.pbrMetallicRoughness.baseColorTexture};
}

}  // namespace

GltfMaterials::GltfMaterials(GltfFile& file) : file_(file), textures_(std::make_unique<GltfTextures>(file)) {}
GltfMaterials::~GltfMaterials() = default;

const tinygltf::Material& GltfMaterials::of(int material) const {
  const auto& all = file_.model().materials;
  return material >= 0 && static_cast<size_t>(material) < all.size() ? all[material] : default_;
}

ObjectPtr GltfMaterials::model(int material, const GltfColours& vertices) {
  const auto [made, is_new] = models_.try_emplace({material, vertices});
  textures_->take_as_own(sets(material).own);
  if (is_new) made->second = make(of(material), vertices);
  return made->second;
}

ObjectPtr GltfMaterials::light(int material, const GltfColours& vertices) {
  const auto [made, is_new] = lights_.try_emplace({material, vertices});
  textures_->take_as_own(sets(material).own);
  if (is_new) made->second = make_light(of(material), vertices);
  return made->second;
}

GltfSets GltfMaterials::sets_of(const tinygltf::Material& m) {
  GltfSets sets;
  int own = -1;
  const auto see = [&](const auto& info, bool directed = false) {
    if (info.index < 0) return;
    const int set = gltf_texture_set(info.texCoord, info.extensions);
    if (own < 0) own = set;
    if (set != own) sets.others.insert(set);
    sets.tangents |= directed;
  };
  see(m.normalTexture, true);
  for (const auto& [extension, name] : {std::pair("KHR_materials_clearcoat", "clearcoatNormalTexture"),
                                        {"KHR_materials_anisotropy", "anisotropyTexture"}})
    if (const tinygltf::Value* khr = find_extension(m.extensions, extension)) see(image_of(*khr, name), true);
  sets.tangents |= find_extension(m.extensions, "KHR_materials_anisotropy") != nullptr;
  see(base_of(m).image), see(m.pbrMetallicRoughness.metallicRoughnessTexture), see(m.emissiveTexture);
  for (const auto& [extension, name] : kExtensionTextures)
    if (const tinygltf::Value* khr = find_extension(m.extensions, extension)) see(image_of(*khr, name));
  sets.own = std::max(own, 0);
  return sets;
}

ObjectPtr GltfMaterials::make_texture(const TextureInfo& image, const GltfUse& use) {
  return textures_->make(image.index, image.texCoord, image.extensions, use);
}

// ---- parameters ----

Value GltfMaterials::colour(const TextureInfo& image, const Spectrum& factor, bool vertices) {
  Value value = ColourValue{factor};
  if (image.index >= 0) value = make_texture(image, {.factor = factor});
  if (!vertices) return value;
  const ObjectPtr of_vertices =
      make_object("texture", "mesh_attribute", file_.where(), {{"name", std::string("vertex_color")}});
  return ObjectPtr(make_object("texture", "scale", file_.where(), {{"scale", value}, {"", of_vertices}}));
}

void GltfMaterials::set_colour(ObjectDescription& model, const char* name, const TextureInfo& image,
                               const Spectrum& factor) {
  set_property(model, name, colour(image, factor));
}

void GltfMaterials::set_number(ObjectDescription& model, const char* name, const TextureInfo& image, int channel,
                               double factor) {
  if (image.index < 0) return set_property(model, name, in_unit(factor));
  const Spectrum times(static_cast<float>(in_unit(factor)));
  if (const ObjectPtr texture = make_texture(image, {GltfUse::kChannel, channel, times}))
    set_property(model, name, texture);
}

ObjectBuilder GltfMaterials::surface(const tinygltf::Material& m, const GltfColours& vertices) {
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_pbrSpecularGlossiness"))
    return specular_glossiness(*khr, vertices);
  const tinygltf::PbrMetallicRoughness& pbr = m.pbrMetallicRoughness;
  auto model = make_object("bsdf", "metallicroughness", file_.where());
  set_property(*model, "base_color", colour(pbr.baseColorTexture, colour_of(pbr.baseColorFactor, 1), vertices.colours));
  set_number(*model, "metallic", pbr.metallicRoughnessTexture, 2, pbr.metallicFactor);
  set_number(*model, "roughness", pbr.metallicRoughnessTexture, 1, pbr.roughnessFactor);
  if (const tinygltf::Value* ior = find_extension(m.extensions, "KHR_materials_ior"))
    set_property(*model, "ior", std::max(extension_number(*ior, "ior", 1.5), 0.0));
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_specular")) {
    set_number(*model, "specular", image_of(*khr, "specularTexture"), 3, extension_number(*khr, "specularFactor", 1));
    set_colour(*model, "specular_color", image_of(*khr, "specularColorTexture"),
               extension_colour(*khr, "specularColorFactor", 1));
  }
  set_transmission(m, *model);
  set_layers(m, *model);
  return model;
}

/// KHR_materials_pbrSpecularGlossiness: a dielectric whose index, infinite, leaves f0 to the specular colour.
ObjectBuilder GltfMaterials::specular_glossiness(const tinygltf::Value& khr, const GltfColours& vertices) {
  auto model = make_object("bsdf", "metallicroughness", file_.where(), {{"metallic", 0.0}, {"ior", 0.0}});
  set_property(*model, "base_color",
               colour(image_of(khr, "diffuseTexture"), extension_colour(khr, "diffuseFactor", 1), vertices.colours));
  const TextureInfo image = image_of(khr, "specularGlossinessTexture");
  set_colour(*model, "specular_color", image, extension_colour(khr, "specularFactor", 1));
  const double glossiness = in_unit(extension_number(khr, "glossinessFactor", 1));
  if (image.index < 0) {
    set_property(*model, "roughness", 1 - glossiness);
  } else {
    const GltfUse use{
        .kind = GltfUse::kChannel, .channel = 3, .factor = Spectrum(-static_cast<float>(glossiness)), .offset = 1};
    set_property(*model, "roughness", make_texture(image, use));
  }
  return model;
}

void GltfMaterials::set_transmission(const tinygltf::Material& m, ObjectDescription& model) {
  if (is_transmissive(m)) {
    const tinygltf::Value& khr = *find_extension(m.extensions, "KHR_materials_transmission");
    set_number(model, "transmission", image_of(khr, "transmissionTexture"), 0,
               extension_number(khr, "transmissionFactor", 0));
    if (is_solid(m)) set_property(model, "thin", false);
    if (passes(m, "KHR_materials_dispersion", "dispersion"))
      file_.warn(fmt::format("material '{}' disperses light; it is refracted alike in all colours", m.name));
  }
  if (is_translucent(m)) {
    const tinygltf::Value& khr = *find_extension(m.extensions, "KHR_materials_diffuse_transmission");
    set_number(model, "diffuse_transmission", image_of(khr, "diffuseTransmissionTexture"), 3,
               extension_number(khr, "diffuseTransmissionFactor", 0));
    set_colour(model, "diffuse_transmission_color", image_of(khr, "diffuseTransmissionColorTexture"),
               extension_colour(khr, "diffuseTransmissionColorFactor", 1));
  }
}

void GltfMaterials::set_layers(const tinygltf::Material& m, ObjectDescription& model) {
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_clearcoat")) {
    set_number(model, "clearcoat", image_of(*khr, "clearcoatTexture"), 0, extension_number(*khr, "clearcoatFactor", 0));
    set_number(model, "clearcoat_roughness", image_of(*khr, "clearcoatRoughnessTexture"), 1,
               extension_number(*khr, "clearcoatRoughnessFactor", 0));
    if (extension_number(*khr, "clearcoatFactor", 0) > 0) set_coat_normal(m, *khr, model);
  }
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_sheen")) {
    set_colour(model, "sheen_color", image_of(*khr, "sheenColorTexture"),
               extension_colour(*khr, "sheenColorFactor", 0));
    set_number(model, "sheen_roughness", image_of(*khr, "sheenRoughnessTexture"), 3,
               extension_number(*khr, "sheenRoughnessFactor", 0));
  }
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_anisotropy");
      khr && extension_number(*khr, "anisotropyStrength", 0) > 0) {
    set_property(model, "anisotropy", in_unit(extension_number(*khr, "anisotropyStrength", 0)));
    set_property(model, "anisotropy_rotation", extension_number(*khr, "anisotropyRotation", 0));
    if (const TextureInfo image = image_of(*khr, "anisotropyTexture"); image.index >= 0)
      set_property(model, "anisotropy_map", make_texture(image, {GltfUse::kVector}));
  }
  if (const tinygltf::Value* khr = find_extension(m.extensions, "KHR_materials_iridescence");
      khr && extension_number(*khr, "iridescenceFactor", 0) > 0) {
    set_number(model, "iridescence", image_of(*khr, "iridescenceTexture"), 0,
               extension_number(*khr, "iridescenceFactor", 0));
    set_property(model, "iridescence_ior", std::max(extension_number(*khr, "iridescenceIor", 1.3), 1.0));
    const double least = extension_number(*khr, "iridescenceThicknessMinimum", 100);
    const double most = extension_number(*khr, "iridescenceThicknessMaximum", 400);
    const TextureInfo image = image_of(*khr, "iridescenceThicknessTexture");
    if (image.index < 0) return set_property(model, "iridescence_thickness", std::max(most, 0.0));
    const GltfUse use{.kind = GltfUse::kChannel,
                      .channel = 1,
                      .factor = Spectrum(static_cast<float>(most - least)),
                      .offset = static_cast<float>(least)};
    set_property(model, "iridescence_thickness", make_texture(image, use));
  }
}

// ---- models ----

ObjectPtr GltfMaterials::lit_model(const tinygltf::Material& m, const GltfColours& vertices) {
  base_normal_ =
      normal_map(m.normalTexture.index, m.normalTexture.texCoord, m.normalTexture.extensions, m.normalTexture.scale);
  const ObjectPtr model = surface(m, vertices);
  if (!base_normal_) return model;
  return make_object("bsdf", "normalmap", file_.where(),
                     {{"normalmap", base_normal_}, {"along_dv", true}, {"", model}});
}

ObjectPtr GltfMaterials::make(const tinygltf::Material& m, const GltfColours& vertices) {
  ObjectPtr whole;
  if (is_unlit(m))
    whole = make_object("bsdf", "diffuse", file_.where(), {{"reflectance", ColourValue{Spectrum(0)}}});
  else
    whole = lit_model(m, vertices);
  if (is_unlit(m) || !(is_transmissive(m) || is_translucent(m)))  // opaque models are black from behind
    whole = ObjectPtr(make_object("bsdf", "twosided", file_.where(), {{"", whole}}));
  if (const std::optional<Value> seen = opacity(m, vertices))
    whole = make_object("bsdf", "mask", file_.where(), {{"opacity", *seen}, {"", whole}});
  if (!m.name.empty()) std::const_pointer_cast<ObjectDescription>(whole)->id = m.name;
  return whole;
}

ObjectPtr GltfMaterials::normal_map(int texture, int set, const tinygltf::ExtensionMap& extensions, double scale) {
  if (texture < 0) return nullptr;
  const auto factor = static_cast<float>(scale);
  const GltfUse use{.kind = factor == 1 ? GltfUse::kVector : GltfUse::kNormal, .factor = Spectrum(factor)};
  return textures_->make(texture, set, extensions, use);
}

/// A coat without a map of its own has the normal of the mesh, whatever that of its base.
void GltfMaterials::set_coat_normal(const tinygltf::Material& m, const tinygltf::Value& coat,
                                    ObjectDescription& model) {
  const tinygltf::Value& own = coat.Get("clearcoatNormalTexture");
  const double scale = own.IsObject() ? extension_number(own, "scale", 1) : 1;
  const TextureInfo image = image_of(coat, "clearcoatNormalTexture");
  if (image.index < 0 && !base_normal_) return;
  const bool same = image.index == m.normalTexture.index && image.texCoord == m.normalTexture.texCoord &&
                    scale == m.normalTexture.scale && image.extensions == m.normalTexture.extensions;
  if (same) return;
  if (image.index < 0)
    set_property(model, "clearcoat_normal", ColourValue{{0.5f, 0.5f, 1}});
  else if (const ObjectPtr map = normal_map(image.index, image.texCoord, image.extensions, scale))
    set_property(model, "clearcoat_normal", map);
  if (base_normal_) set_property(model, "base_normal", base_normal_);
}

std::optional<Value> GltfMaterials::opacity(const tinygltf::Material& m, const GltfColours& vertices) {
  if (m.alphaMode != "MASK" && m.alphaMode != "BLEND") return std::nullopt;
  const Base base = base_of(m);
  const double alpha = in_unit(base.factor.size() > 3 ? base.factor[3] : 1);
  const double cutoff = m.alphaMode == "MASK" ? m.alphaCutoff : -1;
  Value value = cutoff >= 0 ? (alpha >= cutoff ? 1.0 : 0.0) : alpha;
  if (base.image.index >= 0) {
    const ObjectPtr texture =
        make_texture(base.image, {GltfUse::kChannel, 3, Spectrum(static_cast<float>(alpha)), cutoff});
    if (!texture) return std::nullopt;
    value = texture;
  }
  if (!vertices.alphas || cutoff >= 0) return value;
  const ObjectPtr of_vertices =
      make_object("texture", "mesh_attribute", file_.where(), {{"name", std::string("vertex_alpha")}});
  return ObjectPtr(make_object("texture", "scale", file_.where(), {{"scale", value}, {"", of_vertices}}));
}

ObjectPtr GltfMaterials::make_light(const tinygltf::Material& m, const GltfColours& vertices) {
  Spectrum radiance = colour_of(m.emissiveFactor, 0);
  if (const tinygltf::Value* strength = find_extension(m.extensions, "KHR_materials_emissive_strength"))
    radiance = radiance * static_cast<float>(std::max(extension_number(*strength, "emissiveStrength", 1), 0.0));
  const bool unlit = is_unlit(m);
  const Base base = base_of(m);
  Value emitted = ColourValue{radiance};
  if (unlit) {
    radiance = colour_of(base.factor, 1);
    emitted = colour(base.image, radiance, vertices.colours);
  } else if (max_component(radiance) > 0) {
    emitted = colour(m.emissiveTexture, radiance);
  }
  if (!(max_component(radiance) > 0)) return nullptr;
  if (const std::optional<Value> seen = opacity(m, vertices)) {  // what is not there does not shine
    const ObjectPtr* texture = std::get_if<ObjectPtr>(&emitted);
    const ObjectPtr shining =
        texture ? *texture : ObjectPtr(make_object("texture", "uniform", file_.where(), {{"value", emitted}}));
    emitted = ObjectPtr(make_object("texture", "scale", file_.where(), {{"scale", *seen}, {"", shining}}));
  }
  auto light = make_object("emitter", "area", file_.where(), {{"radiance", emitted}});
  if (m.doubleSided || unlit) set_property(*light, "two_sided", true);
  if (unlit) light->id = kUnlit;
  return light;
}

ObjectPtr GltfMaterials::medium(int material) {
  const auto [made, is_new] = media_.try_emplace(material);
  const tinygltf::Material& m = of(material);
  if (!is_new || is_unlit(m) || !is_solid(m)) return made->second;
  const tinygltf::Value& khr = *find_extension(m.extensions, "KHR_materials_volume");
  const Spectrum colour = extension_colour(khr, "attenuationColor", 1);
  const double distance = extension_number(khr, "attenuationDistance", 0);
  if (!(distance > 0) || colour == Spectrum(1)) return nullptr;
  Spectrum extinction;  // of Beer's law; what absorbs all is very dense
  for (int c = 0; c < 3; ++c)
    extinction[c] = static_cast<float>(-std::log(std::clamp(static_cast<double>(colour[c]), 1e-6, 1.0)) / distance);
  made->second = make_object("medium", "homogeneous", file_.where(),
                             {{"sigma_t", ColourValue{extinction}}, {"albedo", ColourValue{Spectrum(0)}}});
  return made->second;
}

}  // namespace covary
