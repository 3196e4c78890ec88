// SPDX-License-Identifier: Apache-2.0
// pbrt-v4 materials as models with the same reflection, except 'coateddiffuse' (see there).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/pbrt_objects.h"

namespace covary {
namespace {

/// pbrt's surfaces look the same from both sides.
ObjectBuilder two_sided(const ObjectBuilder& model) {
  return make_object("bsdf", "twosided", model->where, {{"", ObjectPtr(model)}});
}

/// Roughness (alpha) along u and v.
struct Roughness {
  Value u = 0.0, v = 0.0;
  bool smooth() const { return is_smooth(u) && is_smooth(v); }
  void set(ObjectDescription& model) const {
    set_property(model, "distribution", std::string("ggx"));
    set_property(model, "alpha_u", u);
    set_property(model, "alpha_v", v);
  }
  /// pbrt treats smaller alphas as perfectly smooth.
  static bool is_smooth(const Value& alpha) {
    return std::holds_alternative<double>(alpha) && std::get<double>(alpha) < 1e-3;
  }
};

std::optional<Roughness> roughness(PbrtParameters& p, const PbrtNames& names) {
  const auto both = float_value(p, "roughness", 0, names);
  const auto one = [&](const char* name) { return p.has(name) ? float_value(p, name, 0, names) : both; };
  auto u = one("uroughness"), v = one("vroughness");
  const bool remap = p.get_bool("remaproughness", true);
  if (!u || !v) return std::nullopt;
  for (Value* width : {&*u, &*v}) {
    if (!remap) continue;
    if (double* number = std::get_if<double>(width)) {
      *number = std::sqrt(std::max(*number, 0.0));
    } else {
      p.error("has a texture for its roughness; supported with 'remaproughness' false");
      return std::nullopt;
    }
  }
  return Roughness{*u, *v};
}

/// Index of refraction: a number, or one of pbrt's glasses (spectrum.cpp) at 589 nm; those of Schott's SF glasses are
/// named 'glass-F…' in the program and 'glass-SF…' in its documentation.
double index_of_refraction(PbrtParameters& p) {
  const PbrtParameter* eta = p.find("eta");
  if (!eta) return 1.5;
  if (eta->type == "float") return p.get_float("eta", 1.5);
  static const std::map<std::string, double> kGlasses = {
      {"glass-BK7", 1.5168},   {"glass-BAF10", 1.67003}, {"glass-FK51A", 1.48656}, {"glass-LASF9", 1.85025},
      {"glass-F5", 1.67271},   {"glass-F10", 1.72828},   {"glass-F11", 1.78472},   {"glass-SF5", 1.67271},
      {"glass-SF10", 1.72828}, {"glass-SF11", 1.78472}};
  const auto glass = eta->strings.size() == 1 ? kGlasses.find(eta->strings[0]) : kGlasses.end();
  if (glass == kGlasses.end()) {
    p.error_at(*eta, "is not a supported index of refraction: expected a float, or a glass such as 'glass-BK7'");
    return 1.5;
  }
  p.warn(fmt::format("refracts all colours alike: {} has the index {}", glass->first, glass->second));
  return glass->second;
}

/// pbrt's metals (spectrum.cpp) in linear Rec. 709 RGB, by the sums of spectrum_to_rgb() with SpectrumRole::kIndex.
struct Metal {
  const char* name;
  Spectrum eta, k;
};
const Metal kMetals[] = {
    {"Ag", {0.12849f, 0.12353f, 0.15088f}, {4.06518f, 3.28615f, 2.39157f}},
    {"Al", {1.40751f, 0.92664f, 0.58402f}, {7.74094f, 6.60235f, 5.35991f}},
    {"Au", {0.07996f, 0.4051f, 1.5607f}, {3.3905f, 2.50348f, 1.77087f}},
    {"Cu", {0.10517f, 0.9779f, 1.20456f}, {3.27379f, 2.59248f, 2.36897f}},
    {"CuZn", {0.41844f, 0.52008f, 1.12293f}, {3.66793f, 2.68058f, 1.77125f}},
    {"MgO", {1.73384f, 1.74092f, 1.75339f}, {0, 0, 0}},
    {"TiO2", {2.86065f, 2.95648f, 3.18524f}, {0.00009f, 0, 0.00057f}},
};

/// `name` of a conductor, 'eta' or 'k': a colour, a spectrum, or that of one of pbrt's metals, "metal-Au-eta"; by
/// default that of copper. Nullopt after an error.
std::optional<Value> metal_value(PbrtParameters& p, const std::string& name, const PbrtNames& names) {
  const PbrtParameter* given = p.find(name);
  if (given && (given->type != "spectrum" || given->strings.size() != 1)) return spectrum_value(p, name, names);
  const std::string text = given ? given->strings[0] : "metal-Cu-" + name;
  for (const Metal& metal : kMetals)
    if (text == fmt::format("metal-{}-{}", metal.name, name)) return ColourValue{name == "k" ? metal.k : metal.eta};
  std::string known;
  for (const Metal& metal : kMetals)
    known += fmt::format("{}'metal-{}-{}'", known.empty() ? "" : ", ", metal.name, name);
  p.error_at(*given, fmt::format("names the spectrum '{}'; supported: {}", text, known));
  return std::nullopt;
}

ObjectBuilder conductor(PbrtParameters& p, const PbrtNames& names) {
  const auto rough = roughness(p, names);
  if (!rough) return nullptr;
  auto model = make_object("bsdf", rough->smooth() ? "conductor" : "roughconductor", p.where());
  if (!rough->smooth()) rough->set(*model);
  if (p.has("reflectance")) {
    const auto value = reflectance_value(p, "reflectance", names);
    if (!value) return nullptr;
    const auto* colour = std::get_if<ColourValue>(&*value);
    if (!colour) {
      p.error("has a 'reflectance' that is not an 'rgb'; others are not supported");
      return nullptr;
    }
    // pbrt: the k with this reflectance at eta = 1.
    Spectrum k;
    for (int c = 0; c < 3; ++c) {
      const float r = std::clamp(colour->rgb[c], 0.0f, 0.9999f);
      k[c] = 2 * std::sqrt(r) / std::sqrt(1 - r);
    }
    set_property(*model, "eta", 1.0);
    set_property(*model, "k", ColourValue{k});
    return two_sided(model);
  }
  const auto eta = metal_value(p, "eta", names), k = metal_value(p, "k", names);
  if (!eta || !k) return nullptr;
  set_property(*model, "eta", *eta);
  set_property(*model, "k", *k);
  return two_sided(model);
}

ObjectBuilder dielectric(PbrtParameters& p, const PbrtNames& names, bool thin) {
  std::optional<Roughness> rough = Roughness();
  if (!thin) rough = roughness(p, names);
  if (!rough) return nullptr;
  auto model = make_object("bsdf",
                           thin              ? "thindielectric"
                           : rough->smooth() ? "dielectric"
                                             : "roughdielectric",
                           p.where());
  if (!thin && !rough->smooth()) rough->set(*model);
  set_property(*model, "int_ior", index_of_refraction(p));
  set_property(*model, "ext_ior", 1.0);
  return model;
}

/// pbrt simulates light transport between the layers; `plastic` has it in closed form, without absorption over the
/// thickness of the clear layer.
ObjectBuilder coated_diffuse(PbrtParameters& p, const PbrtNames& names) {
  const auto rough = roughness(p, names);
  const auto reflectance = p.has("reflectance") ? reflectance_value(p, "reflectance", names) : Value(0.5);
  if (!rough || !reflectance) return nullptr;
  if (const auto albedo = p.has("albedo") ? spectrum_value(p, "albedo", names) : std::nullopt; albedo)
    if (const auto* colour = std::get_if<ColourValue>(&*albedo); !colour || max_component(colour->rgb) > 0)
      p.error("has an 'albedo': scattering between the layers is not supported");
  p.ignore({"thickness", "g", "maxdepth", "nsamples"});
  auto model = make_object("bsdf", rough->smooth() ? "plastic" : "roughplastic", p.where());
  if (!rough->smooth()) {
    const auto *u = std::get_if<double>(&rough->u), *v = std::get_if<double>(&rough->v);
    if (!u || !v || *u != *v) {
      p.error("has a roughness that is a texture, or differs along u and v; supported: one number");
      return nullptr;
    }
    set_property(*model, "distribution", std::string("ggx"));
    set_property(*model, "alpha", *u);
  }
  set_property(*model, "diffuse_reflectance", *reflectance);
  set_property(*model, "nonlinear", true);
  set_property(*model, "int_ior", index_of_refraction(p));
  set_property(*model, "ext_ior", 1.0);
  p.warn(fmt::format("is read as '{}', whose clear layer absorbs no light", model->type));
  return two_sided(model);
}

ObjectBuilder diffuse(PbrtParameters& p, const PbrtNames& names) {
  auto model = make_object("bsdf", "diffuse", p.where());
  if (p.has("reflectance")) {
    const auto reflectance = reflectance_value(p, "reflectance", names);
    if (!reflectance) return nullptr;
    set_property(*model, "reflectance", *reflectance);
  }
  return two_sided(model);
}

ObjectBuilder mix(PbrtParameters& p, const PbrtNames& names) {
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
    const auto found = names.materials.find(name);
    if (found == names.materials.end()) {
      p.error_at(*materials, fmt::format("names the material '{}', which no MakeNamedMaterial before it has", name));
      return nullptr;
    }
    if (!found->second) return nullptr;
    set_property(*model, "", found->second);
  }
  return model;
}

/// The same model as ours. Without a colour, it is pbrt's brown hair.
ObjectBuilder hair(PbrtParameters& p, const PbrtNames& names) {
  auto model = make_object("bsdf", "hair", p.where());
  const auto beta = [&](const char* name) { return std::clamp(p.get_float(name, 0.3), 0.01, 1.0); };  // as pbrt
  const double n = beta("beta_n");
  set_property(*model, "longitudinal_roughness", beta("beta_m"));
  set_property(*model, "azimuthal_roughness", n);
  set_property(*model, "scale_tilt", p.get_float("alpha", 2));
  set_property(*model, "int_ior", p.get_float("eta", 1.55));
  set_property(*model, "ext_ior", 1.0);
  if (p.has("sigma_a")) {
    const auto absorption = spectrum_value(p, "sigma_a", names);
    if (!absorption) return nullptr;
    set_property(*model, "sigma_a", *absorption);
  } else if (const char* name = p.has("reflectance") ? "reflectance" : "color"; p.has(name)) {
    const auto value = reflectance_value(p, name, names);
    const auto* colour = value ? std::get_if<ColourValue>(&*value) : nullptr;
    if (value && !colour) p.error("has a 'reflectance' that is not an 'rgb'; others are not supported");
    if (!colour) return nullptr;
    // [Chiang2016]: absorption = (ln colour / D(beta_n))^2, as in bsdfs/hair.cpp.
    const double d =
        5.969 - 0.215 * n + 2.532 * n * n - 10.73 * std::pow(n, 3) + 5.574 * std::pow(n, 4) + 0.245 * std::pow(n, 5);
    Spectrum absorption;
    for (int c = 0; c < 3; ++c)
      absorption[c] = static_cast<float>(std::pow(std::log(std::clamp(colour->rgb[c], 1e-4f, 1.0f)) / d, 2));
    set_property(*model, "sigma_a", ColourValue{absorption});
  } else {
    set_property(*model, "eumelanin", p.get_float("eumelanin", p.has("pheomelanin") ? 0 : 1.3));
    set_property(*model, "pheomelanin", p.get_float("pheomelanin", 0));
  }
  return model;
}

ObjectBuilder base_material(const std::string& type, PbrtParameters& p, const PbrtNames& names) {
  if (type == "diffuse") return diffuse(p, names);
  if (type == "coateddiffuse") return coated_diffuse(p, names);
  if (type == "conductor") return conductor(p, names);
  if (type == "dielectric" || type == "thindielectric") return dielectric(p, names, type == "thindielectric");
  if (type == "interface" || type.empty() || type == "none") return make_object("bsdf", "null", p.where());
  if (type == "hair") return hair(p, names);
  if (type == "mix") return mix(p, names);
  if (type == "measured") {
    auto model = make_object("bsdf", "measured", p.where(), {{"filename", p.get_string("filename", "")}});
    return two_sided(model);
  }
  p.error(
      "is not supported; supported: materials 'coateddiffuse', 'conductor', 'dielectric', 'diffuse', 'hair', "
      "'interface', 'measured', 'mix' and 'thindielectric'");
  return nullptr;
}

}  // namespace

ObjectBuilder make_pbrt_material(const std::string& type, PbrtParameters& p, const PbrtNames& names) {
  ObjectBuilder model = base_material(type, p, names);
  if (const std::string file = p.get_string("normalmap", ""); !file.empty() && model) {
    auto map = make_object(
        "texture", "bitmap", p.where(),
        {{"filename", file}, {"raw", true}, {"to_uv", Transform::translate({0, 1, 0}) * Transform::scale({1, -1, 1})}});
    auto mapped = make_object("bsdf", "normalmap", p.where(), {{"normalmap", ObjectPtr(map)}, {"", ObjectPtr(model)}});
    model = mapped;
  }
  if (!p.has("displacement") || !model) return model;
  const auto displacement = float_value(p, "displacement", 0, names);
  if (!displacement || !std::holds_alternative<ObjectPtr>(*displacement)) return model;
  return make_object("bsdf", "bumpmap", p.where(), {{"", *displacement}, {"", ObjectPtr(model)}});
}

}  // namespace covary
