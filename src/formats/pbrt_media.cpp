// SPDX-License-Identifier: Apache-2.0
// pbrt-v4 media: absorption and scattering coefficients as extinction and single-scattering albedo.
#include <fmt/format.h>

#include "formats/pbrt_objects.h"

namespace covary {
namespace {

/// A coefficient per unit length; pbrt's default is 1.
std::optional<Spectrum> cross_section(PbrtParameters& p, const char* name) {
  if (!p.has(name)) return Spectrum(1);
  const auto value = spectrum_value(p, name, {});
  if (!value) return std::nullopt;
  if (const auto* colour = std::get_if<ColourValue>(&*value)) return colour->rgb;
  return spectrum_to_rgb(std::get<SampledSpectrum>(*value), SpectrumRole::kIndex);
}

}  // namespace

ObjectBuilder make_pbrt_medium(const std::string& type, PbrtParameters& p) {
  if (type != "homogeneous") {
    p.error(
        fmt::format("is of the type '{}'; supported: 'homogeneous'. Grids can be given in XML, by 'gridvolume'", type));
    return nullptr;
  }
  for (const char* name : {"Le", "preset"})
    if (const PbrtParameter* parameter = p.find(name))
      p.error_at(*parameter, std::string(name) == "Le" ? "is not supported: media emit no light here"
                                                       : "is not supported; give 'sigma_a' and 'sigma_s'");
  p.ignore({"Lescale"});
  const auto absorbed = cross_section(p, "sigma_a"), scattered = cross_section(p, "sigma_s");
  if (!absorbed || !scattered) return nullptr;
  Spectrum albedo;
  Spectrum extinction = *absorbed + *scattered;
  for (int c = 0; c < 3; ++c) albedo[c] = extinction[c] > 0 ? (*scattered)[c] / extinction[c] : 0;
  // Mitsuba accepts no extinction colour above 1.
  const float unit = std::max(max_component(extinction), 1.0f);
  extinction = extinction / unit;
  auto medium = make_object("medium", "homogeneous", p.where(),
                            {{"sigma_t", ColourValue{extinction}},
                             {"albedo", ColourValue{albedo}},
                             {"scale", p.get_float("scale", 1) * unit}});
  const double g = p.get_float("g", 0);
  auto phase = make_object("phase", g == 0 ? "isotropic" : "hg", p.where());
  if (g != 0) set_property(*phase, "g", g);
  set_property(*medium, "", ObjectPtr(phase));
  return medium;
}

}  // namespace covary
