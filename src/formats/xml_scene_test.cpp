// SPDX-License-Identifier: Apache-2.0
// Mitsuba XML scenes as a whole: parameters, references, included files, upgrading of old versions.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
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

// ---- parameters of the scene ----

TEST(XmlReader, SubstitutesParameters) {
  const std::string body = R"(<default name="res" value="1"/>
<default name="resx" value="2"/>
<default name="kind" value="diff"/>
<bsdf type="${}kind$kind$res"><string name="s" value="$resx-$res-\$res"/></bsdf>)";
  EXPECT_TRUE(
      contains(read_scene(body).errors, "scene.xml:5:1: attribute 'type' of <bsdf>: parameter '$' is not defined"));
  const std::string good = R"(<default name="res" value="1"/><default name="resx" value="2"/>
<bsdf type="a$res"><string name="s" value="$resx-$res-\$res"/></bsdf>)";
  const Read r = read_scene(good);
  EXPECT_EQ(r.errors, "no error");
  EXPECT_EQ(child(r).type, "a1");
  EXPECT_EQ(value<std::string>(r, "s"), "2-1-$res");
  EXPECT_EQ(value<std::string>(read_scene(good, {{"res", "7"}}), "s"), "2-7-$res");
}

TEST(XmlReader, ReportsUndefinedAndUnusedParameters) {
  const std::string body = R"(<default name="spp" value="16"/><default name="depth" value="3"/>
<bsdf type="x"><integer name="s" value="$sppp"/><integer name="t" value="$sp"/></bsdf>)";
  EXPECT_EQ(read_scene(body).errors,
            "scene.xml:3:16: 's': '16p' is not an integer\n"
            "scene.xml:3:49: attribute 'value' of <integer>: parameter '$sp' is not defined; did you mean 'spp'? "
            "Or give it a value by -D sp=VALUE, or by <default name=\"sp\" value=\"…\"/>");
  EXPECT_TRUE(contains(read_scene("<bsdf type=\"$kind\"/>").errors,
                       "'$kind' is not defined; give it a value by -D kind=VALUE, or by <default name=\"kind\""));
  EXPECT_EQ(
      read_scene("<default name=\"spp\" value=\"16\"/><default name=\"depth\" value=\"3\"/>",
                 {{"samples", "4"}, {"sp", "3"}})
          .errors,
      "scene.xml: the scene does not use the parameter 'samples' that was defined from outside; its parameters "
      "are 'depth', "
      "'spp'\n"
      "scene.xml: the scene does not use the parameter 'sp' that was defined from outside; did you mean 'spp'? Its "
      "parameters are 'depth', 'spp'");
  EXPECT_EQ(read_scene("", {{"a", "4"}}).errors,
            "scene.xml: the scene does not use the parameter 'a' that was defined from outside; it has no parameters");
}

TEST(XmlReader, BoundsSubstitution) {
  std::string body = "<default name=\"a\" value=\"xxxxxxxxxxxxxxxx\"/>";
  for (char c = 'b'; c <= 'z'; ++c) {
    body += fmt::format("<default name=\"{0}\" value=\"${1}${1}${1}${1}\"/>", c, static_cast<char>(c - 1));
  }
  EXPECT_TRUE(contains(read_scene(body).errors, "it grows beyond 1 MiB by substitution"));
}

// ---- references ----

TEST(XmlReader, ResolvesReferencesInAnyOrder) {
  const Read r = read_scene(R"(<shape type="cube"><ref id="later"/><ref name="bsdf" id="other"/></shape>
<alias id="later" as="other"/>
<bsdf type="diffuse" id="later"/>)");
  EXPECT_EQ(r.errors, "no error");
  const ObjectPtr later = std::get<ObjectPtr>(r.xml.scene->properties[1].value);
  EXPECT_EQ(std::get<ObjectPtr>(child(r).properties[0].value), later);
  EXPECT_EQ(value<ObjectPtr>(r, "bsdf"), later);
}

TEST(XmlReader, ReportsUnknownReferences) {
  const Read r = read_scene(
      "<bsdf type=\"diffuse\" id=\"wood\"/>\n<shape type=\"cube\"><ref id=\"wod\"/></shape>\n<alias id=\"x\" "
      "as=\"y\"/>\n"
      "<alias id=\"wood\" as=\"wood\"/>");
  EXPECT_EQ(r.errors,
            "scene.xml:3:20: reference to the unknown id 'wod'; did you mean 'wood'?\n"
            "scene.xml:4:1: alias of the unknown id 'x'\n"
            "scene.xml:5:1: id 'wood' is used twice; first at scene.xml:2:1");
}

