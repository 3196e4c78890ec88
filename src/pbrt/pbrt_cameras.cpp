// SPDX-License-Identifier: Apache-2.0
// Cameras of pbrt (cameras.cpp). A "realistic" one, of lens elements, becomes the thin lens that they are to first
// order.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "pbrt/pbrt_objects.h"

namespace covary {
namespace {

constexpr double kLensDistance = 1e6;  // pbrt's default focal distance
// pbrt clips nothing. Orthographic rays start in the camera's plane.
constexpr double kNearClip = 1e-6, kFarClip = 1e7;

ObjectBuilder make_sensor(const char* type, const SourceLocation& where) {
  return make_object("sensor", type, where, {{"near_clip", kNearClip}, {"far_clip", kFarClip}});
}

/// Lens surfaces from the front to the film, in metres.
struct LensSurface {
  double radius;     ///< of curvature, positive if it bulges forwards; 0: the aperture
  double thickness;  ///< to the next surface
  double index;      ///< of refraction behind it
  double aperture;   ///< radius
};

/// The numbers of a lens file, four per surface, in mm; '#' begins a comment. Empty after an error.
std::vector<LensSurface> read_lens(PbrtParameters& p, FileResolver& files) {
  const std::string name = p.get_string("lensfile", "");
  const double aperture = p.get_float("aperturediameter", 1);
  std::vector<double> numbers;
  try {
    Diagnostics missing;
    const std::string path = files.resolve(name, p.where(), missing);
    missing.throw_if_errors();
    std::istringstream lines{std::string(FileView(path).text())};
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line.substr(0, line.find('#')));
      for (double x; words >> x;) numbers.push_back(x);
    }
  } catch (const Error& error) {
    p.error(fmt::format("needs the lens file '{}': {}", name, error.what()));
    return {};
  }
  std::vector<LensSurface> surfaces;
  for (size_t i = 0; i + 3 < numbers.size(); i += 4) {
    const double diameter = numbers[i] == 0 ? std::min(aperture, numbers[i + 3]) : numbers[i + 3];
    surfaces.push_back({numbers[i] / 1000, numbers[i + 1] / 1000, numbers[i + 2] == 0 ? 1 : numbers[i + 2],
                        std::max(diameter, 0.0) / 2000});
  }
  if (surfaces.empty() || numbers.size() % 4 != 0) {
    p.error(
        fmt::format("names the lens file '{}', which has {} numbers; expected four per surface", name, numbers.size()));
    return {};
  }
  return surfaces;
}

/// A lens to first order.
struct Paraxial {
  double focal_length = 0;
  double gap = 0;    ///< from the front principal plane to the rear one
  double pupil = 0;  ///< radius of the entrance pupil
};

/// Follows a ray that enters from the front, parallel to the axis at height 1. Returns its final height and slope.
std::array<double, 2> trace_parallel(const std::vector<LensSurface>& lens, std::vector<double>* heights) {
  double y = 1, u = 0, index = 1;
  for (size_t i = 0; i < lens.size(); ++i) {
    const LensSurface& s = lens[i];
    if (heights) heights->push_back(std::abs(y));
    if (s.radius != 0) u = (index * u - y * (s.index - index) / s.radius) / s.index, index = s.index;
    if (i + 1 < lens.size()) y += s.thickness * u;
  }
  return {y, u};
}

/// Nullopt if it does not form an image.
std::optional<Paraxial> paraxial(const std::vector<LensSurface>& lens) {
  std::vector<double> heights;
  const auto [y, u] = trace_parallel(lens, &heights);
  std::vector<double> in_front;  // of each surface: the index of refraction; the aperture changes none
  double index = 1;
  for (const LensSurface& s : lens) {
    in_front.push_back(index);
    if (s.radius != 0) index = s.index;
  }
  std::vector<LensSurface> reversed;
  double length = 0;
  for (size_t i = lens.size(); i-- > 0;) {
    LensSurface s = lens[i];
    s.radius = -s.radius;
    s.thickness = i > 0 ? lens[i - 1].thickness : 0;
    s.index = in_front[i];
    length += s.thickness;
    reversed.push_back(s);
  }
  const auto [back_y, back_u] = trace_parallel(reversed, nullptr);
  if (!(u < 0 && back_u < 0)) return std::nullopt;
  Paraxial result{-1 / u, 0, kInfinity};
  // Principal planes lie a focal length before the focal points.
  const double rear = -y / u - result.focal_length, front = -back_y / back_u + 1 / back_u;
  result.gap = length + rear + front;
  for (size_t i = 0; i < lens.size(); ++i)
    if (heights[i] > 0) result.pupil = std::min(result.pupil, lens[i].aperture / heights[i]);
  return result;
}

