// SPDX-License-Identifier: Apache-2.0
// Scenes converted to XML are identical to the last bit: every property of every object, from every source.
#include "formats/scene_writer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "core/random.h"
#include "formats/file_resolver.h"
#include "io/convert_scene.h"
#include "io/scene_formats.h"
#include "scene/embedded_data.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;

class SceneWriter : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.file(name), std::ios::binary) << text;
    return folder_.file(name);
  }

  /// The description read from a scene file, which must have no errors.
  std::shared_ptr<const ObjectDescription> read(const std::string& path) {
    const FileView file(path);
    Diagnostics diagnostics;
    FileResolver files;
    const SceneXml xml = read_scene_file({file.text(), path, {}, {}}, files, diagnostics);
    diagnostics.throw_if_errors();
    return xml.scene;
  }

  /// Writes the converted scene and its files.
  ConvertedScene convert(const std::string& from, const std::string& to) {
    ConvertedScene result = convert_scene(from, folder_.file(to));
    write(to, result.document.xml);
    for (const SceneDocumentFile& file : result.document.files) {
      std::filesystem::create_directories(std::filesystem::path(folder_.file(file.path)).parent_path());
      write(file.path, std::string(file.bytes));
    }
    return result;
  }

  /// The whole content of an object as text, numbers exact, with the content of files instead of their names and
  /// referenced objects instead of references.
  std::string text_of(const ObjectDescription& object, const std::string& folder) {
    std::vector<std::string> parts;
    for (const Property& p : object.properties) {
      const Value& v = p.value;
      const std::string name = p.name == kEmbeddedData ? "filename" : p.name;
      if (const auto* child = std::get_if<ObjectPtr>(&v); child && *child) {
        // The order of nested objects matters, that of other properties does not.
        parts.push_back("~" + std::to_string(parts.size()) + name + text_of(**child, folder));
      } else if (const auto* text = std::get_if<std::string>(&v)) {
        const bool file = p.name == "filename";
        const std::string path = std::filesystem::path(*text).is_absolute() ? *text : folder + "/" + *text;
        parts.push_back(name + "=" + (file ? std::string(FileView(path).text()) : *text));
      } else if (const auto* transform = std::get_if<Transform>(&v)) {
        if (!transform->is_identity()) parts.push_back(name + "=" + matrix(*transform) + matrix(transform->inverse()));
      } else if (const auto* animation = std::get_if<KeyedTransformPtr>(&v)) {
        for (const TransformKey& key : (*animation)->keys())
          parts.push_back(name + "=" + number(key.time) + matrix(Transform(key.matrix)));
      } else {
        parts.push_back(name + "=" + number(v));
      }
    }
    std::stable_sort(parts.begin(), parts.end());
    std::string all = object.kind + " " + object.type + " {";
    for (const std::string& part : parts) all += part + ";";
    return all + "}";
  }
  static std::string matrix(const Transform& t) {
    std::string text;
    for (const auto& row : t.matrix()) text.append(reinterpret_cast<const char*>(row.data()), sizeof(row));
    return text;
  }
  static std::string number(const Value& v) {
    const auto raw = [](const auto& value) {
      return std::string(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    if (const auto* x = std::get_if<bool>(&v)) return *x ? "true" : "false";
    if (const auto* x = std::get_if<int64_t>(&v)) return std::to_string(*x);
    if (const auto* x = std::get_if<double>(&v)) return raw(*x);
    if (const auto* x = std::get_if<Vec3>(&v)) return raw(x->x) + raw(x->y) + raw(x->z);
    if (const auto* x = std::get_if<ColourValue>(&v)) return raw(x->rgb.r) + raw(x->rgb.g) + raw(x->rgb.b);
    std::string text;
    for (const auto& [wavelength, value] : std::get<SampledSpectrum>(v).samples) text += raw(wavelength) + raw(value);
    return text;
  }

  /// The objects of the scene, excluding those that are only there to be referenced.
  std::vector<std::string> objects_of(const ObjectDescription& scene, const std::string& folder) {
    std::vector<std::string> all;
    for (const Property& p : scene.properties) {
      const auto& object = std::get<ObjectPtr>(p.value);
      if (object->kind != "bsdf" && object->kind != "texture" && object->kind != "medium" &&
          object->type != "shapegroup")
        all.push_back(text_of(*object, folder));
    }
    return all;
  }

  void expect_same(const std::string& from, const std::string& to, size_t min_objects) {
    const auto folder = [](const std::string& path) { return std::filesystem::path(path).parent_path().string(); };
    const std::vector<std::string> a = objects_of(*read(from), folder(from)), b = objects_of(*read(to), folder(to));
    ASSERT_GE(a.size(), min_objects);
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i], b[i]) << i;
  }

  test_support::TemporaryFolder folder_;
};