TEST(XmlReader, ReportsReferencesInACircle) {
  const Read r = read_scene(
      "<bsdf type=\"twosided\" id=\"a\"><ref id=\"b\"/></bsdf>\n<bsdf type=\"twosided\" id=\"b\"><ref "
      "id=\"a\"/></bsdf>\n"
      "<bsdf type=\"twosided\" id=\"c\"><ref id=\"c\"/></bsdf>");
  EXPECT_EQ(r.errors, "scene.xml:3:30: 'a' refers to itself\nscene.xml:4:30: 'c' refers to itself");
}

// ---- files ----

TEST(XmlReader, IncludesFiles) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("objects.xml"))
      << "<scene version=\"0.6.0\"><bsdf type=\"plastic\" id=\"p\"><float name=\"intIOR\" value=\"$ior\"/></bsdf>\n"
         "<shape type=\"cube\"/></scene>";
  std::ofstream(folder.file("one.xml")) << "<bsdf version=\"3.0.0\" type=\"diffuse\"/>";
  const Read r = read(
      "<scene version=\"3.0.0\"><default name=\"ior\" value=\"1.4\"/><include filename=\"objects.xml\"/>"
      "<shape type=\"sphere\"><include filename=\"one.xml\"/><ref name=\"x\" id=\"p\"/></shape></scene>",
      {}, folder.file("scene.xml"));
  EXPECT_EQ(r.errors, "no error");
  ASSERT_EQ(r.xml.scene->properties.size(), 3u);
  EXPECT_EQ(value<double>(r, "int_ior"), 1.4);
  EXPECT_EQ(child(r, 1).type, "cube");
  EXPECT_EQ(std::get<ObjectPtr>(child(r, 2).properties[0].value)->type, "diffuse");
  EXPECT_EQ(value(child(r, 2), "x").index(), Value(ObjectPtr()).index());
  EXPECT_EQ(child(r, 1).where.text(), folder.file("objects.xml") + ":2:1");
}

TEST(XmlReader, ReportsProblemsOfIncludedFiles) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("bad.xml")) << "<scene version=\"3.0.0\">\n<bsdf>\n</scene>";
  std::ofstream(folder.file("loop.xml")) << "<scene version=\"3.0.0\"><include filename=\"loop.xml\"/></scene>";
  const std::string errors = read(
                                 "<scene version=\"3.0.0\"><include filename=\"bad.xml\"/>\n<include "
                                 "filename=\"loop.xml\"/>\n<include filename=\"lop.xml\"/></scene>",
                                 {}, folder.file("scene.xml"))
                                 .errors;
  EXPECT_TRUE(contains(errors, "bad.xml:3:3: malformed XML: "));
  EXPECT_TRUE(contains(errors, "loop.xml:1:24: more than 15 nested includes"));
  EXPECT_TRUE(contains(errors, "scene.xml:3:1: file 'lop.xml' not found"));
  EXPECT_TRUE(contains(errors, "did you mean 'loop.xml'"));
}

TEST(XmlReader, SearchesFoldersOfPathElements) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.file("sub"));
  std::ofstream(folder.file("sub/a.spd")) << "400 1\n500 2\n";
  const Read r = read(
      "<scene version=\"3.0.0\"><path value=\"sub\"/><bsdf type=\"x\"><spectrum name=\"s\" "
      "filename=\"a.spd\"/></bsdf>\n"
      "<path value=\"nowhere\"/>\n<bsdf type=\"y\"><path value=\"sub\"/></bsdf></scene>",
      {}, folder.file("scene.xml"));
  EXPECT_EQ(value<SampledSpectrum>(r, "s").samples.size(), 2u);
  ASSERT_EQ(r.warnings.size(), 1u);
  EXPECT_TRUE(contains(r.warnings[0], "scene.xml:2:1: folder '" + folder.file("nowhere") + "' not found"));
  EXPECT_TRUE(contains(r.errors, "scene.xml:3:16: <path> can only stand inside <scene>"));
}

TEST(XmlReader, HashFollowsTextAndDefines) {
  const std::string body = "<default name=\"a\" value=\"1\"/><bsdf type=\"x$a\"/>";
  const uint64_t hash = read_scene(body).xml.hash;
  EXPECT_EQ(read_scene(body).xml.hash, hash);
  EXPECT_NE(read_scene(body + " ").xml.hash, hash);
  EXPECT_NE(read_scene(body, {{"a", "1"}}).xml.hash, hash);
  EXPECT_NE(read_scene(body, {{"a", "1"}}).xml.hash, read_scene(body, {{"a", "2"}}).xml.hash);
}

// ---- older files ----

Read read_old(const std::string& body) { return read("<scene version=\"0.6.0\">\n" + body + "\n</scene>\n"); }

