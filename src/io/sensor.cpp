// SPDX-License-Identifier: Apache-2.0
// Sensors, films, reconstruction filters and samplers with Mitsuba's names and parameters.
#include "io/sensor.h"

#include <fmt/format.h>

#include <limits>

#include "scene/field_of_view.h"

namespace covary {
namespace {

constexpr float kHuge = std::numeric_limits<float>::max();
constexpr int kMaxSize = 1 << 16;  // pixels along one axis
constexpr int kMaxInt = std::numeric_limits<int>::max();

const std::vector<std::string> kPixelFormats = {"rgb",  "rgba",     "luminance",      "luminance_alpha", "xyz",
                                                "xyza", "spectrum", "spectrum_alpha", "multichannel"};

/// The only child of its kind, or null.
template <typename T>
std::shared_ptr<const T> only_child(Parameters& p, const std::string& kind) {
  const auto children = p.children<T>(kind);
  if (children.size() > 1) p.error(fmt::format("has {} {}s; expected one", children.size(), kind));
  return children.empty() ? nullptr : children[0];
}

}  // namespace

std::shared_ptr<FilterObject> make_filter(Parameters& p) {
  auto filter = std::make_shared<FilterObject>();
  FilterSettings& settings = filter->settings;
  if (p.type() == "box") {
    settings = {FilterKind::kBox, 0.5f, 0.5f};
  } else if (p.type() == "tent") {
    settings = {FilterKind::kTent, p.get_float("radius", 1, 0, 100), 0.5f};
  } else if (p.type() == "mitchell") {  // Mitsuba's A and B are B and C of the paper
    constexpr float kThird = 1.0f / 3;
    settings = lobed(LobedFilter::mitchell(p.get_float("A", kThird, -10, 10), p.get_float("B", kThird, -10, 10)));
  } else if (p.type() == "catmullrom") {
    settings = lobed(LobedFilter::catmull_rom());
  } else if (p.type() == "lanczos") {
    settings = lobed(LobedFilter::lanczos(p.get_int("lobes", 3, 1, 32)));
  } else {
    settings.kind = FilterKind::kGaussian;
    settings.stddev = p.get_float("stddev", 0.5f, 0, 25);
    settings.radius = 4 * settings.stddev;
  }
  if (settings.radius > 0) return filter;
  p.error("its width is 0; it must be positive");
  return nullptr;
}

std::shared_ptr<FilmSettings> make_film(Parameters& p) {
  auto film = std::make_shared<FilmSettings>();
  film->width = p.get_int("width", 768, 1, kMaxSize);
  film->height = p.get_int("height", 576, 1, kMaxSize);
  film->crop_x = p.get_int("crop_offset_x", 0, 0, kMaxSize);
  film->crop_y = p.get_int("crop_offset_y", 0, 0, kMaxSize);
  film->crop_width = p.get_int("crop_width", film->width, 1, kMaxSize);
  film->crop_height = p.get_int("crop_height", film->height, 1, kMaxSize);
  if (film->crop_x + film->crop_width > film->width || film->crop_y + film->crop_height > film->height)
    p.error(fmt::format("the crop window of {} x {} pixels at ({}, {}) leaves the film of {} x {}", film->crop_width,
                        film->crop_height, film->crop_x, film->crop_y, film->width, film->height));
  // The command line determines the output file.
  p.get_choice("file_format", "openexr", {"openexr", "exr", "rgbe", "hdr", "pfm"});
  const std::string pixels = p.get_choice("pixel_format", "rgb", kPixelFormats);
  if (pixels == "rgba")
    p.warn(kAlphaOnDemand);
  else if (pixels != "rgb")
    p.warn(fmt::format("the image is RGB, not '{}'", pixels));
  p.get_choice("component_format", "float32", {"float16", "float32", "uint32"});
  for (const char* ignored : {"banner", "high_quality_edges", "sample_border", "compensate"})
    p.get_bool(ignored, false);
  if (p.has("response")) {
    const Matrix4 m = p.get_transform("response").matrix();
    const auto row = [&](size_t i) {
      return Spectrum(static_cast<float>(m[i][0]), static_cast<float>(m[i][1]), static_cast<float>(m[i][2]));
    };
    film->response = ColourMatrix{{row(0), row(1), row(2)}};
  }
  if (const auto filter = only_child<FilterObject>(p, "rfilter")) film->filter = filter->settings;
  return film;
}

std::shared_ptr<SamplerSettings> make_sampler(Parameters& p) {
  auto sampler = std::make_shared<SamplerSettings>();
  sampler->type = p.type();
  sampler->sample_count = p.get_int("sample_count", 4, 1, kMaxInt);
  p.get_int("seed", 0, 0, kMaxInt);  // --seed takes precedence
  p.get_bool("jitter", true);
  for (const char* ignored : {"strength", "dimension", "scramble"}) p.get_int(ignored, 0, -kMaxInt, kMaxInt);
  return sampler;
}

std::shared_ptr<SensorSettings> make_sensor(Parameters& p) {
  auto sensor = std::make_shared<SensorSettings>();
  CameraSettings& camera = sensor->camera;
  sensor->shutter_open = p.get_float("shutter_open", 0), sensor->shutter_close = p.get_float("shutter_close", 0);
  sensor->to_world = p.find_animation("to_world");
  camera.to_world = sensor->to_world ? sensor->to_world->at(sensor->shutter_open) : p.get_transform("to_world");
  camera.orthographic = p.type() == "orthographic";
  const bool spherical = p.type() == "spherical", framed = !camera.orthographic && !spherical;
  if (spherical)
    camera.panorama =
        p.get_choice("mapping", "latitude_longitude", {"equal_area", "latitude_longitude"}) == "equal_area"
            ? Panorama::kEqualArea
            : Panorama::kLatitudeLongitude;
  if (framed) {
    const FieldOfView view = get_field_of_view(p);
    camera.fov_degrees = view.degrees, camera.fov_axis = view.axis;
  }
  camera.near_clip = p.get_float("near_clip", 1e-2f, 0, kHuge);
  camera.far_clip = p.get_float("far_clip", 1e4f, 0, kHuge);
  if (!(camera.near_clip > 0 && camera.near_clip < camera.far_clip))
    p.error(fmt::format("near_clip is {} and far_clip {}; expected 0 < near_clip < far_clip", camera.near_clip,
                        camera.far_clip));
  if (framed) camera.focus_distance = p.get_float("focus_distance", camera.far_clip, 0, kHuge);
  if (p.type() == "thinlens") {
    if (!p.has("aperture_radius")) p.error("the float 'aperture_radius' is missing");
    camera.aperture_radius = p.get_float("aperture_radius", 0, 0, kHuge);
    if (!(camera.focus_distance > 0)) p.error_at("focus_distance", "is 0; it must be positive");
  }
  if (framed) {
    camera.principal_point_offset = {p.get_float("principal_point_offset_x", 0),
                                     p.get_float("principal_point_offset_y", 0)};
  }
  sensor->medium = only_child<Medium>(p, "medium");
  if (const auto film = only_child<FilmSettings>(p, "film")) sensor->film = *film;
  if (const auto sampler = only_child<SamplerSettings>(p, "sampler")) sensor->sampler = *sampler;
  return sensor;
}

std::string told_of_blur(const SensorSettings& sensor) {
  return fmt::format(
      "the shutter is open from {} to {}, and there is an <animation>: motion is not blurred; shutter_close must be "
      "shutter_open, the time of the image",
      sensor.shutter_open, sensor.shutter_close);
}

float aspect_of(const SensorSettings* sensor, int width, int height) {
  if (width <= 0) width = sensor ? sensor->film.width : 16;
  if (height <= 0) height = sensor ? sensor->film.height : 9;
  return static_cast<float>(width) / static_cast<float>(height);
}

}  // namespace covary
