// SPDX-License-Identifier: Apache-2.0
// The directives before WorldBegin of pbrt: film, filter, sampler, integrator, and where the camera is.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pbrt/pbrt_objects.h"

namespace covary {
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
  const bool version_3 = type == "image";
  if (type == "guidedgbuffer") p.warn("is read as 'gbuffer': the picture is the same");
  if (type != "rgb" && type != "gbuffer" && type != "guidedgbuffer" && type != "spectral" && !version_3 &&
      !p.unknown("films 'rgb', 'gbuffer' and 'spectral', and 'image' of version 3", "it is read as 'rgb'"))
    return;
  if (version_3) {
    p.rename("maxsampleluminance", "maxcomponentvalue");
    if (p.has("scale")) p.set("float", "iso", {100 * p.get_float("scale", 1)});
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
  view.film_diagonal = p.get_float("diagonal", 35) / 1000;
  p.ignore({"filename", "savefp16", "coordinatesystem", "nbuckets", "lambdamin", "lambdamax", "scale"});
  view.film = film;
}

void read_pbrt_filter(const std::string& type, PbrtParameters& p, PbrtView& view) {
  p.rename("xwidth", "xradius"), p.rename("ywidth", "yradius");  // version 3
  const bool sinc = type == "sinc";
  const double x = p.get_float("xradius", type == "box"                              ? 0.5
                                          : type == "triangle" || type == "mitchell" ? 2
                                          : sinc                                     ? 4
                                                                                     : 1.5),
               y = p.get_float("yradius", x);
  if (type == "box" && x == 0.5 && y == 0.5) {
    view.filter = make_object("rfilter", "box", p.where());
  } else if (type == "triangle" && x == y) {
    view.filter = make_object("rfilter", "tent", p.where());
    set_property(*view.filter, "radius", x);
  } else if (type == "mitchell") {
    view.filter = make_object("rfilter", "mitchell", p.where(),
                              {{"A", p.get_float("B", 1.0 / 3)}, {"B", p.get_float("C", 1.0 / 3)}});
    if (x != 2 || y != 2) p.warn(fmt::format("has radii of {} and {}; here it has one of 2", x, y));
  } else if (sinc) {
    const auto lobes = std::clamp<int64_t>(std::llround(p.get_float("tau", 3)), 1, 32);
    view.filter = make_object("rfilter", "lanczos", p.where(), {{"lobes", lobes}});
    if (const auto end = static_cast<double>(lobes); x > end || y > end)
      p.warn(fmt::format("goes on to {} pixels; here it ends where its window is 0, at {}", std::max(x, y), lobes));
  } else {
    const double alpha = p.get_float("alpha", 0);  // version 3: exp(-alpha x^2)
    view.filter = make_object("rfilter", "gaussian", p.where());
    set_property(*view.filter, "stddev", alpha > 0 ? 1 / std::sqrt(2 * alpha) : p.get_float("sigma", 0.5));
    if (type != "gaussian") p.warn("is read as 'gaussian'");
  }
  p.ignore({"sigma", "alpha", "B", "C", "tau"});
}

void read_pbrt_sampler(const std::string& type, PbrtParameters& p, PbrtView& view) {
  const bool independent = type == "independent" || type == "random";
  view.sampler = make_object("sampler", independent ? "independent" : "sobol", p.where());
  int64_t samples = p.get_integer("pixelsamples", 16);
  if (p.has("xsamples") || p.has("ysamples")) samples = p.get_integer("xsamples", 4) * p.get_integer("ysamples", 4);
  set_property(*view.sampler, "sample_count", samples);
  p.ignore({"seed", "randomization", "jitter", "dimensions", "samplepixelcenter"});
}

void read_pbrt_integrator(const std::string& type, PbrtParameters& p, PbrtView& view) {
  // All but "path" estimate the same picture by other means.
  constexpr std::string_view kSame[] = {"path", "simplepath", "volpath", "simplevolpath", "bdpt",
                                        "mlt",  "sppm",       "whitted", "lightpath",     "randomwalk"};
  const bool direct = type == "directlighting";
  const bool guided = type == "guidedpath" || type == "guidedvolpath";  // of the forks that guide paths
  if (std::ranges::find(kSame, type) == std::end(kSame) && !direct && !guided) {
    const bool occlusion = type == "ambientocclusion" || type == "ao";
    p.unknown(fmt::format("integrators 'bdpt', 'lightpath', 'mlt', 'path', 'randomwalk', 'simplepath', "
                          "'simplevolpath', 'sppm' and 'volpath', and 'directlighting' and 'whitted' of version 3{}",
                          occlusion            ? ", whose pictures are not that of this one"
                          : type == "function" ? "; this one tests samplers"
                                               : ""),
              "it becomes 'path', with media");
  } else if (type == "whitted") {
    p.warn("is read as 'path', with indirect light, which it leaves out");
  } else if (guided || type == "mlt" || type == "sppm" || type == "lightpath" || type == "randomwalk") {
    p.warn("is read as 'path': the expected picture is the same");
  }
  view.integrator = make_object("integrator", type == "bdpt" ? "bdpt" : "path", p.where());
  view.without_media = type == "path" || type == "simplepath" || type == "sppm" || type == "whitted" || direct;
  // pbrt counts scattering events on a path; here its edges count. 'directlighting' follows mirrors, we do not.
  set_property(*view.integrator, "max_depth", direct ? int64_t{2} : p.get_integer("maxdepth", 5) + 1);
  if (p.get_bool("regularize", false))
    p.warn("is regularized in pbrt, which makes what reflects indirect light rougher; here it is not");
  p.ignore({"lightsampler",
            "visualizestrategies",
            "visualizeweights",
            "samplelights",
            "samplebsdf",
            "imagefile",
            "iterations",
            "photonsperiteration",
            "radius",
            "seed",
            "bootstrapsamples",
            "chains",
            "mutationsperpixel",
            "largestepprobability",
            "sigma",
            "rrthreshold",
            "maxdepth",
            "strategy",
            "lightsamplestrategy",
            "numiterations",
            "imagewritefrequency",
            "pixelbounds"});
  if (guided) p.ignore_all();  // what steers it
}

namespace {

/// The half extents of the image plane along x and y, and its centre, in units of the shorter half side of a default
/// image.
struct Window {
  double x, y, centre_x, centre_y;
};
Window window_of(const PbrtView& view, double aspect) {
  const std::vector<double>& w = view.screen_window;
  if (w.size() == 4) return {(w[1] - w[0]) / 2, (w[3] - w[2]) / 2, (w[1] + w[0]) / 2, (w[3] + w[2]) / 2};
  const double frame = view.frame_aspect.value_or(aspect);
  return {std::max(frame, 1.0), std::max(1 / frame, 1.0), 0, 0};
}

/// Field of view and shift of a perspective camera. One unit of the window is the tangent of half the field of view.
void set_perspective(PbrtView& view, const Window& window, double aspect, PbrtMessages& messages) {
  ObjectDescription& sensor = *view.sensor;
  const double scale = window.x / std::max(aspect, 1.0), scale_y = window.y / std::max(1 / aspect, 1.0);
  if (std::abs(scale - scale_y) > 1e-3 * scale)
    messages.warn(sensor.where,
                  fmt::format("pixels are {:.4g} times as wide as high in pbrt; here they are square, and "
                              "the picture shows more or less at its top and bottom",
                              scale / scale_y));
  const double tangent = std::tan(view.fov * M_PI / 360);
  set_property(sensor, "fov", std::abs(scale - 1) < 1e-6 ? view.fov : 2 * std::atan(scale * tangent) * 180 / M_PI);
  set_property(sensor, "fov_axis", std::string("smaller"));
  if (window.centre_x != 0) set_property(sensor, "principal_point_offset_x", window.centre_x / (2 * window.x));
  if (window.centre_y != 0) set_property(sensor, "principal_point_offset_y", -window.centre_y / (2 * window.y));
  if (!(view.lens_radius > 0)) return;
  set_property(sensor, "aperture_radius", view.lens_radius);
  set_property(sensor, "focus_distance", view.focal_distance);
}

/// pbrt's directions (x, y, z) are ours (z, y, -x): the film's centre looks along its -x and our z.
void place_panorama(PbrtView& view) {
  Matrix4 m{};
  m[0] = {0, 0, -1, 0}, m[1] = {0, 1, 0, 0}, m[2] = {1, 0, 0, 0}, m[3] = {0, 0, 0, 1};
  const float scale = length(view.camera_to_world.vector({0, 0, 1}));
  set_property(*view.sensor, "to_world",
               view.camera_to_world * Transform::scale(Vec3{1, 1, 1} * (1 / scale)) * Transform(m));
}

/// The field of view and place of a lens in front of a film with this aspect ratio.
void place_lens(PbrtView& view, double aspect) {
  const double shorter = view.film_diagonal / std::sqrt(1 + aspect * aspect) * std::min(aspect, 1.0);
  view.fov = 2 * std::atan(shorter / 2 / view.lens_to_film) * 180 / M_PI;
  view.camera_to_world = view.camera_to_world * Transform::translate({0, 0, static_cast<float>(view.lens_offset)});
}

void place_camera(PbrtView& view, PbrtMessages& messages) {
  if (view.spherical) return place_panorama(view);
  const auto size = [&](size_t i) { return static_cast<double>(std::get<int64_t>(view.film->properties[i].value)); };
  const double aspect = size(0) / std::max(size(1), 1.0);
  if (view.lens_to_film > 0) place_lens(view, aspect);
  const Window window = window_of(view, aspect);
  if (!(window.x > 0 && window.y > 0)) {
    messages.error(view.sensor->where, "'screenwindow' is empty; expected x0 < x1 and y0 < y1");
    return;
  }
  // pbrt's camera space has x to the right, ours to the left.
  Transform own = Transform::scale({-1, 1, 1});
  if (view.orthographic) {
    Matrix4 m{};  // ours is as wide as the film's sides
    m[0] = {window.x, 0, 0, window.centre_x}, m[1] = {0, window.y * aspect, 0, window.centre_y};
    m[2] = {0, 0, 1, 0}, m[3] = {0, 0, 0, 1};
    own = Transform(m) * own;
  } else if (const float scale = length(view.camera_to_world.vector({0, 0, 1})); std::abs(scale - 1) > 1e-5f) {
    // pbrt's camera may be scaled, which changes its lens alone.
    own = Transform::scale(Vec3{1, 1, 1} * (1 / scale)) * own;
    view.lens_radius *= scale, view.focal_distance *= scale;
  }
  if (!view.orthographic) set_perspective(view, window, aspect, messages);
  set_property(*view.sensor, "to_world", view.camera_to_world * own);
}

}  // namespace

std::vector<ObjectPtr> finish_pbrt_view(PbrtView view, const SourceLocation& where, PbrtMessages& messages) {
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
    view.sensor = default_pbrt_camera(where);
  }
  if (!view.integrator) {
    view.integrator = make_object("integrator", "path", where);
    set_property(*view.integrator, "max_depth", int64_t{6});
  }
  if (!(view.exposure_time > 0) && !view.version_3)
    messages.error(
        view.sensor->where,
        fmt::format("the camera is exposed for {} seconds: 'shutterclose' must be greater than 'shutteropen'",
                    view.exposure_time));
  place_camera(view, messages);
  set_property(*view.sensor, "", ObjectPtr(view.film));
  set_property(*view.sensor, "", ObjectPtr(view.sampler));
  return {view.sensor, view.integrator};
}

}  // namespace covary
