// SPDX-License-Identifier: Apache-2.0
// Objects, values, transforms and malformed XML; parameters, references, includes and old versions: xml_scene_test.cpp.
#include <gtest/gtest.h>

#include <fstream>

#include "support/files.h"
#include "support/read_xml.h"

namespace covary {
namespace {

using test_support::child;
using test_support::contains;
using test_support::expect_near;
using test_support::Read;
using test_support::read;
using test_support::read_scene;
using test_support::TemporaryFolder;
using test_support::value;

// ---- objects and values ----

TEST(XmlReader, ReadsObjectsAndValues) {
  const Read r = read_scene(R"(<bsdf type="diffuse" id="white">
  <boolean name="b" value="true"/>
  <integer name="i" value="-3"/>
  <float name="f" value="0.25"/>
  <string name="s" value="a &lt; b"/>
  <point name="p" x="1" y="2" z="3"/>
  <vector name="v" value="4 5 6"/>
  <rgb name="c" value="0.1, 0.2, 0.3"/>
  <srgb name="d" value="#ffffff"/>
  <spectrum name="l" value="400:1, 500:2"/>
  <blackbody name="e" temperature="5000K"/>
  <texture name="t" type="bitmap"/>
</bsdf>)");
  EXPECT_EQ(r.errors, "no error");
  EXPECT_EQ(child(r).kind, "bsdf");
  EXPECT_EQ(child(r).type, "diffuse");
  EXPECT_EQ(child(r).id, "white");
  EXPECT_EQ(child(r).where.text(), "scene.xml:2:1");
  EXPECT_TRUE(value<bool>(r, "b"));
  EXPECT_EQ(value<int64_t>(r, "i"), -3);
  EXPECT_EQ(value<double>(r, "f"), 0.25);
  EXPECT_EQ(value<std::string>(r, "s"), "a < b");
  EXPECT_EQ(value<Vec3>(r, "p"), (Vec3{1, 2, 3}));
  EXPECT_EQ(value<Vec3>(r, "v"), (Vec3{4, 5, 6}));
  EXPECT_EQ(value<ColourValue>(r, "c").rgb, Spectrum(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(value<ColourValue>(r, "d").rgb, Spectrum(1));
  EXPECT_EQ(value<SampledSpectrum>(r, "l").samples.size(), 2u);
  EXPECT_EQ(value<SampledSpectrum>(r, "e").samples.size(), 471u);
  EXPECT_EQ(value<ObjectPtr>(r, "t")->type, "bitmap");
  EXPECT_EQ(value<ObjectPtr>(r, "t")->where.text(), "scene.xml:13:3");
}

TEST(XmlReader, ReadsSpectrumObjects) {
  const Read r = read_scene(R"(<spectrum type="uniform" id="half"><float name="value" value="0.5"/></spectrum>
<emitter type="area">
  <ref name="a" id="half"/>
  <spectrum name="b" type="irregular"><string name="wavelengths" value="400, 500"/>)"
                            R"(<string name="values" value="1, 2"/></spectrum>
  <spectrum name="c" type="regular"><float name="wavelength_min" value="400"/><float name="wavelength_max" value="600"/>
    <string name="values" value="1, 2, 3"/></spectrum>
  <spectrum name="d" type="blackbody"><float name="temperature" value="3000"/></spectrum>
  <spectrum name="e" type="srgb"><rgb name="color" value="1 2 3"/></spectrum>
  <spectrum name="f" type="d65"><float name="scale" value="2"/></spectrum>
</emitter>)");
  EXPECT_EQ(r.errors, "no error");
  const ObjectDescription& emitter = child(r);
  EXPECT_EQ(std::get<double>(value(emitter, "a")), 0.5);
  using Samples = std::vector<std::pair<float, float>>;
  EXPECT_EQ(std::get<SampledSpectrum>(value(emitter, "b")).samples, (Samples{{400, 1}, {500, 2}}));
  EXPECT_EQ(std::get<SampledSpectrum>(value(emitter, "c")).samples, (Samples{{400, 1}, {500, 2}, {600, 3}}));
  EXPECT_EQ(std::get<SampledSpectrum>(value(emitter, "d")).samples.size(), 471u);
  EXPECT_EQ(std::get<ColourValue>(value(emitter, "e")).rgb, Spectrum(1, 2, 3));
  EXPECT_EQ(std::get<ColourValue>(value(emitter, "f")).rgb, Spectrum(2));
}

TEST(XmlReader, ReportsWrongSpectrumObjects) {
  const Read r = read_scene(R"(<emitter type="area">
<spectrum name="a" type="blackbdy"/>
<spectrum name="b" type="blackbody"/>
<spectrum name="c" type="irregular"><string name="wavelengths" value="400, 500"/><string name="values" value="1"/>)"
                            R"(</spectrum>
<spectrum name="d" type="uniform"><float name="valu" value="1"/></spectrum>
</emitter>)");
  EXPECT_EQ(r.errors,
            "scene.xml:4:1: spectrum 'blackbody': the float 'temperature' is missing\n"
            "scene.xml:5:1: spectrum 'irregular': a spectrum has 2 wavelengths but 1 values\n"
            "scene.xml:6:35: unknown parameter 'valu' of spectrum 'uniform'; did you mean 'value'?");
}

TEST(XmlReader, ReadsSpectrumFiles) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("a.spd")) << "400 1\n500 2\n";
  std::ofstream(folder.file("b.spd")) << "400 1\n300 2\n";
  const Read r = read(
      "<scene version=\"3.0.0\"><bsdf type=\"diffuse\"><spectrum name=\"a\" filename=\"a.spd\"/>\n"
      "<spectrum name=\"b\" filename=\"b.spd\"/>\n<spectrum name=\"c\" filename=\"c.spd\"/>\n"
      "<spectrum name=\"d\"/></bsdf></scene>",
      {}, folder.file("scene.xml"));
  EXPECT_EQ(value<SampledSpectrum>(r, "a").samples.size(), 2u);
  EXPECT_TRUE(contains(
      r.errors,
      "scene.xml:2:1: 'b': spectrum file 'b.spd': the wavelengths of a spectrum must increase, but 300 follows 400"));
  EXPECT_TRUE(contains(
      r.errors, "scene.xml:3:1: file 'c.spd' not found in '" + folder.file("").substr(0, folder.file("").size() - 1)));
  EXPECT_TRUE(contains(r.errors, "did you mean 'a.spd' or 'b.spd'"));
  EXPECT_TRUE(contains(r.errors, "scene.xml:4:1: 'd': <spectrum> takes either value or filename"));
}

