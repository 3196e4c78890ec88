// SPDX-License-Identifier: Apache-2.0
// Small scenes for tests of bidirectional path tracing: all kinds of lights, materials and lenses.
#pragma once

#include <fstream>
#include <string>

#include "render_fixture.h"

namespace covary {

inline std::string rectangle(const std::string& transform, const std::string& content) {
  return "<shape type='rectangle'><transform name='to_world'>" + transform + "</transform>" + content + "</shape>";
}
inline std::string sphere(const std::string& x, const std::string& y, const std::string& z, const std::string& radius,
                          const std::string& content) {
  return "<shape type='sphere'><point name='center' x='" + x + "' y='" + y + "' z='" + z +
         "'/><float name='radius' value='" + radius + "'/>" + content + "</shape>";
}
inline std::string diffuse(double reflectance) {
  return "<bsdf type='diffuse'><rgb name='reflectance' value='" + std::to_string(reflectance) + "'/></bsdf>";
}
inline std::string area_light(double radiance) {
  return "<emitter type='area'><rgb name='radiance' value='" + std::to_string(radiance) + "'/></emitter>";
}

/// A floor whose interpolated normals are tilted from the geometric ones; writes the file that it refers to.
inline std::string leaning_floor(const std::string& bsdf) {
  std::ofstream(test_support::test_file("leaning.obj"))
      << "v -4 -2 1\nv 4 -2 1\nv 4 -2 9\nv -4 -2 9\nvn 0.5 1 0\nvn -0.3 1 0.4\nvn 0.2 1 -0.6\nvn -0.5 1 -0.2\n"
         "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1/1 3/3/3 2/2/2\nf 1/1/1 4/4/4 3/3/3\n";
  return "<shape type='obj'><string name='filename' value='leaning.obj'/>" + bsdf + "</shape>";
}

inline const char* const kGlass = "<bsdf type='dielectric'/>";
inline const char* const kRoughGlass = "<bsdf type='roughdielectric'><float name='alpha' value='0.3'/></bsdf>";
inline const char* const kRoughMetal = "<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf>";
inline const char* const kMirror = "<bsdf type='twosided'><bsdf type='conductor'/></bsdf>";
inline const char* const kHalfMirror =
    "<bsdf type='twosided'><bsdf type='blendbsdf'><float name='weight' value='0.4'/><bsdf type='diffuse'/>"
    "<bsdf type='conductor'/></bsdf></bsdf>";
inline const char* const kMask =
    "<bsdf type='mask'><float name='opacity' value='0.6'/><bsdf type='twosided'><bsdf type='diffuse'/></bsdf></bsdf>";
inline const char* const kBumps =
    "<bsdf type='bumpmap'><texture type='checkerboard'/><float name='scale' value='0.3'/><bsdf type='plastic'/></bsdf>";

/// Objects in the room, with various BSDFs.
inline std::string materials() {
  return leaning_floor(diffuse(0.6)) +
         rectangle("<scale value='6'/><rotate x='1' angle='180'/><translate z='9'/>", kRoughMetal) +
         sphere("-2.6", "-1", "5", "0.9", "<bsdf type='plastic'/>") + sphere("0", "-1", "4", "0.8", kGlass) +
         sphere("2.2", "-1.2", "4", "0.7", kRoughGlass) + sphere("1.4", "0.8", "6", "0.7", kHalfMirror) +
         rectangle("<scale value='1.2'/><rotate y='1' angle='150'/><translate x='-1' y='0.6' z='5'/>", kMask) +
         rectangle("<scale x='1' y='2' z='1'/><rotate y='1' angle='60'/><translate x='-4' z='6'/>", kMirror) +
         rectangle("<scale x='1.5' y='2' z='1'/><rotate y='1' angle='-120'/><translate x='4' z='6'/>", kBumps);
}

inline const char* const kNormals =
    "<bsdf type='normalmap'><texture type='checkerboard' name='normalmap'>"
    "<rgb name='color0' value='0.5, 0.5, 1'/><rgb name='color1' value='0.7, 0.4, 0.9'/></texture>"
    "<bsdf type='roughplastic'><float name='alpha' value='0.3'/></bsdf></bsdf>";
inline const char* const kThinGlass = "<bsdf type='thindielectric'/>";
inline const char* const kPrincipled =
    "<bsdf type='principled'><float name='roughness' value='0.4'/><float name='spec_trans' value='0.3'/>"
    "<float name='metallic' value='0.2'/></bsdf>";
inline const char* const kThinSheet =
    "<bsdf type='principledthin'><float name='roughness' value='0.4'/><float name='diff_trans' value='1'/></bsdf>";
inline const char* const kTwoSides =
    "<bsdf type='twosided'><boolean name='allow_transmission' value='true'/><bsdf type='roughdielectric'>"
    "<float name='alpha' value='0.4'/></bsdf><bsdf type='diffuse'/></bsdf>";

/// BSDFs, lights and instances that the room above lacks.
inline std::string more_materials() {
  const std::string textured =
      "<emitter type='area'><texture type='checkerboard' name='radiance'><rgb name='color0' value='6'/>"
      "<rgb name='color1' value='1'/></texture></emitter>";
  const std::string group =
      "<shape type='shapegroup' id='balls'>" + sphere("0", "0", "0", "0.5", kPrincipled) + "</shape>";
  const auto placed = [](const std::string& translate) {
    return "<shape type='instance'><ref id='balls'/><transform name='to_world'><scale x='1.2' y='0.9' "
           "z='1'/><translate " +
           translate + "/></transform></shape>";
  };
  return leaning_floor(kNormals) +
         rectangle("<scale value='6'/><rotate x='1' angle='180'/><translate z='9'/>", diffuse(0.7)) + group +
         placed("x='-1' y='-1.2' z='4'") + placed("x='1.2' y='-1.2' z='5'") +
         rectangle("<rotate y='1' angle='160'/><translate x='-2' y='0.4' z='5'/>", kThinSheet) +
         rectangle("<rotate y='1' angle='200'/><translate x='0.5' y='0.6' z='4'/>", kTwoSides) +
         rectangle("<rotate y='1' angle='170'/><translate x='2.4' y='0.4' z='4'/>", kThinGlass) +
         rectangle("<rotate y='1' angle='170'/><translate x='0' y='-1' z='3'/>", "<bsdf type='null'/>") +
         rectangle("<rotate x='1' angle='90'/><translate y='3' z='4'/>", textured);
}

inline std::string area_lights() {
  return rectangle("<rotate x='1' angle='90'/><translate y='3' z='4'/>", diffuse(0.3) + area_light(5)) +
         sphere("-3", "2", "4", "0.5", area_light(4));
}
inline const char* const kConstant = "<emitter type='constant'><rgb name='radiance' value='0.5'/></emitter>";
inline const char* const kPoint =
    "<emitter type='point'><point name='position' x='1' y='2' z='3'/>"
    "<rgb name='intensity' value='6'/></emitter>";
inline const char* const kSpot =
    "<emitter type='spot'><transform name='to_world'><lookat origin='-1, 2.5, 2' target='0, -1, 5' up='0, 0, 1'/>"
    "</transform><float name='cutoff_angle' value='40'/><rgb name='intensity' value='20'/></emitter>";
inline const char* const kDirectional =
    "<emitter type='directional'><vector name='direction' x='1' y='-2' z='1'/>"
    "<rgb name='irradiance' value='1'/></emitter>";

inline const char* const kThinLens =
    "<float name='aperture_radius' value='0.2'/><float name='focus_distance' value='4'/>";

/// scene_text() with the integrator bdpt.
inline std::string bdpt_scene(const std::string& body, int size, int max_depth, const std::string& settings = "",
                              const std::string& sensor = "", const std::string& lens = "") {
  std::string text = scene_text(body, size, size, max_depth, sensor, settings);
  text.replace(text.find("type='path'"), 11, "type='bdpt'");
  if (!lens.empty()) {
    text.replace(text.find("type='perspective'"), 18, "type='thinlens'");
    text.insert(text.find("<film"), lens);
  }
  return text;
}

}  // namespace covary
