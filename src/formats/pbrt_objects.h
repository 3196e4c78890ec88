// SPDX-License-Identifier: Apache-2.0
// Objects of pbrt-v4 scene files as descriptions of covary's own objects. Anything without an equivalent is an error at
// its location in the file; slight differences in appearance are warnings.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/file_resolver.h"
#include "formats/object_builder.h"
#include "formats/pbrt_parameters.h"
#include "formats/pbrt_placement.h"
#include "scene/parameters.h"

namespace covary {

/// Named objects that later ones reference. Null for an object that could not be read.
struct PbrtNames {
  std::map<std::string, ObjectPtr> float_textures, spectrum_textures, materials, media;
  /// The textures that pbrt looks up instead of these for a reflectance: those with images clamped to 1.
  std::map<ObjectPtr, ObjectPtr> reflectances;
};

/// A float or a float texture; `fallback` if absent, nullopt after an error.
std::optional<Value> float_value(PbrtParameters& p, const std::string& name, double fallback, const PbrtNames& names);
/// A colour, a spectrum or a spectrum texture; nullopt if absent or after an error.
std::optional<Value> spectrum_value(PbrtParameters& p, const std::string& name, const PbrtNames& names);
/// The same for a reflectance, which pbrt clamps to 1.
std::optional<Value> reflectance_value(PbrtParameters& p, const std::string& name, const PbrtNames& names);
/// The emission of a light: spectra are scaled to luminance 1, as in pbrt; white if absent.
Spectrum light_colour(PbrtParameters& p, const std::string& name);

/// A texture of class `type`; null after an error.
ObjectBuilder make_pbrt_texture(const std::string& type, PbrtParameters& p, PbrtNames& names);
/// A material; null after an error.
ObjectBuilder make_pbrt_material(const std::string& type, PbrtParameters& p, const PbrtNames& names);

/// How a shape's texture coordinates here differ from those in pbrt; kOwn: not at all, or nobody reads them.
enum class PbrtUv {
  kOwn,
  kSphere,
  kDisk,
  kTriangles,  ///< without coordinates of their own
  kMirroredTriangles,
  kFlippedTriangles,
  kMirroredFlippedTriangles,
  kCurve,
};
/// A shape without material or light; `object` is null after an error.
struct PbrtShape {
  ObjectBuilder object;
  PbrtUv uv = PbrtUv::kOwn;
};
/// `files` finds the file of a `plymesh`.
PbrtShape make_pbrt_shape(const std::string& type, PbrtParameters& p, const PbrtPlacement& placement,
                          FileResolver& files);

/// The shape `curve`, part of make_pbrt_shape().
ObjectBuilder make_pbrt_curve(PbrtParameters& p, const PbrtPlacement& placement);
/// Appends the curves of `more` to `first`, for scenes with one shape per hair; false if they are not curves.
bool join_pbrt_curves(ObjectDescription& first, const ObjectDescription& more);

/// A medium; null after an error.
ObjectBuilder make_pbrt_medium(const std::string& type, PbrtParameters& p);

/// A light with its own transformation, its light times `exposure`; null after an error.
ObjectPtr make_pbrt_light(const std::string& type, PbrtParameters& p, const Transform& to_world, double exposure);
/// An area light for shapes, likewise.
ObjectPtr make_pbrt_area_light(const std::string& type, PbrtParameters& p, double exposure);

/// The directives before WorldBegin, in any order.
struct PbrtView {
  ObjectBuilder sensor, film, filter, sampler, integrator;
  bool orthographic = false;
  bool without_media = false;  ///< the integrator leaves media out, as pbrt's 'path' does
  Transform camera_to_world;
  double exposure_time = 1, iso = 100;  ///< in seconds
  /// Values of the picture per radiance (pbrt's film.cpp: imagingRatio).
  double exposure() const { return exposure_time * iso / 100; }
};
void read_pbrt_camera(const std::string& type, PbrtParameters& p, const Transform& world_to_camera, PbrtView& view);
void read_pbrt_film(const std::string& type, PbrtParameters& p, PbrtView& view);
void read_pbrt_filter(const std::string& type, PbrtParameters& p, PbrtView& view);
void read_pbrt_sampler(const std::string& type, PbrtParameters& p, PbrtView& view);
void read_pbrt_integrator(const std::string& type, PbrtParameters& p, PbrtView& view);
/// Linear RGB to RGB, by which pbrt balances pictures for daylight of this temperature in kelvins.
std::array<std::array<double, 3>, 3> pbrt_white_balance(double temperature);
/// Sensor and integrator, with pbrt's defaults for missing values.
std::vector<ObjectPtr> finish_pbrt_view(PbrtView view, const SourceLocation& where);

}  // namespace covary