// ---- transforms ----

Transform transform_of(const std::string& operations) {
  const Read r = read_scene("<shape type=\"cube\"><transform name=\"to_world\">" + operations + "</transform></shape>");
  EXPECT_EQ(r.errors, "no error");
  return value<Transform>(r, "to_world");
}

TEST(XmlReader, ReadsTransforms) {
  expect_near(transform_of("<translate x=\"1\" z=\"3\"/>").point({0, 0, 0}), {1, 0, 3});
  expect_near(transform_of("<translate value=\"1 2 3\"/>").point({0, 0, 0}), {1, 2, 3});
  expect_near(transform_of("<scale x=\"2\"/>").point({1, 1, 1}), {2, 1, 1});
  expect_near(transform_of("<scale value=\"3\"/>").point({1, 1, 1}), {3, 3, 3});
  expect_near(transform_of("<rotate z=\"1\" angle=\"90\"/>").point({1, 0, 0}), {0, 1, 0});
  expect_near(transform_of("<matrix value=\"1 0 0 5  0 1 0 6  0 0 1 7  0 0 0 1\"/>").point({0, 0, 0}), {5, 6, 7});
  expect_near(transform_of("<matrix value=\"0 1 0  1 0 0  0 0 1\"/>").point({1, 2, 3}), {2, 1, 3});
  for (const char* tag : {"lookat", "lookAt", "look_at"}) {
    const Transform look =
        transform_of(std::string("<") + tag + " origin=\"1, 2, 3\" target=\"1, 2, 10\" up=\"0, 1, 0\"/>");
    expect_near(look.point({0, 0, 0}), {1, 2, 3});
    expect_near(look.vector({0, 0, 1}), {0, 0, 1});
    expect_near(look.vector({0, 1, 0}), {0, 1, 0});
  }
  expect_near(transform_of("<lookat origin=\"0 0 0\" target=\"0 5 0\"/>").vector({0, 0, 1}), {0, 1, 0});  // any up
}

TEST(XmlReader, AppliesOperationsInTheirOrder) {
  expect_near(transform_of("<translate x=\"1\"/><scale value=\"2\"/>").point({0, 0, 0}), {2, 0, 0});
  expect_near(transform_of("<scale value=\"2\"/><translate x=\"1\"/>").point({0, 0, 0}), {1, 0, 0});
}

