// SPDX-License-Identifier: Apache-2.0
// Objects of pbrt scene files as descriptions of covary's own objects. Anything without an equivalent is an error at
// its location in the file; slight differences in appearance are warnings.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/file_resolver.h"
#include "formats/object_builder.h"
#include "pbrt/pbrt_names.h"
#include "pbrt/pbrt_placement.h"
#include "pbrt_text/pbrt_parameters.h"
#include "scene/parameters.h"

namespace covary {

/// A float or a float texture; `fallback` if absent, nullopt after an error.
std::optional<Value> float_value(PbrtParameters& p, const std::string& name, double fallback, PbrtNames& names);
/// A colour, a spectrum or a spectrum texture; nullopt if absent or after an error.
std::optional<Value> spectrum_value(PbrtParameters& p, const std::string& name, PbrtNames& names);
/// The same for a reflectance, which pbrt clamps to 1.
std::optional<Value> reflectance_value(PbrtParameters& p, const std::string& name, PbrtNames& names);
/// The texture or colour that pbrt looks up for a reflectance.
Value as_reflectance(const Value& value, const PbrtNames& names);
/// Linear RGB of a value that is not a texture; black for one.
Spectrum plain_colour(const Value& value);
/// The emission of a light: in version 4, spectra are scaled to luminance 1; white if absent.
Spectrum light_colour(PbrtParameters& p, const std::string& name, PbrtNames& names);
/// Index of refraction of `eta`: a number, a glass by name, or a spectrum at 589 nm.
double index_of_refraction(PbrtParameters& p, double fallback, PbrtNames& names);

// Spectra (pbrt_spectra.cpp).
/// "eta" or "k" of a metal in linear Rec. 709, by pbrt's name, such as "metal-Cu-eta", or that of a file of version 3.
std::optional<Spectrum> pbrt_metal(const std::string& name);
/// The names that pbrt_metal() knows.
std::string pbrt_metal_names(const std::string& of);
/// The index of refraction of a glass at 589 nm.
std::optional<double> pbrt_glass(const std::string& name);
/// The colour, of luminance 1, of one of the CIE's illuminants, such as "stdillum-F11".
std::optional<Spectrum> pbrt_illuminant(const std::string& name);
/// The file of wavelengths and values that the parameter names; nullopt after an error.
std::optional<SampledSpectrum> pbrt_spectrum_file(PbrtParameters& p, const PbrtParameter& parameter, PbrtNames& names);
/// A black body's spectrum, scaled to a maximum of 1.
SampledSpectrum pbrt_blackbody(double temperature);
/// Absorption and scattering coefficients per mm; null if there is no medium of this name.
struct PbrtMediumPreset {
  const char* name;
  Spectrum sigma_s, sigma_a;
};
const PbrtMediumPreset* pbrt_medium_preset(const std::string& name);

/// A scaled texture; values above `maximum`, if it is given, are clamped.
ObjectBuilder scaled_texture(const SourceLocation& where, const Value& scale, const ObjectPtr& texture,
                             std::optional<double> maximum = std::nullopt);
/// A texture of class `type`; null after an error.
ObjectBuilder make_pbrt_texture(const std::string& type, PbrtParameters& p, const Transform& to_world,
                                PbrtNames& names);
/// A material; null after an error.
ObjectBuilder make_pbrt_material(const std::string& type, PbrtParameters& p, PbrtNames& names);
/// Whether only version 3 has a material, light, film, … of this name.
bool is_pbrt_3(const std::string& directive, const std::string& type);
/// A medium; null after an error.
ObjectBuilder make_pbrt_medium(const std::string& type, PbrtParameters& p, const Transform& to_world, PbrtNames& names);

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
/// A mesh with vertices in the shape's own space; normals and coordinates may be missing.
PbrtShape pbrt_mesh_shape(PbrtParameters& p, const PbrtPlacement& placement, const EmbeddedMesh& mesh);
/// Indices in groups of `width`, empty after an error; positions and attributes, nullopt after an error.
std::vector<double> read_pbrt_indices(PbrtParameters& p, size_t n_vertices, size_t width);
std::optional<EmbeddedMesh> read_pbrt_vertices(PbrtParameters& p);

// Parts of make_pbrt_shape().
PbrtShape make_pbrt_quadric(const std::string& type, PbrtParameters& p, const PbrtPlacement& placement);
PbrtShape make_pbrt_bilinear_mesh(PbrtParameters& p, const PbrtPlacement& placement);
PbrtShape make_pbrt_subdivision(PbrtParameters& p, const PbrtPlacement& placement);
PbrtShape make_pbrt_height_field(PbrtParameters& p, const PbrtPlacement& placement);
PbrtShape make_pbrt_nurbs(PbrtParameters& p, const PbrtPlacement& placement);
PbrtShape make_pbrt_curve(PbrtParameters& p, const PbrtPlacement& placement);
/// Appends the curves of `more` to `first`, for scenes with one shape per hair; false if they are not curves.
bool join_pbrt_curves(ObjectDescription& first, const ObjectDescription& more);

/// The directives before WorldBegin, in any order.
struct PbrtView {
  ObjectBuilder sensor, film, filter, sampler, integrator;
  bool orthographic = false, spherical = false;
  bool without_media = false;  ///< the integrator leaves media out, as pbrt's 'path' does
  Transform camera_to_world;
  double fov = 90;  ///< of the shorter side
  double focal_distance = 0, lens_radius = 0;
  // Of a "realistic" camera, in metres: from the rear principal plane to the film; 0: the camera is another.
  double lens_to_film = 0, lens_offset = 0, film_diagonal = 0.035;
  double lens_exposure = 1;  ///< irradiance of its film per radiance
  std::optional<double> frame_aspect;
  std::vector<double> screen_window;    ///< x0, x1, y0, y1 or empty
  double exposure_time = 1, iso = 100;  ///< in seconds
  bool version_3 = false;
  /// Values of the picture per radiance (pbrt's film.cpp: imagingRatio); those of version 3 are not exposed.
  double exposure() const { return (version_3 ? 1 : exposure_time) * iso / 100 * lens_exposure; }
};
/// `files` finds the lens of a "realistic" camera.
void read_pbrt_camera(const std::string& type, PbrtParameters& p, const Transform& world_to_camera, FileResolver& files,
                      PbrtView& view);
ObjectBuilder default_pbrt_camera(const SourceLocation& where);
void read_pbrt_film(const std::string& type, PbrtParameters& p, PbrtView& view);
void read_pbrt_filter(const std::string& type, PbrtParameters& p, PbrtView& view);
void read_pbrt_sampler(const std::string& type, PbrtParameters& p, PbrtView& view);
void read_pbrt_integrator(const std::string& type, PbrtParameters& p, PbrtView& view);
/// Linear RGB to RGB, by which pbrt balances pictures for daylight of this temperature in kelvins.
std::array<std::array<double, 3>, 3> pbrt_white_balance(double temperature);
/// Sensor and integrator, with pbrt's defaults for missing values.
std::vector<ObjectPtr> finish_pbrt_view(PbrtView view, const SourceLocation& where, PbrtMessages& messages);

/// A light with its own transformation; null after an error.
ObjectPtr make_pbrt_light(const std::string& type, PbrtParameters& p, const Transform& to_world, const PbrtView& view,
                          PbrtNames& names);
/// An area light for shapes, likewise.
ObjectPtr make_pbrt_area_light(const std::string& type, PbrtParameters& p, const PbrtView& view, PbrtNames& names);

}  // namespace covary
