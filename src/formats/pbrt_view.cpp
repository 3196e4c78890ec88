// SPDX-License-Identifier: Apache-2.0
// Lights of pbrt-v4, and the directives before WorldBegin: camera, film, filter, sampler, integrator.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/pbrt_objects.h"

namespace covary {
namespace {

constexpr float kLensDistance = 1e6f;  // pbrt's default focal distance

/// A direction that pbrt specifies by two points.
struct Aim {
  Vec3 from, to;
};
Aim read_aim(PbrtParameters& p) { return {p.get_vec3("from", {0, 0, 0}), p.get_vec3("to", {0, 0, 1})}; }

ColourValue scaled_colour(PbrtParameters& p, const char* name) {
  const Spectrum colour = light_colour(p, name);
  return {colour * static_cast<float>(p.get_float("scale", 1))};
}

void refuse(PbrtParameters& p, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const PbrtParameter* parameter = p.find(name)) p.error_at(*parameter, "is not supported");
}

ObjectPtr spot(PbrtParameters& p, const Transform& to_world) {
  const double cone = p.get_float("coneangle", 30), edge = p.get_float("conedeltaangle", 5);
  const Aim aim = read_aim(p);
  refuse(p, {"power"});
  auto light = make_object(
      "emitter", "spot", p.where(),
      {{"intensity", scaled_colour(p, "I")}, {"cutoff_angle", cone}, {"beam_width", std::max(cone - edge, 0.0)}});
  const Vec3 z = aim.to - aim.from, up = std::abs(z.x) > std::abs(z.y) ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
  try {
    set_property(*light, "to_world", to_world * Transform::look_at(aim.from, aim.to, up));
  } catch (const Error&) {
    p.error("has the same point as origin and target");
    return nullptr;
  }
  if (edge > 0) p.warn("has a smooth edge, which is linear here");
  return light;
}

ObjectPtr infinite(PbrtParameters& p, const Transform& to_world) {
  refuse(p, {"portal", "illuminance"});
  if (const PbrtParameter* file = p.find("filename")) {
    if (p.has("L")) p.error_at(*file, "is given with 'L'; only one of them is allowed");
    return make_object("emitter", "envmap", p.where(),
                       {{"filename", p.get_string("filename", "")},
                        {"mapping", std::string("equal_area")},
                        {"scale", p.get_float("scale", 1)},
                        {"to_world", to_world}});
  }
  return make_object("emitter", "constant", p.where(), {{"radiance", scaled_colour(p, "L")}});
}

}  // namespace

ObjectPtr make_pbrt_light(const std::string& type, PbrtParameters& p, const Transform& to_world) {
  if (type == "point") {
    refuse(p, {"power"});
    return make_object(
        "emitter", "point", p.where(),
        {{"intensity", scaled_colour(p, "I")}, {"position", to_world.point(p.get_vec3("from", {0, 0, 0}))}});
  }
  if (type == "distant") {
    refuse(p, {"illuminance"});
    const Aim aim = read_aim(p);
    return make_object("emitter", "directional", p.where(),
                       {{"irradiance", scaled_colour(p, "L")}, {"direction", to_world.vector(aim.to - aim.from)}});
  }
  if (type == "spot") return spot(p, to_world);
  if (type == "infinite") return infinite(p, to_world);
  const char* instead = type == "projection"    ? " In XML, use 'projector'."
                        : type == "goniometric" ? " A 'point' without its pattern shines alike in all directions."
                                                : "";
  p.error(fmt::format("is not supported; supported: lights 'distant', 'infinite', 'point' and 'spot'.{}", instead));
  return nullptr;
}

ObjectPtr make_pbrt_area_light(const std::string& type, PbrtParameters& p) {
  if (type != "diffuse") {
    p.error("is not supported; supported: 'diffuse'");
    return nullptr;
  }
  refuse(p, {"power", "filename"});
  if (p.get_bool("twosided", false)) p.error("shines on both sides, which is not supported");
  return make_object("emitter", "area", p.where(), {{"radiance", scaled_colour(p, "L")}});
}

void read_pbrt_camera(const std::string& type, PbrtParameters& p, const Transform& world_to_camera, PbrtView& view) {
  if (type != "perspective" && type != "orthographic") {
    p.error("is not supported; supported: cameras 'orthographic' and 'perspective'");
    return;
  }
  refuse(p, {"screenwindow", "frameaspectratio"});
  p.ignore({"shutteropen", "shutterclose"});
  const double lens = p.get_float("lensradius", 0), focus = p.get_float("focaldistance", kLensDistance);
  view.orthographic = type == "orthographic";
  view.sensor = make_object("sensor", view.orthographic ? type : lens > 0 ? "thinlens" : "perspective", p.where());
  view.camera_to_world = world_to_camera.inverse();
  if (view.orthographic) {
    if (lens > 0) p.error("is orthographic with a lens, which is not supported");
    return;
  }
  set_property(*view.sensor, "fov", p.get_float("fov", 90));
  set_property(*view.sensor, "fov_axis", std::string("smaller"));
  set_property(*view.sensor, "far_clip", 1e7);
  if (!(lens > 0)) return;
  set_property(*view.sensor, "aperture_radius", lens);
  set_property(*view.sensor, "focus_distance", focus);
}