TEST(XmlReader, TurnsOldNamesIntoTodays) {
  const Read r = read_old(R"(<sensor type="perspective"><string name="fovAxis" value="smaller"/>
<transform name="toWorld"><lookAt origin="0 0 0" target="0 0 1" up="0 1 0"/></transform>
<float name="intIOR" value="1"/><float name="alphaU" value="1"/><float name="already_new" value="1"/></sensor>)");
  EXPECT_EQ(r.errors, "no error");
  EXPECT_EQ(value<std::string>(r, "fov_axis"), "smaller");
  value<Transform>(r, "to_world");
  EXPECT_EQ(value<double>(r, "int_ior"), 1);
  EXPECT_EQ(value<double>(r, "alpha_u"), 1);
  EXPECT_EQ(value<double>(r, "already_new"), 1);
  // Current files are not upgraded.
  EXPECT_EQ(value<double>(read_scene("<bsdf type=\"x\"><float name=\"intIOR\" value=\"1\"/></bsdf>"), "intIOR"), 1);
}

TEST(XmlReader, TurnsOldTextureParametersIntoTodays) {
  const Read r =
      read_old(R"(<texture type="bitmap"><string name="filterType" value="ewa"/><float name="gamma" value="1"/>
<float name="uscale" value="2"/><float name="voffset" value="0.5"/><float name="maxAnisotropy" value="20"/></texture>
<texture type="bitmap"><float name="gamma" value="2.2"/></texture>
<bsdf type="diffuse"><rgb name="diffuseReflectance" value="1"/></bsdf>
<bsdf type="roughconductor"><float name="extEta" value="1"/></bsdf>
<bsdf type="roughconductor"><float name="extEta" value="1.3"/></bsdf>)");
  EXPECT_EQ(r.errors, "no error");
  EXPECT_EQ(value<std::string>(r, "filter_type"), "bilinear");
  EXPECT_TRUE(value<bool>(r, "raw"));
  expect_near(value<Transform>(r, "to_uv").point({0.25f, 0.25f, 0}), {0.5f, 0.75f, 0});
  EXPECT_EQ(child(r).properties.size(), 3u);
  EXPECT_EQ(child(r, 1).properties.size(), 0u);
  EXPECT_EQ(child(r, 2).properties[0].name, "reflectance");
  EXPECT_EQ(child(r, 3).properties.size(), 0u);
  EXPECT_EQ(child(r, 4).properties[0].name, "ext_eta");  // kept: it has no current equivalent
}

TEST(XmlReader, ScalesColoursOfOldFilesThatMakeLight) {
  const Read r = read_old(
      "<bsdf type=\"Phong\"><rgb name=\"specularReflectance\" value=\"4, 2, 1\"/><rgb name=\"diffuseReflectance\" "
      "value=\"1, 0.5, 0\"/></bsdf>");
  EXPECT_EQ(r.errors, "no error");
  EXPECT_EQ(child(r).type, "phong");  // the case of plugins' names did not matter everywhere
  EXPECT_EQ(std::get<ColourValue>(child(r).properties[0].value).rgb, Spectrum(1, 0.5f, 0.25f));
  EXPECT_EQ(std::get<ColourValue>(child(r).properties[1].value).rgb, Spectrum(1, 0.5f, 0));
  ASSERT_EQ(r.warnings.size(), 1u);
  EXPECT_EQ(
      r.warnings[0],
      "scene.xml:2:20: parameter 'specular_reflectance' of bsdf 'phong' is 4 times too bright: it is scaled down, "
      "as in Mitsuba 0.x");
}

TEST(XmlReader, WarnsAboutWhatItDropsFromOldFiles) {
  const Read r = read_old(
      "<film type=\"ldrfilm\"><float name=\"gamma\" value=\"2.2\"/><integer name=\"width\" value=\"3\"/></film>\n"
      "<integrator type=\"path\"><boolean name=\"strictNormals\" value=\"true\"/><boolean name=\"sampleDirect\" "
      "value=\"true\"/></integrator>");
  EXPECT_EQ(r.errors, "no error");
  EXPECT_EQ(child(r).type, "hdrfilm");
  EXPECT_EQ(child(r).properties.size(), 1u);
  EXPECT_EQ(child(r, 1).properties.size(), 0u);
  ASSERT_EQ(r.warnings.size(), 3u);
  EXPECT_EQ(r.warnings[0], "scene.xml:2:1: film 'ldrfilm' is read as 'hdrfilm'");
  EXPECT_EQ(r.warnings[1],
            "scene.xml:3:69: parameter 'sample_direct' of integrator 'path' has no counterpart today and is ignored");
  EXPECT_EQ(r.warnings[2],
            "scene.xml:3:25: parameter 'strict_normals' of integrator 'path' has no counterpart today and is ignored");
}

}  // namespace
}  // namespace covary