TEST(XmlReader, ReportsWrongTransforms) {
  const Read r = read_scene(R"(<shape type="cube"><transform name="a">
<rotate x="0" angle="3"/>
<rotate x="1"/>
<matrix value="1 2 3"/>
<scale x="0" y="0"/>
<scale value="1" x="2"/>
<translat x="1"/>
<lookat origin="0 0 0" target="0 0 0" up="0 1 0"/>
</transform><translate x="1"/></shape>)");
  EXPECT_TRUE(contains(r.errors, "scene.xml:3:1: <rotate>: the axis is zero\n"));
  EXPECT_TRUE(contains(r.errors, "scene.xml:4:1: <rotate> needs the attribute 'angle'\n"));
  EXPECT_TRUE(contains(r.errors, "scene.xml:5:1: <matrix>: 3 values; expected 9 or 16\n"));
  EXPECT_TRUE(contains(r.errors, "scene.xml:6:1: <scale>: "));
  EXPECT_TRUE(contains(r.errors, "scene.xml:7:1: <scale>: <scale> takes either value or x, y and z\n"));
  EXPECT_TRUE(
      contains(r.errors, "scene.xml:8:1: <translat> cannot stand inside <transform>; did you mean 'translate'?\n"));
  EXPECT_TRUE(contains(r.errors, "scene.xml:9:1: <lookat>: "));
  EXPECT_TRUE(contains(r.errors, "scene.xml:10:13: <translate> can only stand inside <transform>"));
}

// ---- malformed and unknown ----

TEST(XmlReader, ReportsMalformedXmlWithLineAndColumn) {
  const Read r = read("<scene version=\"3.0.0\">\n  <bsdf type=\"diffuse\">\n  </bsd>\n</scene>");
  EXPECT_EQ(r.xml.scene, nullptr);
  EXPECT_TRUE(contains(r.errors, "scene.xml:3:5: malformed XML: "));
  EXPECT_TRUE(contains(read("").errors, "scene.xml:1:1: malformed XML: "));
  EXPECT_TRUE(contains(read("<scene version=\"3.0.0\"><a b=c/></scene>").errors, "scene.xml:1:"));
  EXPECT_EQ(read("\xff\xfe<").errors, "scene.xml:1:1: the file is UTF-16 encoded; expected UTF-8");
}

TEST(XmlReader, AcceptsAByteOrderMarkAndWindowsLines) {
  const Read r =
      read("\xef\xbb\xbf<?xml version=\"1.0\"?>\r\n<scene version=\"3.0.0\">\r\n<flim type=\"x\"/>\r\n</scene>\r\n");
  EXPECT_EQ(r.errors, "scene.xml:3:1: unknown element <flim>; did you mean 'film'?");
}

TEST(XmlReader, ReadsAnimations) {
  const Read r = read_scene(R"(<shape type="cube"><animation name="to_world">
  <transform time="-1"><scale value="2"/><translate x="3"/></transform><transform time="0.5"/></animation></shape>)");
  EXPECT_EQ(r.errors, "no error");
  const std::vector<TransformKey>& keys = value<KeyedTransformPtr>(r, "to_world")->keys();
  ASSERT_EQ(keys.size(), 2u);
  EXPECT_EQ(keys[0].time, -1);
  EXPECT_EQ(keys[0].matrix, (Transform::translate({3, 0, 0}) * Transform::scale({2, 2, 2})).matrix());
  EXPECT_EQ(keys[1].time, 0.5);
  EXPECT_EQ(keys[1].matrix, Transform().matrix());
}

TEST(XmlReader, ReportsWrongAnimations) {
  const Read r = read_scene(R"(<shape type="cube"><animation name="a"><translate x="3"/></animation>
<animation name="b"><transform/></animation>
<animation name="c"><transform time="1"/><transform time="1"/></animation>
<animation name="d"/>
<animation name="e"><transform time="0"><scale value="0"/></transform></animation></shape>)");
  EXPECT_EQ(r.errors,
            "scene.xml:2:20: 'a': <translate> cannot stand inside <animation>, only <transform time=\"…\">\n"
            "scene.xml:3:21: <transform> needs the attribute 'time'\n"
            "scene.xml:4:1: 'c': keyframe 1: the time 1 is not after 1, that of the one before\n"
            "scene.xml:5:1: 'd': there are no keyframes\n"
            "scene.xml:6:41: <scale>: the transformation matrix is singular");
}

