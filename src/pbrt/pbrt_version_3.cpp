// SPDX-License-Identifier: Apache-2.0
// What pbrt-v3 has beside or instead of version 4: materials by their own formulas, where there is a model for them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pbrt/pbrt_materials.h"

namespace covary {
namespace {

/// A colour or texture, `fallback` if it is absent; nullopt after an error.
std::optional<Value> colour(PbrtParameters& p, const std::string& name, double fallback, PbrtNames& names) {
  if (!p.has(name)) return ColourValue{Spectrum(static_cast<float>(fallback))};
  return reflectance_value(p, name, names);
}

/// `value` times a colour; a texture stays one.
Value times(const Value& value, const Spectrum& factor, const SourceLocation& where) {
  if (const ObjectPtr* texture = std::get_if<ObjectPtr>(&value))
    return ObjectPtr(scaled_texture(where, ColourValue{factor}, *texture));
  return ColourValue{plain_colour(value) * factor};
}

bool is_black(const Value& value) {
  return !std::holds_alternative<ObjectPtr>(value) && max_component(plain_colour(value)) == 0;
}

ObjectBuilder matte(PbrtParameters& p, PbrtNames& names) {
  const auto reflectance = colour(p, "Kd", 0.5, names);
  const auto sigma = float_value(p, "sigma", 0, names);
  if (!reflectance || !sigma) return nullptr;
  if (const double* degrees = std::get_if<double>(&*sigma); !degrees || *degrees > 0)
    p.warn("is rough ('sigma'); it reflects evenly here, as in version 4");
  return two_sided(make_object("bsdf", "diffuse", p.where(), {{"reflectance", *reflectance}}));
}

/// A perfect mirror, without Fresnel's reflectance.
ObjectBuilder mirror(PbrtParameters& p, PbrtNames& names) {
  const auto reflectance = colour(p, "Kr", 0.9, names);
  if (!reflectance) return nullptr;
  return two_sided(make_object("bsdf", "conductor", p.where(), {{"specular_reflectance", *reflectance}}));
}

/// Kd / π plus Ks times the reflection of microfacets of index `eta`.
ObjectBuilder coated(PbrtParameters& p, const Value& kd, const Value& ks, double eta, PbrtNames& names) {
  const auto rough = pbrt_roughness(p, "", names, 0.1);
  if (!rough) return nullptr;
  if (is_black(ks) || std::abs(eta - 1) < 1e-3)
    return two_sided(make_object("bsdf", "diffuse", p.where(), {{"reflectance", kd}}));
  auto model = make_object("bsdf", "pplastic", p.where());
  rough->set(*model);
  set_property(*model, "diffuse_reflectance", kd);
  set_property(*model, "specular_reflectance", ks);
  set_property(*model, "int_ior", eta);
  set_property(*model, "ext_ior", 1.0);
  p.warn("reflects diffusely only what its coating lets through, unlike in version 3");
  return two_sided(model);
}

ObjectBuilder plastic(PbrtParameters& p, PbrtNames& names) {
  const auto kd = colour(p, "Kd", 0.25, names), ks = colour(p, "Ks", 0.25, names);
  return kd && ks ? coated(p, *kd, *ks, 1.5, names) : nullptr;
}

ObjectBuilder uber(PbrtParameters& p, PbrtNames& names) {
  p.rename("index", "eta");
  const auto kd = colour(p, "Kd", 0.25, names), ks = colour(p, "Ks", 0.25, names), kr = colour(p, "Kr", 0, names),
             kt = colour(p, "Kt", 0, names), opacity = colour(p, "opacity", 1, names);
  if (!kd || !ks || !kr || !kt || !opacity) return nullptr;
  const double eta = index_of_refraction(p, 1.5, names);
  if (!is_black(*kr)) p.warn("has 'Kr': its perfect reflection is left out");
  if (!is_black(*kt)) p.warn("has 'Kt': its refraction is left out");
  const ObjectBuilder model = coated(p, *kd, *ks, eta, names);
  if (!model) return nullptr;
  if (!std::holds_alternative<ObjectPtr>(*opacity) && plain_colour(*opacity) == Spectrum(1)) return model;
  return make_object("bsdf", "mask", p.where(), {{"opacity", *opacity}, {"", ObjectPtr(model)}});
}

/// [Ashikhmin2000]'s mixture, whose specular colour is the reflectance at normal incidence, as of glTF's dielectrics.
ObjectBuilder substrate(PbrtParameters& p, PbrtNames& names) {
  const auto kd = colour(p, "Kd", 0.5, names), ks = colour(p, "Ks", 0.5, names);
  const auto rough = pbrt_roughness(p, "", names, 0.1);
  if (!kd || !ks || !rough) return nullptr;
  p.warn("is read as glTF's dielectric with the same reflectance at normal incidence");
  return two_sided(make_object("bsdf", "metallicroughness", p.where(),
                               {{"base_color", *kd},
                                {"metallic", 0.0},
                                {"specular_color", times(*ks, Spectrum(25), p.where())},  // times 0.04, of index 1.5
                                {"roughness", metallic_roughness(rough->u, p.where())}}));
}

ObjectBuilder translucent(PbrtParameters& p, PbrtNames& names) {
  const auto kd = colour(p, "Kd", 0.25, names), ks = colour(p, "Ks", 0.25, names),
             reflect = colour(p, "reflect", 0.5, names), transmit = colour(p, "transmit", 0.5, names);
  if (!kd || !ks || !reflect || !transmit) return nullptr;
  p.ignore({"roughness", "remaproughness"});
  if (!is_black(*ks)) p.warn("has 'Ks': its highlight is left out");
  const auto part = [&](const Value& factor) {
    if (const ObjectPtr* texture = std::get_if<ObjectPtr>(&factor))
      return Value(ObjectPtr(scaled_texture(p.where(), *kd, *texture)));
    return times(*kd, plain_colour(factor), p.where());
  };
  return make_object("bsdf", "difftrans", p.where(),
                     {{"reflectance", part(*reflect)}, {"transmittance", part(*transmit)}});
}

ObjectBuilder version_3_mix(PbrtParameters& p, PbrtNames& names) {
  Value amount = 0.5;
  if (const PbrtParameter* given = p.find("amount")) {
    const auto value = given->type == "float" ? Value(p.get_float("amount", 0.5)) : spectrum_value(p, "amount", names);
    if (!value) return nullptr;
    amount = std::holds_alternative<ObjectPtr>(*value) ? *value : Value(double{mean(plain_colour(*value))});
  }
  auto model = make_object("bsdf", "blendbsdf", p.where(), {{"weight", amount}});
  for (const char* parameter : {"namedmaterial2", "namedmaterial1"}) {  // the amount is that of the first
    const std::string name = p.get_string(parameter, "");
    const PbrtDefinitionPtr found = names.find(PbrtKind::kMaterial, name, p.order());
    if (!found) {
      p.error(fmt::format("names the material '{}' in '{}', which no MakeNamedMaterial has", name, parameter));
      return nullptr;
    }
    const ObjectPtr part = names.make(*found);
    if (!part) return nullptr;
    set_property(*model, "", part);
  }
  return model;
}

ObjectBuilder disney(PbrtParameters& p, PbrtNames& names) {
  const auto base = colour(p, "color", 0.5, names);
  if (!base) return nullptr;
  auto model = make_object("bsdf", "principled", p.where(), {{"base_color", *base}});
  struct Number {
    const char *from, *to;
    double fallback;
  };
  for (const Number& number :
       {Number{"roughness", "roughness", 0.5}, Number{"anisotropic", "anisotropic", 0},
        Number{"metallic", "metallic", 0}, Number{"spectrans", "spec_trans", 0}, Number{"speculartint", "spec_tint", 0},
        Number{"sheen", "sheen", 0}, Number{"sheentint", "sheen_tint", 0.5}, Number{"flatness", "flatness", 0},
        Number{"clearcoat", "clearcoat", 0}, Number{"clearcoatgloss", "clearcoat_gloss", 1}}) {
    const auto value = float_value(p, number.from, number.fallback, names);
    if (!value) return nullptr;
    set_property(*model, number.to, *value);
  }
  set_property(*model, "eta", p.get_float("eta", 1.5));
  p.ignore({"scatterdistance", "thin", "difftrans"});
  if (p.get_bool("thin", false) || p.has("scatterdistance"))
    p.warn("is read as Mitsuba's 'principled': solid, and without scattering below the surface");
  return two_sided(model);
}

ObjectBuilder fourier(PbrtParameters& p) {
  p.ignore({"bsdffile"});
  p.warn("is given by a table that is not read; it is a grey, diffuse surface of reflectance 0.5 here");
  return two_sided(make_object("bsdf", "diffuse", p.where()));
}

}  // namespace

bool is_pbrt_3(const std::string& directive, const std::string& type) {
  const auto is = [&](std::initializer_list<const char*> names) {
    return std::ranges::any_of(names, [&](const char* name) { return type == name; });
  };
  if (directive == "Film") return type == "image";
  if (directive == "Sampler") return is({"02sequence", "lowdiscrepancy", "maxmindist", "random"});
  if (directive == "Integrator") return is({"directlighting", "whitted", "ao"});
  if (directive == "Camera") return type == "environment";
  if (directive == "Material")
    return is({"disney", "fourier", "glass", "kdsubsurface", "matte", "metal", "mirror", "plastic", "substrate",
               "translucent", "uber"});
  return false;
}

std::optional<ObjectBuilder> make_pbrt_material_3(const std::string& type, PbrtParameters& p, PbrtNames& names) {
  if (type == "matte") return matte(p, names);
  if (type == "mirror") return mirror(p, names);
  if (type == "plastic") return plastic(p, names);
  if (type == "uber") return uber(p, names);
  if (type == "substrate") return substrate(p, names);
  if (type == "translucent") return translucent(p, names);
  if (type == "mix") return version_3_mix(p, names);
  if (type == "disney") return disney(p, names);
  if (type == "fourier") return fourier(p);
  if (type == "kdsubsurface") return make_pbrt_subsurface(p, names);
  return std::nullopt;
}

}  // namespace covary
