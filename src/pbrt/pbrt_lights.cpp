// SPDX-License-Identifier: Apache-2.0
// Lights of pbrt-v4 (lights.cpp), and of version 3 where its names or images differ.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pbrt/pbrt_objects.h"

namespace covary {
namespace {

/// A direction that pbrt specifies by two points.
struct Aim {
  Vec3 from, to;
};
Aim read_aim(PbrtParameters& p) { return {p.get_vec3("from", {0, 0, 0}), p.get_vec3("to", {0, 0, 1})}; }

/// The factor `scale`, a colour in version 3, and the exposure.
Spectrum scale_of(PbrtParameters& p, double exposure, PbrtNames& names) {
  const PbrtParameter* scale = p.find("scale");
  const Spectrum factor = scale && scale->type != "float" ? light_colour(p, "scale", names)
                                                          : Spectrum(static_cast<float>(p.get_float("scale", 1)));
  return factor * static_cast<float>(exposure);
}

ColourValue scaled_colour(PbrtParameters& p, const char* name, double exposure, PbrtNames& names) {
  return {light_colour(p, name, names) * scale_of(p, exposure, names)};
}

/// Factor on the light so that `name`, a power or an illuminance, has its value, if it is given and positive;
/// `unscaled` is the value for a radiance or intensity of 1.
double target(PbrtParameters& p, const char* name, double unscaled) {
  const double wanted = p.get_float(name, -1);
  return wanted > 0 ? wanted / unscaled : 1;
}

Transform rows(const std::array<std::array<double, 3>, 3>& m) {
  Matrix4 result{};
  for (size_t i = 0; i < 3; ++i)
    for (size_t k = 0; k < 3; ++k) result[i][k] = m[i][k];
  result[3][3] = 1;
  return Transform(result);
}

ObjectPtr spot(PbrtParameters& p, const Transform& to_world, double exposure, PbrtNames& names) {
  const double cone = p.get_float("coneangle", 30), edge = p.get_float("conedeltaangle", 5);
  const Aim aim = read_aim(p);
  const double end = std::cos(cone * M_PI / 180), start = std::cos((cone - edge) * M_PI / 180);
  exposure *= target(p, "power", 2 * M_PI * (1 - start + (start - end) / 2));
  if (names.version_3) p.warn("falls off at its edge as in version 4, a little more slowly");
  auto light = make_object("emitter", "spot", p.where(),
                           {{"intensity", scaled_colour(p, "I", exposure, names)},
                            {"cutoff_angle", cone},
                            {"beam_width", std::max(cone - edge, 0.0)},
                            {"falloff", std::string("smooth")}});
  const Vec3 z = aim.to - aim.from, up = std::abs(z.x) > std::abs(z.y) ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
  try {
    set_property(*light, "to_world", to_world * Transform::look_at(aim.from, aim.to, up));
  } catch (const Error&) {
    p.error("has the same point as origin and target");
    return nullptr;
  }
  return light;
}

/// An empty name is none.
void drop_empty_images(PbrtParameters& p) {
  for (const char* name : {"filename", "mapname"})
    if (p.has(name) && p.get_string(name, "").empty()) p.remove(name);
}

ObjectPtr infinite(PbrtParameters& p, const Transform& to_world, double exposure, PbrtNames& names) {
  drop_empty_images(p);
  const bool old_image = p.has("mapname");  // version 3: longitude and latitude, z up
  p.rename("mapname", "filename");
  if (p.has("portal")) p.warn("shines through a portal alone in pbrt; here it shines from everywhere");
  p.ignore({"portal", "samples", "nsamples"});
  if (!p.has("filename")) {
    exposure *= target(p, "illuminance", M_PI);
    return make_object("emitter", "constant", p.where(), {{"radiance", scaled_colour(p, "L", exposure, names)}});
  }
  if (p.has("illuminance")) p.error("has an image and an 'illuminance', which is not supported; use 'scale'");
  Spectrum scale = scale_of(p, exposure, names);
  if (old_image)
    scale = scale * light_colour(p, "L", names);
  else if (p.has("L"))
    p.error_at(*p.find("filename"), "is given with 'L'; only one of them is allowed");
  p.ignore({"L"});
  const bool grey = scale.r == scale.g && scale.g == scale.b;
  if (!grey) p.warn("has an image and a colour; the image keeps its own colours");
  auto light =
      make_object("emitter", "envmap", p.where(),
                  {{"filename", p.get_string("filename", "")}, {"scale", double{grey ? scale.g : luminance(scale)}}});
  if (!old_image) set_property(*light, "mapping", std::string("equal_area"));
  set_property(*light, "to_world", old_image ? to_world * rows({{{0, 0, -1}, {1, 0, 0}, {0, 1, 0}}}) : to_world);
  return light;
}

ObjectPtr goniometric(PbrtParameters& p, const Transform& to_world, double exposure, PbrtNames& names) {
  drop_empty_images(p);
  const bool old_image = p.has("mapname");
  p.rename("mapname", "filename");
  if (!p.has("filename")) {
    exposure *= target(p, "power", 4 * M_PI);
    return make_object("emitter", "point", p.where(),
                       {{"intensity", scaled_colour(p, "I", exposure, names)}, {"position", to_world.point({})}});
  }
  // The image's second axis points up.
  const Transform axes =
      old_image ? rows({{{0, 0, -1}, {0, 1, 0}, {1, 0, 0}}}) : rows({{{1, 0, 0}, {0, 0, 1}, {0, 1, 0}}});
  auto light = make_object("emitter", "goniometric", p.where(),
                           {{"filename", p.get_string("filename", "")},
                            {"mapping", std::string(old_image ? "latitude_longitude" : "equal_area")},
                            {"grey", !old_image},
                            {"intensity", scaled_colour(p, "I", exposure, names)},
                            {"to_world", to_world * axes}});
  if (const double power = p.get_float("power", 0); power > 0)
    set_property(*light, "power", power);  // for an intensity of 1
  return light;
}

ObjectPtr projection(PbrtParameters& p, const Transform& to_world, double exposure, PbrtNames& names) {
  const bool old_image = p.has("mapname");
  p.rename("mapname", "filename");
  const std::string file = p.get_string("filename", "");
  if (file.empty()) {
    p.error("has no 'filename'");
    return nullptr;
  }
  auto image =
      make_object("texture", "bitmap", p.where(),
                  {{"filename", file}, {"filter_type", std::string("nearest")}, {"wrap_mode", std::string("clamp")}});
  const Spectrum scale = old_image ? scaled_colour(p, "I", exposure, names).rgb : scale_of(p, exposure, names);
  // The image's left is at our light's left side; version 3 does not turn it upside down.
  auto light = make_object("emitter", "projector", p.where(),
                           {{"constant_intensity", true},
                            {"fov", p.get_float("fov", 90)},
                            {"fov_axis", std::string("smaller")},
                            {"to_world", to_world * Transform::scale({-1, old_image ? -1.0f : 1.0f, 1})}});
  const double power = p.get_float("power", 0);
  if (power > 0) set_property(*light, "power", power * double{luminance(scale)});
  set_property(
      *light, "irradiance",
      scale == Spectrum(1) ? ObjectPtr(image) : ObjectPtr(scaled_texture(p.where(), ColourValue{scale}, image)));
  return light;
}

}  // namespace

ObjectPtr make_pbrt_light(const std::string& type, PbrtParameters& p, const Transform& to_world, const PbrtView& view,
                          PbrtNames& names) {
  double exposure = view.exposure();
  if (type == "point") {
    exposure *= target(p, "power", 4 * M_PI);
    return make_object("emitter", "point", p.where(),
                       {{"intensity", scaled_colour(p, "I", exposure, names)},
                        {"position", to_world.point(p.get_vec3("from", {0, 0, 0}))}});
  }
  if (type == "distant") {
    exposure *= target(p, "illuminance", 1);
    const Aim aim = read_aim(p);
    return make_object(
        "emitter", "directional", p.where(),
        {{"irradiance", scaled_colour(p, "L", exposure, names)}, {"direction", to_world.vector(aim.to - aim.from)}});
  }
  if (type == "spot") return spot(p, to_world, exposure, names);
  if (type == "infinite" || type == "exinfinite") return infinite(p, to_world, exposure, names);
  if (type == "goniometric") return goniometric(p, to_world, exposure, names);
  if (type == "projection") return projection(p, to_world, exposure, names);
  p.unknown("lights 'distant', 'goniometric', 'infinite', 'point', 'projection' and 'spot'", "it is left out");
  return nullptr;
}

ObjectPtr make_pbrt_area_light(const std::string& type, PbrtParameters& p, const PbrtView& view, PbrtNames& names) {
  if (type != "diffuse" && type != "area") {
    p.unknown("'diffuse'", "it is left out");
    return nullptr;
  }
  p.ignore({"samples", "nsamples"});
  auto light = make_object("emitter", "area", p.where());
  const std::string file = p.get_string("filename", "");
  const double power = p.get_float("power", 0);
  const double exposure = view.exposure() * (power > 0 ? power : 1);
  if (file.empty()) {
    set_property(*light, "radiance", scaled_colour(p, "L", exposure, names));
  } else {
    if (p.has("L")) p.error_at(*p.find("filename"), "is given with 'L'; only one of them is allowed");
    auto image =
        make_object("texture", "bitmap", p.where(),
                    {{"filename", file}, {"to_uv", Transform::translate({0, 1, 0}) * Transform::scale({1, -1, 1})}});
    set_property(*light, "radiance",
                 ObjectPtr(scaled_texture(p.where(), ColourValue{scale_of(p, exposure, names)}, image)));
    if (power > 0) p.warn("has a power and an image: the power is that of a white image");
  }
  if (p.get_bool("twosided", false)) set_property(*light, "two_sided", true);
  if (power > 0) {
    p.warn("has a power for each triangle of a mesh in pbrt; here all its triangles are equally bright");
    set_property(*light, "power", 1.0);
    set_property(*light, "per_triangle", true);
  }
  return light;
}

}  // namespace covary