const char* const kScene = R"(Scale -1 1 1
LookAt 3 4 1.5  .5 .5 0  0 0 1
Camera "perspective" "float fov" 45.1 "float lensradius" .1 "float focaldistance" 4.3
Film "rgb" "integer xresolution" 60 "integer yresolution" [ 40 ] "float cropwindow" [ 0 .5 .1 1 ]
Sampler "independent" "integer pixelsamples" 32
PixelFilter "triangle" "float xradius" 1.1 "float yradius" 1.1
Integrator "bdpt" "integer maxdepth" [ 4 ]
WorldBegin
LightSource "point" "point3 from" [ 0.1 0 4 ] "rgb I" [ 1 2.1 3 ]
LightSource "distant" "point3 from" [ -30.3 40 100 ] "blackbody L" 5003
Texture "checks <&> \"" "spectrum" "checkerboard" "float uscale" 3.3 "rgb tex1" [ .1 .1 .1 ] "rgb tex2" [ .8 .7 .3 ]
Texture "picture" "spectrum" "imagemap" "string filename" "picture.ppm" "float scale" .7
MakeNamedMaterial "gold, of a kind" "string type" "conductor" "spectrum eta" [ 400 1.1 500.5 .3 ]
  "spectrum k" [ 400 3.3 500.5 2.1 ] "float uroughness" .25 "float vroughness" .01
MakeNamedMaterial "paint" "string type" "diffuse" "texture reflectance" "checks <&> \""
MakeNamedMaterial "both" "string type" "mix" "string materials" [ "paint" "gold, of a kind" ] "float amount" .3
NamedMaterial "both"
Translate 1.1 .3 1e-3
Rotate 33.3 1 2 3
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 3 2 1.7 ] "float scale" 5.5
  Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ -1.3 -1 0  1 -1 0  0 1 .5 ] "point2 uv" [ 0 0 1 0 0 1 ]
  Shape "disk" "float radius" .7
AttributeEnd
NamedMaterial "paint"
ObjectBegin "ball"
  Shape "sphere" "float radius" .5
  NamedMaterial "gold, of a kind"
  Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ -1.3 -1 0  1 -1 0  0 1 .5 ] "point2 uv" [ 0 0 1 0 0 1 ]
ObjectEnd
ObjectInstance "ball"
Translate 1.7 0 0
ObjectInstance "ball"
MakeNamedMedium "milk" "string type" "homogeneous" "rgb sigma_a" [ .1 .2 .3 ] "float g" .3
MediumInterface "milk" ""
Material "diffuse" "texture reflectance" "picture"
Shape "cylinder" "float zmin" -1.3 "float alpha" .25
Shape "bilinearmesh" "point3 P" [ 0 0 0  1 0 0  0 1.1 0  1 1.1 0 ]
)";

/// Mitsuba 3 has no sampler `sobol`.
TEST_F(SceneWriter, SamplersAreThoseOfMitsuba) {
  const std::string from =
      write("scene.pbrt", "Sampler \"zsobol\" \"integer pixelsamples\" 32\nWorldBegin\nShape \"sphere\"\n");
  const std::string text = convert(from, "out.xml").document.xml;
  EXPECT_NE(text.find("<sampler type=\"ldsampler\""), std::string::npos) << text;
  EXPECT_EQ(text.find("sobol"), std::string::npos) << text;
}

TEST_F(SceneWriter, ScenesOfPbrtStayTheSameToTheLastBit) {
  write("picture.ppm", "P6\n1 1\n255\nabc");
  const std::string from = write("scene.pbrt", kScene);
  const ConvertedScene converted = convert(from, "out.xml");
  EXPECT_EQ(converted.document.files.size(), 2u);  // the triangle is used three times
  expect_same(from, folder_.file("out.xml"), 10);
  // Converting again gives the same text, except for the name in the comment and the files.
  const ConvertedScene again = convert(folder_.file("out.xml"), "again.xml");
  EXPECT_TRUE(again.document.files.empty());
  const auto body = [](const std::string& xml) { return xml.substr(xml.find("<scene")); };
  EXPECT_EQ(body(converted.document.xml), body(again.document.xml));
  EXPECT_TRUE(contains(converted.document.xml, "<ref id=\"gold, of a kind\" />"));
  ASSERT_EQ(
      std::count_if(converted.warnings.begin(), converted.warnings.end(),
                    [](const std::string& w) { return contains(w, "becomes the texture 'scale', which Mitsuba 3"); }),
      1);
}

