// SPDX-License-Identifier: Apache-2.0
// pbrt media: absorption and scattering coefficients as extinction and single-scattering albedo; grids as Mitsuba's
// volume files in memory.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "core/perlin_noise.h"
#include "pbrt/pbrt_nanovdb.h"
#include "pbrt/pbrt_objects.h"
#include "scene/embedded_data.h"

namespace covary {
namespace {

constexpr double kYIntegral = 106.856895;  // of the CIE's y over nanometres

struct Coefficients {
  Spectrum absorbed, scattered;  ///< per unit length, before scale
};

/// pbrt's default is 1; a preset takes precedence. Nullopt after an error.
std::optional<Coefficients> coefficients(PbrtParameters& p, PbrtNames& names) {
  Coefficients result{Spectrum(1), Spectrum(1)};
  const std::string preset = p.get_string("preset", "");
  const PbrtMediumPreset* known = pbrt_medium_preset(preset);
  if (!preset.empty() && !known) p.warn(fmt::format("names the preset '{}', which pbrt does not know either", preset));
  for (auto [name, value] : {std::pair{"sigma_a", &result.absorbed}, {"sigma_s", &result.scattered}})
    if (p.has(name)) {
      const auto given = spectrum_value(p, name, names);
      if (!given) return std::nullopt;
      *value = plain_colour(*given);
    }
  if (known) result = {known->sigma_a, known->sigma_s};
  return result;
}

Spectrum albedo_of(const Coefficients& c) {
  Spectrum albedo;
  for (int i = 0; i < 3; ++i) {
    const float sum = c.absorbed[i] + c.scattered[i];
    albedo[i] = sum > 0 ? c.scattered[i] / sum : 0;
  }
  return albedo;
}

void set_phase(PbrtParameters& p, ObjectDescription& medium) {
  const double g = p.get_float("g", 0);
  auto phase = make_object("phase", g == 0 ? "isotropic" : "hg", p.where());
  if (g != 0) set_property(*phase, "g", g);
  set_property(medium, "", ObjectPtr(phase));
}

/// What the medium emits per unit that it absorbs.
void set_glow(ObjectDescription& medium, Value radiance) { set_property(medium, "radiance", std::move(radiance)); }

ObjectBuilder homogeneous(PbrtParameters& p, PbrtNames& names) {
  const auto given = coefficients(p, names);
  if (!given) return nullptr;
  Spectrum extinction = given->absorbed + given->scattered;
  // Mitsuba accepts no extinction colour above 1.
  const float unit = std::max(max_component(extinction), 1.0f);
  extinction = extinction / unit;
  auto medium = make_object("medium", "homogeneous", p.where(),
                            {{"sigma_t", ColourValue{extinction}},
                             {"albedo", ColourValue{albedo_of(*given)}},
                             {"scale", p.get_float("scale", 1) * unit}});
  set_phase(p, *medium);
  if (!names.version_3 && p.has("Le"))
    set_glow(*medium, ColourValue{light_colour(p, "Le", names) *
                                  static_cast<float>(p.get_float("Lescale", 1) * names.exposure)});
  return medium;
}

/// Cells of a grid in pbrt's order, x fastest.
struct Grid {
  int64_t size[3] = {1, 1, 1};
  size_t n_cells() const { return static_cast<size_t>(size[0] * size[1] * size[2]); }
};

std::optional<Grid> read_size(PbrtParameters& p) {
  Grid grid;
  constexpr const char* kNames[] = {"nx", "ny", "nz"};
  for (size_t axis = 0; axis < 3; ++axis) {
    grid.size[axis] = p.get_integer(kNames[axis], 1);
    if (grid.size[axis] < 1 || grid.size[axis] > 65536) {
      p.error(fmt::format("has {} {}; expected 1 to 65536", kNames[axis], grid.size[axis]));
      return std::nullopt;
    }
  }
  return grid;
}

/// Mitsuba's format (media/volume_file.h). `channels` values a cell.
std::string volume_bytes(const Grid& grid, const std::vector<float>& values, int32_t channels) {
  std::string bytes = "VOL\3";
  const auto add = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
  add(int32_t{1});
  for (const int64_t n : grid.size) add(static_cast<int32_t>(n));
  add(channels);
  for (const float bound : {0.f, 0.f, 0.f, 1.f, 1.f, 1.f}) add(bound);
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  return bytes;
}

ObjectPtr grid_volume(PbrtParameters& p, const Grid& grid, const std::vector<float>& values, int32_t channels,
                      const Transform& to_world) {
  return make_object("volume", "gridvolume", p.where(),
                     {{std::string(kEmbeddedData), volume_bytes(grid, values, channels)},
                      {"wrap_mode", std::string("zero")},
                      {"to_world", to_world}});
}

/// The box from p0 to p1.
Transform box_of(PbrtParameters& p, const Transform& to_world) {
  const Vec3 low = p.get_vec3("p0", {0, 0, 0}), high = p.get_vec3("p1", {1, 1, 1});
  const Vec3 extent = high - low;
  if (!(extent.x * extent.y * extent.z != 0)) {
    p.error("has an empty box from p0 to p1");
    return to_world;
  }
  return to_world * Transform::translate(low) * Transform::scale(extent);
}

/// Values of an array as floats; empty after an error.
std::vector<float> cells(PbrtParameters& p, const char* name, const char* type, size_t width, const Grid& grid) {
  const std::vector<double> given = p.get_array(name, type, width);
  if (given.size() != grid.n_cells() * width) {
    p.error(fmt::format("has {} values for '{}', but {} x {} x {} cells", given.size() / width, name, grid.size[0],
                        grid.size[1], grid.size[2]));
    return {};
  }
  std::vector<float> values(given.begin(), given.end());
  if (std::ranges::any_of(values, [](float x) { return x < 0; })) {
    p.warn(fmt::format("has negative values of '{}', which are read as 0", name));
    for (float& value : values) value = std::max(value, 0.0f);
  }
  return values;
}

/// A black body's light is that of its spectrum of maximum 1, in pbrt's units: white light of radiance 1 has a
/// luminance of 1 / ∫ y there.
Spectrum glow_of(double temperature) {
  return temperature > 100
             ? spectrum_to_rgb(pbrt_blackbody(temperature), SpectrumRole::kEmission) * static_cast<float>(kYIntegral)
             : Spectrum();
}

/// The glow of cells of these temperatures, whatever their unit. Between cells, light is interpolated.
ObjectPtr glow_of_temperatures(PbrtParameters& p, const Grid& grid, const std::vector<float>& temperatures,
                               const std::vector<float>& factors, const Transform& box, double exposure) {
  const double offset = p.get_float("temperatureoffset", p.get_float("temperaturecutoff", 0)),
               scale = p.get_float("temperaturescale", 1);
  std::map<int64_t, Spectrum> known;  // by kelvins
  std::vector<float> glow;
  float most = 0;
  for (size_t i = 0; i < temperatures.size(); ++i) {
    const double kelvins = std::clamp((temperatures[i] - offset) * scale, 0.0, 1e6);
    const auto [found, is_new] = known.try_emplace(std::llround(kelvins));
    if (is_new) found->second = glow_of(static_cast<double>(found->first));
    const float factor = factors.size() == 1 ? factors[0] : factors[i];
    for (int c = 0; c < 3; ++c) {
      glow.push_back(found->second[c] * factor * static_cast<float>(exposure));
      most = std::max(most, glow.back());
    }
  }
  return most > 0 ? grid_volume(p, grid, glow, 3, box) : nullptr;
}

/// Sets `Le` times the grid or number `Lescale`, or the black bodies of `temperature`.
bool set_grid_glow(PbrtParameters& p, const Grid& grid, const Transform& box, PbrtNames& names,
                   ObjectDescription& medium) {
  std::vector<float> factors = {1};
  if (p.has("Lescale")) {
    factors = cells(p, "Lescale", "float", 1, grid);
    if (factors.empty()) return false;
  }
  if (p.has("temperature")) {
    if (p.has("Le")) p.error("has both 'Le' and 'temperature'; pbrt allows one of them");
    const std::vector<float> temperatures = cells(p, "temperature", "float", 1, grid);
    if (temperatures.empty()) return false;
    if (const ObjectPtr glow = glow_of_temperatures(p, grid, temperatures, factors, box, names.exposure))
      set_glow(medium, glow);
    return true;
  }
  p.ignore({"temperaturescale", "temperatureoffset", "temperaturecutoff"});
  if (!p.has("Le")) return true;
  const Spectrum colour = light_colour(p, "Le", names) * static_cast<float>(names.exposure);
  if (factors.size() == 1) {
    set_glow(medium, ColourValue{colour});
    return true;
  }
  std::vector<float> glow;
  for (const float factor : factors)
    for (int c = 0; c < 3; ++c) glow.push_back(factor * colour[c]);
  set_glow(medium, grid_volume(p, grid, glow, 3, box));
  return true;
}

/// A density in [0, …) times constant coefficients.
ObjectBuilder of_density(PbrtParameters& p, const Grid& grid, const std::vector<float>& density, const Transform& box,
                         PbrtNames& names) {
  const auto given = coefficients(p, names);
  if (!given) return nullptr;
  const Spectrum extinction = given->absorbed + given->scattered;
  const bool grey = extinction.r == extinction.g && extinction.g == extinction.b;
  std::vector<float> coloured;
  for (size_t i = 0; !grey && i < density.size(); ++i)
    for (int c = 0; c < 3; ++c) coloured.push_back(density[i] * extinction[c]);
  auto medium = make_object("medium", "heterogeneous", p.where(),
                            {{"sigma_t", grid_volume(p, grid, grey ? density : coloured, grey ? 1 : 3, box)},
                             {"albedo", ColourValue{albedo_of(*given)}},
                             {"scale", p.get_float("scale", 1) * (grey ? double{extinction.r} : 1)}});
  set_phase(p, *medium);
  return medium;
}

ObjectBuilder uniform_grid(PbrtParameters& p, const Transform& to_world, PbrtNames& names) {
  const auto grid = read_size(p);
  if (!grid) return nullptr;
  const std::vector<float> density = cells(p, "density", "float", 1, *grid);
  if (density.empty()) return nullptr;
  const Transform box = box_of(p, to_world);
  const ObjectBuilder medium = of_density(p, *grid, density, box, names);
  if (names.version_3) return medium;
  return medium && set_grid_glow(p, *grid, box, names, *medium) ? medium : nullptr;
}

ObjectBuilder rgb_grid(PbrtParameters& p, const Transform& to_world, const PbrtNames& names) {
  const auto grid = read_size(p);
  if (!grid) return nullptr;
  std::vector<float> absorbed(3 * grid->n_cells(), 1.0f), scattered = absorbed;
  if (p.has("sigma_a")) absorbed = cells(p, "sigma_a", "rgb", 3, *grid);
  if (p.has("sigma_s")) scattered = cells(p, "sigma_s", "rgb", 3, *grid);
  if (absorbed.empty() || scattered.empty()) return nullptr;
  const Transform box = box_of(p, to_world);
  std::vector<float> extinction(absorbed.size()), albedo(absorbed.size());
  for (size_t i = 0; i < absorbed.size(); ++i) {
    extinction[i] = absorbed[i] + scattered[i];
    albedo[i] = extinction[i] > 0 ? scattered[i] / extinction[i] : 0;
  }
  auto medium = make_object("medium", "heterogeneous", p.where(),
                            {{"sigma_t", grid_volume(p, *grid, extinction, 3, box)},
                             {"albedo", grid_volume(p, *grid, albedo, 3, box)},
                             {"scale", p.get_float("scale", 1)}});
  set_phase(p, *medium);
  if (!p.has("Le")) return medium;
  // Unlike that of lights, this light is not relative to that of white.
  const auto scale = static_cast<float>(p.get_float("Lescale", 1) * kYIntegral * names.exposure);
  std::vector<float> glow = cells(p, "Le", "rgb", 3, *grid);
  for (float& value : glow) value *= scale;
  if (glow.empty()) return nullptr;
  set_glow(*medium, grid_volume(p, *grid, glow, 3, box));
  return medium;
}

/// pbrt's cloud (media.h: CloudMedium::Density), on a grid.
float cloud_density(const Vec3& p, float density, float wispiness, float frequency) {
  Vec3 q = p * frequency;
  float strength = 0.05f * wispiness, scale = 10;
  for (int i = 0; wispiness > 0 && i < 2; ++i, strength *= 0.5f, scale *= 1.99f) {
    constexpr float kStep = 0.01f;
    const Vec3 at = q * scale;
    const float n = perlin_noise(at);
    q += Vec3{perlin_noise(at + Vec3{kStep, 0, 0}) - n, perlin_noise(at + Vec3{0, kStep, 0}) - n,
              perlin_noise(at + Vec3{0, 0, kStep}) - n} *
         (strength / kStep);
  }
  const float d = 0.5f * fractal_noise(q, 0.5f, 5);
  const float thinned = std::clamp((1 - p.y) * 4.5f * density * d, 0.0f, 1.0f);
  return std::clamp(thinned + 2 * std::max(0.0f, 0.5f - p.y), 0.0f, 1.0f);
}

ObjectBuilder cloud(PbrtParameters& p, const Transform& to_world, PbrtNames& names) {
  constexpr int64_t kCells = 96;
  const Vec3 low = p.get_vec3("p0", {0, 0, 0}), high = p.get_vec3("p1", {1, 1, 1});
  const auto number = [&](const char* name, double fallback) {
    return static_cast<float>(p.get_float(name, fallback));
  };
  const float density = number("density", 1), wispiness = number("wispiness", 1), frequency = number("frequency", 5);
  const Grid grid{{kCells, kCells, kCells}};
  std::vector<float> values;
  for (int64_t z = 0; z < kCells; ++z)
    for (int64_t y = 0; y < kCells; ++y)
      for (int64_t x = 0; x < kCells; ++x) {
        const auto at = [&](int64_t i, float a, float b) {
          return a + (b - a) * (static_cast<float>(i) + 0.5f) / static_cast<float>(kCells);
        };
        values.push_back(cloud_density({at(x, low.x, high.x), at(y, low.y, high.y), at(z, low.z, high.z)}, density,
                                       wispiness, frequency));
      }
  p.warn(fmt::format("is sampled at {0} x {0} x {0} points", kCells));
  return of_density(p, grid, values, box_of(p, to_world), names);
}

ObjectBuilder nanovdb(PbrtParameters& p, const Transform& to_world, PbrtNames& names) {
  const std::string filename = p.get_string("filename", ""), density_name = p.get_string("gridname", "density");
  const std::string temperature_name = p.get_string("temperaturename", "temperature");
  try {
    Diagnostics missing;
    const std::string path = names.files().resolve(filename, p.where(), missing);
    missing.throw_if_errors();
    const auto density = read_nanovdb(path, density_name);
    if (!density) {
      p.error(fmt::format("names '{}', which has no grid '{}'", filename, density_name));
      return nullptr;
    }
    if (density->step > 1) p.warn(fmt::format("is sampled at every {}th of its voxels", density->step));
    const Grid grid{{density->size[0], density->size[1], density->size[2]}};
    const Transform box = to_world * density->box;
    const ObjectBuilder medium = of_density(p, grid, density->values, box, names);
    if (const auto temperature = read_nanovdb(path, temperature_name, &*density); temperature && medium)
      if (const ObjectPtr glow = glow_of_temperatures(
              p, grid, temperature->values, {static_cast<float>(p.get_float("Lescale", 1))}, box, names.exposure))
        set_glow(*medium, glow);
    p.ignore({"Le", "Lescale", "temperaturescale", "temperatureoffset", "temperaturecutoff"});
    return medium;
  } catch (const Error& error) {
    p.error(fmt::format("cannot be used: {}", error.what()));
    return nullptr;
  }
}

}  // namespace

ObjectBuilder make_pbrt_medium(const std::string& type, PbrtParameters& p, const Transform& to_world,
                               PbrtNames& names) {
  p.rename("LeScale", "Lescale");
  if (type == "homogeneous") return homogeneous(p, names);
  if (type == "uniformgrid" || type == "heterogeneous") return uniform_grid(p, to_world, names);
  if (type == "rgbgrid") return rgb_grid(p, to_world, names);
  if (type == "cloud") return cloud(p, to_world, names);
  if (type == "nanovdb") return nanovdb(p, to_world, names);
  p.error(fmt::format("is of the type '{}'; supported: 'cloud', 'homogeneous', 'nanovdb', 'rgbgrid' and 'uniformgrid'",
                      type));
  return nullptr;
}

}  // namespace covary
