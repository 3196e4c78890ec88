// SPDX-License-Identifier: Apache-2.0
// Lights of pbrt-v4, and the directives before WorldBegin: camera, film, filter, sampler, integrator.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/pbrt_objects.h"

namespace covary {
namespace {

constexpr float kLensDistance = 1e6f;  // pbrt's default focal distance
// pbrt clips nothing. Orthographic rays start in the camera's plane.
constexpr double kNearClip = 1e-6, kFarClip = 1e7;

/// A direction that pbrt specifies by two points.
struct Aim {
  Vec3 from, to;
};
Aim read_aim(PbrtParameters& p) { return {p.get_vec3("from", {0, 0, 0}), p.get_vec3("to", {0, 0, 1})}; }

/// A light's colour times its `scale` and `exposure`.
ColourValue scaled_colour(PbrtParameters& p, const char* name, double exposure) {
  const Spectrum colour = light_colour(p, name);
  return {colour * static_cast<float>(p.get_float("scale", 1) * exposure)};
}

/// Factor on the light so that `name`, a power or an illuminance, has its value, if it is given and positive;
/// `unscaled` is the value for a radiance or intensity of 1.
double target(PbrtParameters& p, const char* name, double unscaled) {
  const double wanted = p.get_float(name, -1);
  return wanted > 0 ? wanted / unscaled : 1;
}

void refuse(PbrtParameters& p, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const PbrtParameter* parameter = p.find(name)) p.error_at(*parameter, "is not supported");
}

ObjectPtr spot(PbrtParameters& p, const Transform& to_world, double exposure) {
  const double cone = p.get_float("coneangle", 30), edge = p.get_float("conedeltaangle", 5);
  const Aim aim = read_aim(p);
  const double end = std::cos(cone * M_PI / 180), start = std::cos((cone - edge) * M_PI / 180);
  exposure *= target(p, "power", 2 * M_PI * (1 - start + (start - end) / 2));
  auto light = make_object("emitter", "spot", p.where(),
                           {{"intensity", scaled_colour(p, "I", exposure)},
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

ObjectPtr infinite(PbrtParameters& p, const Transform& to_world, double exposure) {
  refuse(p, {"portal"});
  if (const PbrtParameter* file = p.find("filename")) {
    refuse(p, {"illuminance"});
    if (p.has("L")) p.error_at(*file, "is given with 'L'; only one of them is allowed");
    return make_object("emitter", "envmap", p.where(),
                       {{"filename", p.get_string("filename", "")},
                        {"mapping", std::string("equal_area")},
                        {"scale", p.get_float("scale", 1) * exposure},
                        {"to_world", to_world}});
  }
  exposure *= target(p, "illuminance", M_PI);
  return make_object("emitter", "constant", p.where(), {{"radiance", scaled_colour(p, "L", exposure)}});
}

}  // namespace

ObjectPtr make_pbrt_light(const std::string& type, PbrtParameters& p, const Transform& to_world, double exposure) {
  if (type == "point") {
    exposure *= target(p, "power", 4 * M_PI);
    return make_object(
        "emitter", "point", p.where(),
        {{"intensity", scaled_colour(p, "I", exposure)}, {"position", to_world.point(p.get_vec3("from", {0, 0, 0}))}});
  }
  if (type == "distant") {
    exposure *= target(p, "illuminance", 1);
    const Aim aim = read_aim(p);
    return make_object(
        "emitter", "directional", p.where(),
        {{"irradiance", scaled_colour(p, "L", exposure)}, {"direction", to_world.vector(aim.to - aim.from)}});
  }
  if (type == "spot") return spot(p, to_world, exposure);
  if (type == "infinite") return infinite(p, to_world, exposure);
  const char* instead = type == "projection"    ? " In XML, use 'projector'."
                        : type == "goniometric" ? " A 'point' without its pattern shines alike in all directions."
                                                : "";
  p.error(fmt::format("is not supported; supported: lights 'distant', 'infinite', 'point' and 'spot'.{}", instead));
  return nullptr;
}

ObjectPtr make_pbrt_area_light(const std::string& type, PbrtParameters& p, double exposure) {
  if (type != "diffuse") {
    p.error("is not supported; supported: 'diffuse'");
    return nullptr;
  }
  refuse(p, {"power", "filename"});
  if (p.get_bool("twosided", false)) p.error("shines on both sides, which is not supported");
  return make_object("emitter", "area", p.where(), {{"radiance", scaled_colour(p, "L", exposure)}});
}

void read_pbrt_camera(const std::string& type, PbrtParameters& p, const Transform& world_to_camera, PbrtView& view) {
  if (type != "perspective" && type != "orthographic") {
    p.error("is not supported; supported: cameras 'orthographic' and 'perspective'");
    return;
  }
  refuse(p, {"screenwindow", "frameaspectratio"});
  view.exposure_time = p.get_float("shutterclose", 1) - p.get_float("shutteropen", 0);
  if (!(view.exposure_time > 0)) {
    p.error(fmt::format("is exposed for {} seconds: 'shutterclose' must be greater than 'shutteropen'",
                        view.exposure_time));
    view.exposure_time = 1;
  }
  const double lens = p.get_float("lensradius", 0), focus = p.get_float("focaldistance", kLensDistance);
  view.orthographic = type == "orthographic";
  view.sensor = make_object("sensor", view.orthographic ? type : lens > 0 ? "thinlens" : "perspective", p.where());
  view.camera_to_world = world_to_camera.inverse();
  set_property(*view.sensor, "near_clip", kNearClip);
  set_property(*view.sensor, "far_clip", kFarClip);
  if (view.orthographic) {
    if (lens > 0) p.error("is orthographic with a lens, which is not supported");
    return;
  }
  const double half = p.get_float("halffov", -1);
  const double fov = p.get_float("fov", 90);
  set_property(*view.sensor, "fov", half > 0 ? 2 * half : fov);
  set_property(*view.sensor, "fov_axis", std::string("smaller"));
  if (!(lens > 0)) return;
  set_property(*view.sensor, "aperture_radius", lens);
  set_property(*view.sensor, "focus_distance", focus);
}

namespace {

/// pbrt's picture is radiance times exposure time times ISO / 100, whatever the sensor, which changes colours: by its
/// own response, and by white balance.
void read_sensor(PbrtParameters& p, ObjectDescription& film, PbrtView& view) {
  const std::string sensor = p.get_string("sensor", "cie1931");
  const double iso = p.get_float("iso", 100), temperature = p.get_float("whitebalance", 0);
  if (iso > 0)
    view.iso = iso;
  else
    p.error(fmt::format("has iso {}; expected a positive number", iso));
  if (sensor != "cie1931")
    p.warn(fmt::format("has the sensor '{}'; its picture has the colours of 'cie1931' here", sensor));
  if (temperature > 0) {
    const auto m = pbrt_white_balance(temperature);
    Matrix4 response{};
    for (size_t i = 0; i < 3; ++i)
      for (size_t k = 0; k < 3; ++k) response[i][k] = m[i][k];
    response[3][3] = 1;
    set_property(film, "response", Transform(response));
  }
  if (const double most = p.get_float("maxcomponentvalue", kInfinity); most < kInfinity)
    p.warn(
        fmt::format("clamps samples to {} in pbrt; here none is clamped, so that few bright ones may stand out and "
                    "make the picture brighter",
                    most));
  if (p.has("exposuretime")) p.warn("has an 'exposuretime', which pbrt does not read: the camera's shutter has it");
  p.ignore({"exposuretime"});
}

}  // namespace

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
  const std::vector<double> window = p.get_array("cropwindow", "float", 4),
                            bounds = p.get_array("pixelbounds", "integer", 4);
  if (window.size() == 4) {  // takes precedence
    for (size_t i = 0; i < 4; ++i) {
      const size_t other = i ^ 1;
      const double edge = i % 2 == 0 ? std::min(window[i], window[other]) : std::max(window[i], window[other]);
      const int64_t size = i < 2 ? width : height;
      crop[i] = std::llround(std::ceil(std::clamp(edge, 0.0, 1.0) * static_cast<double>(size)));
    }
  } else if (bounds.size() == 4) {
    for (size_t i = 0; i < 4; ++i)
      crop[i] = std::llround(std::clamp(bounds[i], 0.0, static_cast<double>(i < 2 ? width : height)));
  }
  if (crop[0] > 0 || crop[2] > 0 || crop[1] < width || crop[3] < height) {
    set_property(*film, "crop_offset_x", crop[0]);
    set_property(*film, "crop_width", crop[1] - crop[0]);
    set_property(*film, "crop_offset_y", crop[2]);
    set_property(*film, "crop_height", crop[3] - crop[2]);
  }
  read_sensor(p, *film, view);
  p.ignore({"filename", "savefp16", "diagonal", "coordinatesystem", "nbuckets", "lambdamin", "lambdamax"});
  view.film = film;
}

void read_pbrt_filter(const std::string& type, PbrtParameters& p, PbrtView& view) {
  const double x = p.get_float("xradius", type == "box"        ? 0.5
                                          : type == "triangle" ? 2
                                                               : 1.5),
               y = p.get_float("yradius", x);
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
  // All but "path" estimate the same picture by other means.
  constexpr std::string_view kSame[] = {"path", "simplepath", "volpath", "simplevolpath", "bdpt", "mlt", "sppm"};
  if (std::ranges::find(kSame, type) == std::end(kSame)) {
    const char* instead = type == "randomwalk"  ? "; 'path' has its expected picture where no surface is specular"
                          : type == "lightpath" ? "; 'path' has its expected picture, and what is seen in mirrors too"
                          : type == "ambientocclusion" ? ", whose picture is not that of any of them"
                          : type == "function"         ? ", which tests samplers"
                                                       : "";
    p.error(
        fmt::format("is not supported; supported: integrators 'bdpt', 'mlt', 'path', 'simplepath', "
                    "'simplevolpath', 'sppm' and 'volpath'{}",
                    instead));
  } else if (type == "mlt" || type == "sppm") {
    p.warn("is read as 'path': the expected picture is the same");
  }
  view.integrator = make_object("integrator", type == "bdpt" ? "bdpt" : "path", p.where());
  view.without_media = type == "path" || type == "simplepath" || type == "sppm";
  // pbrt counts scattering events on a path; here its edges count.
  set_property(*view.integrator, "max_depth", p.get_integer("maxdepth", 5) + 1);
  if (p.get_bool("regularize", false))
    p.warn("is regularized in pbrt, which makes what reflects indirect light rougher; here it is not");
  p.ignore({"lightsampler", "visualizestrategies", "visualizeweights", "samplelights", "samplebsdf", "imagefile",
            "iterations", "photonsperiteration", "radius", "seed", "bootstrapsamples", "chains", "mutationsperpixel",
            "largestepprobability", "sigma", "rrthreshold"});
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
    set_property(*view.sensor, "near_clip", kNearClip);
    set_property(*view.sensor, "far_clip", kFarClip);
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