void read_realistic(PbrtParameters& p, FileResolver& files, PbrtView& view) {
  const double focus = p.get_float("focusdistance", 10);
  const bool simple = view.version_3 && p.get_bool("simpleweighting", true);
  p.ignore({"simpleweighting", "aperture"});
  const std::vector<LensSurface> surfaces = read_lens(p, files);
  if (surfaces.empty()) return;
  const auto lens = paraxial(surfaces);
  const double distance = lens ? focus - lens->gap : 0;  // between the object and its image, without the gap
  if (!lens || !(distance > 4 * lens->focal_length)) {
    p.error("has a lens that forms no image at 'focusdistance'");
    return;
  }
  const double behind = (distance - std::sqrt(distance * (distance - 4 * lens->focal_length))) / 2;
  view.lens_to_film = behind;
  view.lens_radius = lens->pupil;
  view.focal_distance = distance - behind;
  view.lens_exposure = simple ? 1 : M_PI * lens->pupil * lens->pupil / (behind * behind);
  view.lens_offset = behind + lens->gap;
  view.sensor->type = "thinlens";
  p.warn(
      "is a thin lens here, of the same field of view, focus and aperture: distortion, vignetting and the shape of the "
      "aperture are left out");
}

void read_spherical(const std::string& type, PbrtParameters& p, PbrtView& view) {
  const std::string mapping = p.get_string("mapping", type == "environment" ? "equirectangular" : "equalarea");
  if (mapping != "equirectangular" && mapping != "equalarea")
    p.error(fmt::format("has the mapping '{}'; supported: 'equalarea' and 'equirectangular'", mapping));
  set_property(*view.sensor, "mapping", std::string(mapping == "equalarea" ? "equal_area" : "latitude_longitude"));
  p.ignore({"lensradius", "focaldistance", "screenwindow", "frameaspectratio"});  // it reads but does not use them
}

}  // namespace

void read_pbrt_camera(const std::string& type, PbrtParameters& p, const Transform& world_to_camera, FileResolver& files,
                      PbrtView& view) {
  const bool spherical = type == "spherical" || type == "environment", realistic = type == "realistic";
  view.orthographic = type == "orthographic", view.spherical = spherical;
  if (type != "perspective" && !view.orthographic && !spherical && !realistic) {
    p.unsupported("cameras 'orthographic', 'perspective', 'realistic' and 'spherical'");
    p.ignore_all();
    return;
  }
  view.camera_to_world = world_to_camera.inverse();
  view.exposure_time = p.get_float("shutterclose", 1) - p.get_float("shutteropen", 0);
  if (spherical || realistic) {
    view.sensor = make_sensor(spherical ? "spherical" : "perspective", p.where());
    spherical ? read_spherical(type, p, view) : read_realistic(p, files, view);
    return;
  }
  view.screen_window = p.get_array("screenwindow", "float", 4);
  if (p.has("frameaspectratio")) view.frame_aspect = p.get_float("frameaspectratio", 1);
  view.lens_radius = p.get_float("lensradius", 0);
  view.focal_distance = p.get_float("focaldistance", kLensDistance);
  if (view.orthographic && view.lens_radius > 0) {
    p.warn("has a lens and parallel rays; everything is in focus here");
    view.lens_radius = 0;
  }
  const char* sensor = view.orthographic ? "orthographic" : view.lens_radius > 0 ? "thinlens" : "perspective";
  view.sensor = make_sensor(sensor, p.where());
  const double half = p.get_float("halffov", -1), fov = p.get_float("fov", 90);
  view.fov = half > 0 ? 2 * half : fov;
}

ObjectBuilder default_pbrt_camera(const SourceLocation& where) { return make_sensor("perspective", where); }

}  // namespace covary
