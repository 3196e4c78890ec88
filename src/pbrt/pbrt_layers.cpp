// SPDX-License-Identifier: Apache-2.0
// Materials that pbrt-v4 simulates by random walks between layers, or below the surface, in closed form.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pbrt/pbrt_materials.h"

namespace covary {
namespace {

/// What pbrt's layers hold beside their surfaces.
void read_layer(PbrtParameters& p, PbrtNames& names) {
  const auto albedo = p.has("albedo") ? spectrum_value(p, "albedo", names) : std::nullopt;
  if (albedo && (std::holds_alternative<ObjectPtr>(*albedo) || max_component(plain_colour(*albedo)) > 0))
    p.warn("has an 'albedo': what scatters between its layers is left out");
  p.ignore({"thickness", "g", "maxdepth", "nsamples"});
}

/// Mean Fresnel reflectance of diffuse light inside a medium of relative index `eta` > 1 [Jensen2001].
double internal_reflectance(double eta) { return -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta; }

/// Diffuse reflectance of a medium without end, inside its surface: the integral of the dipole [Jensen2001], Eq. (15).
double dipole_reflectance(double sigma_s, double sigma_a, double eta) {
  const double sigma_t = sigma_s + sigma_a, albedo = sigma_t > 0 ? sigma_s / sigma_t : 0;
  const double internal = internal_reflectance(eta), boundary = (1 + internal) / (1 - internal);
  const double root = std::sqrt(3 * (1 - albedo));
  return albedo / 2 * (1 + std::exp(-4.0 / 3 * boundary * root)) * std::exp(-root);
}

/// The base below a smooth interface that reflects the fraction `reflected` of what enters, multiple reflections
/// included.
float base_albedo(double reflected, double eta) {
  const double internal = internal_reflectance(eta);
  return static_cast<float>(std::clamp(reflected / (1 - internal + reflected * internal), 0.0, 1.0));
}

ObjectBuilder plastic(PbrtParameters& p, const PbrtRoughness& rough, const Value& reflectance, double eta) {
  if (std::abs(eta - 1) < 1e-3)  // nothing coats it
    return two_sided(make_object("bsdf", "diffuse", p.where(), {{"reflectance", reflectance}}));
  auto model = make_object("bsdf", rough.smooth() ? "plastic" : "roughplastic", p.where());
  if (!rough.smooth()) {
    const auto *u = std::get_if<double>(&rough.u), *v = std::get_if<double>(&rough.v);
    if (u && v && *u == *v) {
      set_property(*model, "distribution", std::string("ggx"));
      set_property(*model, "alpha", *u);
    } else {
      rough.set(*model);
    }
  }
  set_property(*model, "diffuse_reflectance", reflectance);
  set_property(*model, "nonlinear", true);
  set_property(*model, "int_ior", eta);
  set_property(*model, "ext_ior", 1.0);
  return two_sided(model);
}

}  // namespace

/// `plastic` has the transport between the layers in closed form, without absorption over the thickness of the clear
/// layer.
ObjectBuilder make_pbrt_coated_diffuse(PbrtParameters& p, PbrtNames& names) {
  const auto rough = pbrt_roughness(p, "", names);
  const auto reflectance = p.has("reflectance") ? reflectance_value(p, "reflectance", names) : Value(0.5);
  if (!rough || !reflectance) return nullptr;
  read_layer(p, names);
  const double eta = index_of_refraction(p, 1.5, names);
  if (eta > 1) p.warn("is read as 'plastic', whose clear layer absorbs no light");
  return plastic(p, *rough, *reflectance, eta);
}

/// glTF's clear coat above a metal: no reflection between the layers, index 1.5.
ObjectBuilder make_pbrt_coated_conductor(PbrtParameters& p, PbrtNames& names) {
  const auto coat = pbrt_roughness(p, "interface.", names), rough = pbrt_roughness(p, "conductor.", names);
  const auto metal = pbrt_conductor(p, "conductor.", names);
  p.rename("interface.eta", "eta");
  const double eta = index_of_refraction(p, 1.5, names);
  if (!coat || !rough || !metal) return nullptr;
  read_layer(p, names);
  Value base = ColourValue();
  if (metal->reflectance || std::holds_alternative<ObjectPtr>(metal->eta) ||
      std::holds_alternative<ObjectPtr>(metal->k)) {
    base = metal->reflectance ? Value(metal->reflectance) : Value(ColourValue{Spectrum(0.8f)});
    if (!metal->reflectance) p.warn("has a texture for its index of refraction; its reflectance is taken as 0.8");
  } else {
    const Spectrum n = plain_colour(metal->eta), k = plain_colour(metal->k);
    Spectrum r0;  // at normal incidence from inside the coat
    for (int c = 0; c < 3; ++c) {
      const double a = n[c] / eta, b = k[c] / eta;
      r0[c] = static_cast<float>(((a - 1) * (a - 1) + b * b) / ((a + 1) * (a + 1) + b * b));
    }
    base = ColourValue{r0};
  }
  p.warn("is read as a metal under glTF's clear coat, of index 1.5 and without reflections between the layers");
  return two_sided(make_object("bsdf", "metallicroughness", p.where(),
                               {{"base_color", base},
                                {"roughness", metallic_roughness(rough->u, p.where())},
                                {"clearcoat", 1.0},
                                {"clearcoat_roughness", metallic_roughness(coat->u, p.where())}}));
}

/// Reflects what would leave the medium, but where the light enters.
ObjectBuilder make_pbrt_subsurface(PbrtParameters& p, PbrtNames& names) {
  const auto rough = pbrt_roughness(p, "", names);
  const double eta = index_of_refraction(p, 1.33, names);
  if (!rough) return nullptr;
  p.rename("Kd", "reflectance");
  p.ignore({"mfp", "scale", "Kr", "Kt"});
  const std::string name = p.get_string("name", "");
  const double g = name.empty() ? p.get_float("g", 0) : 0;
  p.ignore({"g"});
  p.warn("scatters no light below its surface: it reflects diffusely what would come out elsewhere");
  if (name.empty() && !p.has("sigma_s") && !p.has("sigma_a") && p.has("reflectance")) {
    auto reflectance = reflectance_value(p, "reflectance", names);
    if (!reflectance) return nullptr;
    if (std::holds_alternative<ObjectPtr>(*reflectance)) return plastic(p, *rough, *reflectance, eta);
    Spectrum base = plain_colour(*reflectance);
    for (int c = 0; c < 3; ++c) base[c] = base_albedo(base[c], eta);
    return plastic(p, *rough, ColourValue{base}, eta);
  }
  Spectrum coefficients[2] = {{2.55f, 3.21f, 3.77f}, {0.0011f, 0.0024f, 0.014f}};  // pbrt's default: whole milk
  if (const PbrtMediumPreset* preset = pbrt_medium_preset(name)) {
    coefficients[0] = preset->sigma_s, coefficients[1] = preset->sigma_a;
  } else if (!name.empty()) {
    p.error(fmt::format("has the name '{}', which is no medium that pbrt knows", name));
    return nullptr;
  }
  for (const int i : {0, 1})
    if (const char* given = i == 0 ? "sigma_s" : "sigma_a"; p.has(given)) {
      const auto value = spectrum_value(p, given, names);
      if (!value) return nullptr;
      if (std::holds_alternative<ObjectPtr>(*value))
        p.warn(fmt::format("has a texture for '{}'; that of whole milk is used", given));
      else
        coefficients[i] = plain_colour(*value) * static_cast<float>(i == 0 ? 1 - g : 1);
    }
  Spectrum base;
  for (int c = 0; c < 3; ++c)
    base[c] = base_albedo(dipole_reflectance(coefficients[0][c], coefficients[1][c], eta), eta);
  return plastic(p, *rough, ColourValue{base}, eta);
}

}  // namespace covary