TEST_F(SceneWriter, ScenesOfMitsubaAreBroughtToTheNewestVersion) {
  const std::string from = write("old.xml", R"(<scene version="0.6.0"><default name="r" value="0.2"/>
<sensor type="perspective"><float name="fov" value="30"/><sampler type="independent"/>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>
<bsdf type="diffuse" id="a"><spectrum name="reflectance" value="400:.1 500:$r"/></bsdf>
<bsdf type="roughplastic" id="not used"><rgb name="diffuseReflectance" value="#ff8000"/></bsdf>
<emitter type="area" id="lamp"><spectrum name="radiance" value="1.5"/></emitter>
<shape type="sphere"><point name="center" x="0" y=".1" z="5"/><ref id="a"/><ref id="lamp"/></shape>
<shape type="sphere"><animation name="toWorld"><transform time="-0.1"><scale value="0.3"/></transform>
<transform time="2"><rotate x="1" y="2" angle="33"/></transform></animation>
<point name="center" x="2" y=".1" z="5"/><ref id="a"/><ref id="lamp"/></shape></scene>)");
  const ConvertedScene converted = convert(from, "new.xml");
  EXPECT_TRUE(contains(converted.document.xml, "<scene version=\"3.0.0\">"));
  EXPECT_TRUE(contains(converted.document.xml, "name=\"diffuse_reflectance\""));
  const auto shapes = [&](const std::string& path) {
    std::vector<std::string> all = objects_of(*read(path), folder_.file(""));
    std::erase_if(all, [](const std::string& text) { return text.starts_with("emitter area"); });
    return all;
  };
  EXPECT_EQ(shapes(from), shapes(folder_.file("new.xml")));
  EXPECT_EQ(shapes(from).size(), 3u);
}

/// Numbers of all magnitudes are read back exactly.
TEST_F(SceneWriter, NumbersKeepTheirBits) {
  std::string text = "Camera \"perspective\"\nWorldBegin\n";
  for (int i = 0; i < 500; ++i) {
    const PathRandom random(Sampling::kIndependent, 5, 0, 0, i);
    const Vec2 u = random.get_2d(0, Event::kDirection), v = random.get_2d(1, Event::kDirection);
    const float size = std::exp2(30 * u.x - 15);
    text += fmt::format("Identity Translate {} {} {} Scale {} {} {} LightSource \"point\" \"rgb I\" [ {} {} {} ]\n",
                        u.y, size, v.x, size, size, size, size, v.x, v.y);
    text += "Shape \"sphere\"\n";
  }
  const std::string from = write("numbers.pbrt", text);
  convert(from, "numbers.xml");
  expect_same(from, folder_.file("numbers.xml"), 1000);
}

/// Mitsuba's `path` ignores media, and its environment maps are in latitude-longitude format.
TEST_F(SceneWriter, MitsubaGetsWhatItHas) {
  std::string texels(48, 'a');
  write("sky.ppm", "P6\n4 4\n255\n" + texels);
  const std::string from = write("fog.pbrt", R"(Camera "perspective"
WorldBegin
LightSource "infinite" "string filename" "sky.ppm" "float scale" 2
MakeNamedMedium "milk" "string type" "homogeneous"
MediumInterface "milk" ""
Shape "sphere"
)");
  const ConvertedScene converted = convert(from, "fog.xml");
  const std::string& xml = converted.document.xml;
  EXPECT_TRUE(contains(xml, "<integrator type=\"volpath\">"));
  EXPECT_FALSE(contains(xml, "mapping"));
  ASSERT_EQ(converted.document.files.size(), 1u);
  EXPECT_TRUE(converted.document.files[0].bytes.starts_with("PF\n8 5\n"));
  const LoadedScene a = load_scene(from), b = load_scene(folder_.file("fog.xml"));
  EXPECT_EQ(b.integrator_type, "path");
  const Vec3 up{0, 0, 1};
  EXPECT_NEAR(a.scene->environment()->environment(up).radiance.g, b.scene->environment()->environment(up).radiance.g,
              1e-4f);
  write("plain.pbrt", "Camera \"perspective\"\nWorldBegin\nShape \"sphere\"\n");
  EXPECT_TRUE(contains(convert(folder_.file("plain.pbrt"), "plain.xml").document.xml, "<integrator type=\"path\">"));
}

TEST_F(SceneWriter, WhatCannotBeRenderedIsNotConverted) {
  const std::string from = write("wrong.pbrt",
                                 "WorldBegin\nMaterial \"velvet\"\nShape \"plymesh\" \"string filename\" "
                                 "\"no.ply\"\n");
  const std::string message = test_support::message_of([&] { convert(from, "out.xml"); });
  EXPECT_TRUE(contains(message, "wrong.pbrt:2:1: Material \"velvet\" is not supported"));
  EXPECT_TRUE(contains(message, "no.ply"));
}

}  // namespace
}  // namespace covary