void read_pbrt_film(const std::string& type, PbrtParameters& p, PbrtView& view) {
  if (type != "rgb" && type != "gbuffer" && type != "spectral") {
    p.error("is not supported; supported: films 'rgb', 'gbuffer' and 'spectral'");
    return;
  }
  auto film = make_object("film", "hdrfilm", p.where());
  const int64_t width = p.get_integer("xresolution", 1280), height = p.get_integer("yresolution", 720);
  set_property(*film, "width", width);
  set_property(*film, "height", height);
  int64_t crop[4] = {0, width, 0, height};
  if (const std::vector<double> window = p.get_array("cropwindow", "float", 4); window.size() == 4)
    for (int i = 0; i < 4; ++i)
      crop[i] = std::clamp<int64_t>(std::llround(std::ceil(window[i] * static_cast<double>(i < 2 ? width : height))), 0,
                                    i < 2 ? width : height);
  if (const std::vector<double> bounds = p.get_array("pixelbounds", "integer", 4); bounds.size() == 4)
    for (int i = 0; i < 4; ++i) crop[i] = std::llround(std::clamp(bounds[i], 0.0, 65536.0));
  if (crop[0] > 0 || crop[2] > 0 || crop[1] < width || crop[3] < height) {
    set_property(*film, "crop_offset_x", crop[0]);
    set_property(*film, "crop_width", crop[1] - crop[0]);
    set_property(*film, "crop_offset_y", crop[2]);
    set_property(*film, "crop_height", crop[3] - crop[2]);
  }
  const std::string sensor = p.get_string("sensor", "cie1931");
  if (sensor != "cie1931" || p.get_float("iso", 100) != 100 || p.get_float("exposuretime", 1) != 1)
    p.warn("has a sensor of its own; it is rendered as 'cie1931' at ISO 100");
  p.ignore({"filename", "savefp16", "diagonal", "whitebalance", "maxcomponentvalue", "coordinatesystem", "nbuckets",
            "lambdamin", "lambdamax"});
  view.film = film;
}

void read_pbrt_filter(const std::string& type, PbrtParameters& p, PbrtView& view) {
  const double x = p.get_float("xradius", type == "box" ? 0.5 : 1.5), y = p.get_float("yradius", x);
  if (type == "box" && x == 0.5 && y == 0.5) {
    view.filter = make_object("rfilter", "box", p.where());
  } else if (type == "triangle" && x == y) {
    view.filter = make_object("rfilter", "tent", p.where());
    set_property(*view.filter, "radius", x);
  } else {
    view.filter = make_object("rfilter", "gaussian", p.where());
    set_property(*view.filter, "stddev", p.get_float("sigma", 0.5));
    if (type != "gaussian") p.warn("is read as 'gaussian'");
  }
  p.ignore({"sigma", "B", "C", "tau"});
}

void read_pbrt_sampler(const std::string& type, PbrtParameters& p, PbrtView& view) {
  const bool independent = type == "independent";
  if (!independent && type != "sobol") p.warn("is read as 'sobol'");
  view.sampler = make_object("sampler", independent ? "independent" : "sobol", p.where());
  int64_t samples = p.get_integer("pixelsamples", 16);
  if (p.has("xsamples") || p.has("ysamples")) samples = p.get_integer("xsamples", 4) * p.get_integer("ysamples", 4);
  set_property(*view.sampler, "sample_count", samples);
  p.ignore({"seed", "randomization", "jitter"});
}

void read_pbrt_integrator(const std::string& type, PbrtParameters& p, PbrtView& view) {
  const bool bidirectional = type == "bdpt";
  if (!bidirectional && type != "path" && type != "volpath")
    p.warn("is read as 'path': the expected picture is the same");
  view.integrator = make_object("integrator", bidirectional ? "bdpt" : "path", p.where());
  // pbrt counts scattering events on a path; here its edges count.
  set_property(*view.integrator, "max_depth", p.get_integer("maxdepth", 5) + 1);
  p.ignore({"regularize", "lightsampler", "visualizestrategies", "visualizeweights", "samplelights", "samplebsdf",
            "imagefile", "iterations", "photonsperiteration", "radius", "seed", "bootstrapsamples", "chains",
            "mutationsperpixel", "largestepprobability", "sigma", "rrthreshold"});
}

std::vector<ObjectPtr> finish_pbrt_view(PbrtView view, const SourceLocation& where) {
  if (!view.film) view.film = make_object("film", "hdrfilm", where);
  if (view.film->properties.empty()) {
    set_property(*view.film, "width", int64_t{1280});
    set_property(*view.film, "height", int64_t{720});
  }
  if (view.filter) set_property(*view.film, "", ObjectPtr(view.filter));
  if (!view.sampler) {
    view.sampler = make_object("sampler", "independent", where);
    set_property(*view.sampler, "sample_count", int64_t{16});
  }
  if (!view.sensor) {
    view.sensor = make_object("sensor", "perspective", where);
    set_property(*view.sensor, "fov", 90.0);
    set_property(*view.sensor, "fov_axis", std::string("smaller"));
    set_property(*view.sensor, "far_clip", 1e7);
  }
  if (!view.integrator) {
    view.integrator = make_object("integrator", "path", where);
    set_property(*view.integrator, "max_depth", int64_t{6});
  }
  // pbrt's camera space has x to the right, ours to the left.
  Transform flip = Transform::scale({-1, 1, 1});
  if (view.orthographic) {
    const auto size = [&](size_t i) { return static_cast<float>(std::get<int64_t>(view.film->properties[i].value)); };
    const float aspect = size(0) / std::max(size(1), 1.0f), half = std::max(aspect, 1.0f);
    flip = flip * Transform::scale({half, half, 1});
  }
  set_property(*view.sensor, "to_world", view.camera_to_world * flip);
  set_property(*view.sensor, "", ObjectPtr(view.film));
  set_property(*view.sensor, "", ObjectPtr(view.sampler));
  return {view.sensor, view.integrator};
}

}  // namespace covary
