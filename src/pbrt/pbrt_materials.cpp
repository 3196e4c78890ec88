// SPDX-License-Identifier: Apache-2.0
// pbrt-v4 materials as models with the same reflection, except those with layers or scattering inside
// (pbrt_layers.cpp).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pbrt/pbrt_materials.h"

namespace covary {
namespace {

/// Version 3 (microfacet.h): RoughnessToAlpha.
double alpha_of_version_3(double roughness) {
  const double x = std::log(std::max(roughness, 1e-3));
  return 1.62142 + 0.819955 * x + 0.1734 * x * x + 0.0171201 * x * x * x + 0.000640711 * x * x * x * x;
}

ObjectBuilder conductor(PbrtParameters& p, PbrtNames& names, double roughness) {
  const auto rough = pbrt_roughness(p, "", names, roughness);
  const auto index = pbrt_conductor(p, "", names);
  if (!rough || !index) return nullptr;
  if (index->reflectance) {
    p.warn("has a texture for its reflectance, which grows towards 1 at grazing angles as in Schlick's formula");
    return two_sided(
        make_object("bsdf", "metallicroughness", p.where(),
                    {{"base_color", index->reflectance}, {"roughness", metallic_roughness(rough->u, p.where())}}));
  }
  auto model = make_object("bsdf", rough->smooth() ? "conductor" : "roughconductor", p.where());
  if (!rough->smooth()) rough->set(*model);
  set_property(*model, "eta", index->eta);
  set_property(*model, "k", index->k);
  return two_sided(model);
}

ObjectBuilder dielectric(PbrtParameters& p, PbrtNames& names, bool thin) {
  std::optional<PbrtRoughness> rough = PbrtRoughness();
  if (!thin) rough = pbrt_roughness(p, "", names);
  if (!rough) return nullptr;
  p.ignore({"tint"});
  p.rename("index", "eta");
  const double eta = index_of_refraction(p, 1.5, names);
  if (eta == 1) return make_object("bsdf", "null", p.where());
  auto model = make_object("bsdf",
                           thin              ? "thindielectric"
                           : rough->smooth() ? "dielectric"
                                             : "roughdielectric",
                           p.where());
  if (!thin && !rough->smooth()) rough->set(*model);
  set_property(*model, "int_ior", eta);
  set_property(*model, "ext_ior", 1.0);
  for (const auto& [from, to] : {std::pair{"Kr", "specular_reflectance"}, {"Kt", "specular_transmittance"}})
    if (names.version_3 && p.has(from)) {
      const auto factor = reflectance_value(p, from, names);
      if (!factor) return nullptr;
      set_property(*model, to, *factor);
    }
  return model;
}

ObjectBuilder diffuse(PbrtParameters& p, PbrtNames& names) {
  auto model = make_object("bsdf", "diffuse", p.where());
  if (p.has("reflectance")) {
    const auto reflectance = reflectance_value(p, "reflectance", names);
    if (!reflectance) return nullptr;
    set_property(*model, "reflectance", *reflectance);
  }
  return two_sided(model);
}

ObjectBuilder diffuse_transmission(PbrtParameters& p, PbrtNames& names) {
  auto model = make_object("bsdf", "difftrans", p.where());
  const double scale = p.get_float("scale", 1);
  for (const char* name : {"reflectance", "transmittance"}) {
    const auto value = p.has(name) ? reflectance_value(p, name, names) : Value(0.25);
    if (!value) return nullptr;
    if (scale == 1)
      set_property(*model, name, *value);
    else if (const ObjectPtr* texture = std::get_if<ObjectPtr>(&*value))
      set_property(*model, name, ObjectPtr(scaled_texture(p.where(), scale, *texture, 1.0)));
    else
      set_property(*model, name, ColourValue{plain_colour(*value) * static_cast<float>(scale)});
  }
  return model;
}

ObjectBuilder mix(PbrtParameters& p, PbrtNames& names) {
  const PbrtParameter* materials = p.find("materials");
  auto amount = float_value(p, "amount", 0.5, names);
  if (double* number = amount ? std::get_if<double>(&*amount) : nullptr) *number = std::clamp(*number, 0.0, 1.0);
  if (!materials || materials->strings.size() != 2) {
    p.error("needs the names of two 'materials'");
    return nullptr;
  }
  auto model = make_object("bsdf", "blendbsdf", p.where());
  if (!amount) return nullptr;
  set_property(*model, "weight", *amount);
  for (const std::string& name : materials->strings) {
    const PbrtDefinitionPtr found = names.find(PbrtKind::kMaterial, name, p.order());
    if (!found) {
      p.error_at(*materials, fmt::format("names the material '{}', which no MakeNamedMaterial has{}", name,
                                         did_you_mean(name, names.known(PbrtKind::kMaterial))));
      return nullptr;
    }
    const ObjectPtr part = names.make(*found);
    if (!part) return nullptr;
    set_property(*model, "", part);
  }
  return model;
}

/// The same model as ours. Without a colour, it is pbrt's brown hair.
ObjectBuilder hair(PbrtParameters& p, PbrtNames& names) {
  auto model = make_object("bsdf", "hair", p.where());
  const auto number = [&](const char* name, double fallback) {
    const auto value = float_value(p, name, fallback, names);
    const double* given = value ? std::get_if<double>(&*value) : nullptr;
    if (value && !given) p.warn(fmt::format("has a texture for '{}'; its default, {}, is used", name, fallback));
    return given ? *given : fallback;
  };
  const auto beta = [&](const char* name) { return std::clamp(number(name, 0.3), 0.01, 1.0); };  // as pbrt
  const double n = beta("beta_n");
  set_property(*model, "longitudinal_roughness", beta("beta_m"));
  set_property(*model, "azimuthal_roughness", n);
  set_property(*model, "scale_tilt", number("alpha", 2));
  set_property(*model, "int_ior", number("eta", 1.55));
  set_property(*model, "ext_ior", 1.0);
  if (p.has("sigma_a")) {
    const auto absorption = spectrum_value(p, "sigma_a", names);
    if (!absorption) return nullptr;
    set_property(*model, "sigma_a", *absorption);
  } else if (const char* name = p.has("reflectance") ? "reflectance" : "color"; p.has(name)) {
    const auto value = reflectance_value(p, name, names);
    if (!value) return nullptr;
    if (std::holds_alternative<ObjectPtr>(*value)) p.warn("has a texture for its colour; its mean is taken as 0.5");
    const Spectrum rgb = std::holds_alternative<ObjectPtr>(*value) ? Spectrum(0.5f) : plain_colour(*value);
    // [Chiang2016]: absorption = (ln colour / D(beta_n))^2, as in bsdfs/hair.cpp.
    const double d =
        5.969 - 0.215 * n + 2.532 * n * n - 10.73 * std::pow(n, 3) + 5.574 * std::pow(n, 4) + 0.245 * std::pow(n, 5);
    Spectrum absorption;
    for (int c = 0; c < 3; ++c)
      absorption[c] = static_cast<float>(std::pow(std::log(std::clamp(rgb[c], 1e-4f, 1.0f)) / d, 2));
    set_property(*model, "sigma_a", ColourValue{absorption});
  } else {
    set_property(*model, "eumelanin", number("eumelanin", p.has("pheomelanin") ? 0 : 1.3));
    set_property(*model, "pheomelanin", number("pheomelanin", 0));
  }
  return model;
}

ObjectBuilder measured(PbrtParameters& p) {
  return two_sided(make_object("bsdf", "measured", p.where(), {{"filename", p.get_string("filename", "")}}));
}

ObjectBuilder base_material(const std::string& type, PbrtParameters& p, PbrtNames& names) {
  if (names.version_3)
    if (const auto model = make_pbrt_material_3(type, p, names)) return *model;
  if (type == "diffuse") return diffuse(p, names);
  if (type == "coateddiffuse") return make_pbrt_coated_diffuse(p, names);
  if (type == "coatedconductor") return make_pbrt_coated_conductor(p, names);
  if (type == "subsurface") return make_pbrt_subsurface(p, names);
  if (type == "diffusetransmission") return diffuse_transmission(p, names);
  if (type == "conductor" || type == "metal") return conductor(p, names, type == "metal" ? 0.01 : 0);
  if (type == "dielectric" || type == "glass" || type == "thindielectric")
    return dielectric(p, names, type == "thindielectric");
  if (type == "interface" || type.empty() || type == "none") return make_object("bsdf", "null", p.where());
  if (type == "hair") return hair(p, names);
  if (type == "mix") return mix(p, names);
  if (type == "measured") return measured(p);
  const bool grey = p.unknown(
      "materials 'coatedconductor', 'coateddiffuse', 'conductor', 'dielectric', 'diffuse', 'diffusetransmission', "
      "'hair', 'interface', 'measured', 'mix', 'subsurface' and 'thindielectric', and those of version 3",
      "it becomes 'diffuse', grey");
  return grey ? two_sided(make_object("bsdf", "diffuse", p.where())) : nullptr;
}

}  // namespace

ObjectBuilder two_sided(const ObjectBuilder& model) {
  return make_object("bsdf", "twosided", model->where, {{"", ObjectPtr(model)}});
}

Value metallic_roughness(const Value& alpha, const SourceLocation& where) {
  if (const double* number = std::get_if<double>(&alpha)) return std::clamp(std::sqrt(*number), 0.0, 1.0);
  auto root = scaled_texture(where, 1.0, std::get<ObjectPtr>(alpha), 1.0);
  set_property(*root, "exponent", 0.5);
  return ObjectPtr(root);
}

void PbrtRoughness::set(ObjectDescription& model) const {
  set_property(model, "distribution", std::string("ggx"));
  set_property(model, "alpha_u", u);
  set_property(model, "alpha_v", v);
}

std::optional<PbrtRoughness> pbrt_roughness(PbrtParameters& p, const std::string& prefix, PbrtNames& names,
                                            double fallback) {
  const auto both = float_value(p, prefix + "roughness", fallback, names);
  const auto one = [&](const std::string& name) { return p.has(name) ? float_value(p, name, 0, names) : both; };
  auto u = one(prefix + "uroughness"), v = one(prefix + "vroughness");
  const bool remap = p.get_bool("remaproughness", true);
  if (!u || !v) return std::nullopt;
  if (!remap) return PbrtRoughness{*u, *v};
  const bool shared =
      std::holds_alternative<ObjectPtr>(*u) &&
      *std::get_if<ObjectPtr>(&*u) == (std::get_if<ObjectPtr>(&*v) ? *std::get_if<ObjectPtr>(&*v) : ObjectPtr());
  for (Value* width : {&*u, &*v}) {
    if (double* number = std::get_if<double>(width)) {
      const bool zero = *number == 0;  // version 3: smooth, too
      *number = names.version_3 && !zero ? alpha_of_version_3(*number) : std::sqrt(std::max(*number, 0.0));
    } else {
      auto root = scaled_texture(p.where(), 1.0, std::get<ObjectPtr>(*width));
      set_property(*root, "exponent", 0.5);
      if (names.version_3) p.warn("has a texture for its roughness; alpha is its square root, as in version 4");
      *width = ObjectPtr(root);
    }
  }
  if (shared) v = u;
  return PbrtRoughness{*u, *v};
}

std::optional<PbrtConductor> pbrt_conductor(PbrtParameters& p, const std::string& prefix, PbrtNames& names) {
  if (p.has("reflectance")) {
    const auto value = reflectance_value(p, "reflectance", names);
    if (!value) return std::nullopt;
    if (const ObjectPtr* texture = std::get_if<ObjectPtr>(&*value)) return PbrtConductor{1.0, 1.0, *texture};
    const Spectrum rgb = plain_colour(*value);
    Spectrum k;  // pbrt: the k with this reflectance at eta = 1
    for (int c = 0; c < 3; ++c) {
      const float r = std::clamp(rgb[c], 0.0f, 0.9999f);
      k[c] = 2 * std::sqrt(r) / std::sqrt(1 - r);
    }
    return PbrtConductor{1.0, ColourValue{k}, nullptr};
  }
  std::optional<Value> values[2];
  for (const int i : {0, 1}) {
    const std::string name = i == 0 ? "eta" : "k";
    const PbrtParameter* given = p.find(prefix + name);
    values[i] = !given                   ? Value(ColourValue{*pbrt_metal("metal-Cu-" + name)})
                : given->type == "float" ? Value(p.get_float(prefix + name, 1))
                                         : spectrum_value(p, prefix + name, names);
    if (!values[i]) return std::nullopt;
  }
  return PbrtConductor{*values[0], *values[1], nullptr};
}

ObjectBuilder make_pbrt_material(const std::string& type, PbrtParameters& p, PbrtNames& names) {
  p.rename("bumpmap", "displacement");
  ObjectBuilder model = base_material(type, p, names);
  if (!model) return nullptr;
  if (const std::string file = p.get_string("normalmap", ""); !file.empty()) {
    auto map = make_object(
        "texture", "bitmap", p.where(),
        {{"filename", file}, {"raw", true}, {"to_uv", Transform::translate({0, 1, 0}) * Transform::scale({1, -1, 1})}});
    model = make_object("bsdf", "normalmap", p.where(), {{"normalmap", ObjectPtr(map)}, {"", ObjectPtr(model)}});
  }
  if (!p.has("displacement")) return model;
  const auto displacement = float_value(p, "displacement", 0, names);
  if (!displacement || !std::holds_alternative<ObjectPtr>(*displacement)) return model;
  return make_object("bsdf", "bumpmap", p.where(), {{"", *displacement}, {"", ObjectPtr(model)}});
}

}  // namespace covary