TEST(XmlReader, ReportsWrongRoots) {
  EXPECT_EQ(read("<bsdf type=\"diffuse\" version=\"3.0.0\"/>").errors,
            "scene.xml:1:1: the root element is <bsdf>; a scene file starts with <scene>");
  EXPECT_EQ(read("<scene/>").errors,
            "scene.xml:1:1: <scene> has no attribute 'version'; add version=\"3.0.0\", or \"0.6.0\" if the file uses "
            "names like "
            "'toWorld'");
  EXPECT_EQ(read("<scene version=\"new\"/>").errors, "scene.xml:1:1: version 'new' is not of the form 3.0.0");
  EXPECT_EQ(read("<scene version=\"3.\"/>").errors, "scene.xml:1:1: version '3.' is not of the form 3.0.0");
  EXPECT_NE(read("<scene version=\"3.1.2.3\"/>").errors, "no error");
  EXPECT_NE(read("<scene version=\"-3\"/>").errors, "no error");
  EXPECT_EQ(read("<scene version=\"3\"/>").errors, "no error");
  EXPECT_EQ(read("<scene version=\"3.6.1\"/>").errors, "no error");
}

TEST(XmlReader, ReportsAllProblemsAtOnce) {
  const Read r = read_scene(R"(<bdsf type="diffuse"/>
<bsdf/>
<bsdf typ="diffuse"/>
<bsdf type="diffuse">
  <float name="a" value="x"/>
  <float name="b"/>
  <float name="c" value="1" unit="mm"/>
  <point name="d" x="1" y="2"/>
  <float name="e" value="1"><integer name="f" value="1"/></float>
  text
</bsdf>
<scene/>)");
  EXPECT_EQ(r.errors,
            "scene.xml:2:1: unknown element <bdsf>; did you mean 'bsdf'?\n"
            "scene.xml:3:1: <bsdf> needs the attribute 'type'\n"
            "scene.xml:4:1: <bsdf> needs the attribute 'type'\n"
            "scene.xml:4:1: unknown attribute 'typ' of <bsdf>; did you mean 'type'?\n"
            "scene.xml:5:1: <bsdf> holds text; parameters are elements\n"
            "scene.xml:6:3: 'a': 'x' is not a number\n"
            "scene.xml:7:3: <float> needs the attribute 'value'\n"
            "scene.xml:8:3: unknown attribute 'unit' of <float>\n"
            "scene.xml:9:3: 'd': <point> needs x, y and z, or value\n"
            "scene.xml:10:29: <integer> cannot stand inside <float>\n"
            "scene.xml:13:1: <scene> can only be the root element");
}

TEST(XmlReader, ReportsNamesGivenTwice) {
  const Read r = read_scene(
      "<bsdf type=\"diffuse\" id=\"a\"><float name=\"x\" value=\"1\"/>\n<float name=\"x\" value=\"2\"/></bsdf>\n"
      "<bsdf type=\"diffuse\" id=\"a\"/>\n<bsdf type=\"a\" type=\"b\"/>");
  EXPECT_EQ(r.errors,
            "scene.xml:3:1: parameter 'x' of bsdf 'diffuse' is given twice; first at scene.xml:2:29\n"
            "scene.xml:4:1: id 'a' is used twice; first at scene.xml:2:1\n"
            "scene.xml:5:1: attribute 'type' of <bsdf> is given twice");
}

/// As in Mitsuba before version 3: a warning, and the last value.
TEST(XmlReader, OldFilesMayGiveAParameterTwice) {
  for (const char* version : {"0.5.0", "2.0.0"}) {
    const Read r = read("<scene version=\"" + std::string(version) +
                        "\"><film type=\"hdrfilm\"><integer name=\"height\" value=\"5\"/>\n"
                        "<integer name=\"height\" value=\"6\"/></film></scene>");
    EXPECT_EQ(r.errors, "no error");
    ASSERT_EQ(r.warnings.size(), 1u);
    EXPECT_TRUE(contains(r.warnings[0],
                         "scene.xml:2:1: parameter 'height' of film 'hdrfilm' is given twice; first at "
                         "scene.xml:1:45; the last one counts, as in Mitsuba before version 3"))
        << r.warnings[0];
    EXPECT_EQ(child(r).properties.size(), 1u);
    EXPECT_EQ(value<int64_t>(r, "height"), 6);
  }
}

TEST(XmlReader, BoundsNesting) {
  std::string deep;
  for (int i = 0; i < 1000; ++i) deep += "<bsdf type=\"twosided\">";
  for (int i = 0; i < 1000; ++i) deep += "</bsdf>";
  EXPECT_TRUE(contains(read_scene(deep).errors, "more than 64 nested objects"));
}

}  // namespace
}  // namespace covary
