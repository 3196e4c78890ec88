// SPDX-License-Identifier: Apache-2.0
#include "scene/parameters.h"

#include <gtest/gtest.h>

#include "support/describe.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::GivenObjects;
using test_support::message_of;

/// An object with given properties; property i is on line i + 2.
class ParametersTest : public ::testing::Test {
 protected:
  Parameters& with(const test_support::NamedValues& values) {
    object_.kind = "bsdf", object_.type = "test", object_.where = {"scene.xml", 1, 3};
    for (size_t i = 0; i < values.size(); ++i)
      object_.properties.push_back({values[i].first, values[i].second, {"scene.xml", static_cast<int>(i) + 2, 5}});
    parameters_.emplace(object_, objects_, diagnostics_);
    return *parameters_;
  }
  std::string errors() const {
    return message_of([&] { diagnostics_.throw_if_errors(); });
  }

  ObjectDescription object_;
  Diagnostics diagnostics_;
  GivenObjects objects_{diagnostics_};
  std::optional<Parameters> parameters_;
};

TEST_F(ParametersTest, ReturnsValuesOfEveryType) {
  Parameters& p = with({{"b", true},
                        {"i", int64_t{7}},
                        {"f", 0.25},
                        {"s", std::string("text")},
                        {"v", Vec3{1, 2, 3}},
                        {"c", ColourValue{{0.1f, 0.2f, 0.3f}}},
                        {"l", SampledSpectrum{{{0, 0.5f}}}},
                        {"t", Transform::translate({1, 0, 0})}});
  EXPECT_TRUE(p.get_bool("b", false));
  EXPECT_EQ(p.get_int("i", 0, 0, 10), 7);
  EXPECT_EQ(p.get_float("i", 0), 7.0f);  // integers are accepted as numbers
  EXPECT_EQ(p.get_float("f", 0), 0.25f);
  EXPECT_EQ(p.get_string("s", ""), "text");
  EXPECT_EQ(p.require_string("s"), "text");
  EXPECT_EQ(p.get_choice("s", "a", {"a", "text"}), "text");
  EXPECT_EQ(p.get_vec3("v", {}), (Vec3{1, 2, 3}));
  EXPECT_EQ(p.get_spectrum("c", Spectrum(0), SpectrumRole::kReflectance), Spectrum(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(p.get_spectrum("l", Spectrum(0), SpectrumRole::kReflectance), Spectrum(0.5f));
  EXPECT_EQ(p.get_spectrum("f", Spectrum(0), SpectrumRole::kEmission), Spectrum(0.25f));
  EXPECT_EQ(p.get_transform("t").point({0, 0, 0}), (Vec3{1, 0, 0}));
  p.report_unknown();
  EXPECT_EQ(errors(), "no error");
}

TEST_F(ParametersTest, ReturnsFallbacksOfAbsentParameters) {
  Parameters& p = with({});
  EXPECT_TRUE(p.get_bool("b", true));
  EXPECT_EQ(p.get_int("i", 3, 0, 10), 3);
  EXPECT_EQ(p.get_float("f", 1.5f), 1.5f);
  EXPECT_EQ(p.get_string("s", "x"), "x");
  EXPECT_EQ(p.get_spectrum("c", Spectrum(2), SpectrumRole::kEmission), Spectrum(2));
  EXPECT_TRUE(p.get_transform("t").is_identity());
  EXPECT_EQ(p.find_texture("m"), nullptr);
  EXPECT_EQ(p.get_texture("m", 0.5f)->eval({}), Spectrum(0.5f));
  EXPECT_FALSE(p.has("b"));
  EXPECT_EQ(errors(), "no error");
}

TEST_F(ParametersTest, ReportsWrongTypesWithTheirPlace) {
  Parameters& p = with({{"flag", int64_t{1}}, {"count", 0.5}, {"alpha", std::string("rough")}, {"eta", true}});
  EXPECT_FALSE(p.get_bool("flag", false));
  EXPECT_EQ(p.get_int("count", 2, 0, 10), 2);
  EXPECT_EQ(p.get_float("alpha", 0.1f), 0.1f);
  p.get_texture("eta", 1.0f);
  EXPECT_EQ(
      errors(),
      "scene.xml:2:5: parameter 'flag' of bsdf 'test' must be a boolean, not an integer\n"
      "scene.xml:3:5: parameter 'count' of bsdf 'test' must be an integer, not a float\n"
      "scene.xml:4:5: parameter 'alpha' of bsdf 'test' must be a float, not a string\n"
      "scene.xml:5:5: parameter 'eta' of bsdf 'test' must be a texture, float, rgb colour or spectrum, not a boolean");
}

TEST_F(ParametersTest, ReportsValuesOutOfRange) {
  Parameters& p = with({{"fov", 190.0},
                        {"depth", int64_t{-5}},
                        {"colour", ColourValue{{0.5f, 1.5f, 0}}},
                        {"huge", 1e300},
                        {"spp", int64_t{0}}});
  p.get_float("fov", 50, 0, 180);
  p.get_int("depth", -1, -1, 100);
  p.get_spectrum("colour", Spectrum(0), SpectrumRole::kReflectance);
  EXPECT_EQ(p.get_float("huge", 1), 1);
  EXPECT_EQ(p.get_int("spp", 4, 1, std::numeric_limits<int>::max()), 4);
  EXPECT_EQ(
      errors(),
      "scene.xml:2:5: parameter 'fov' of bsdf 'test' is 190; it must lie in [0, 180]\n"
      "scene.xml:3:5: parameter 'depth' of bsdf 'test' is -5; it must lie in [-1, 100]\n"
      "scene.xml:4:5: parameter 'colour' of bsdf 'test' is the colour (0.5, 1.5, 0); reflectances must lie in [0, 1]\n"
      "scene.xml:5:5: parameter 'huge' of bsdf 'test' is 1e+300, which is too large for a float\n"
      "scene.xml:6:5: parameter 'spp' of bsdf 'test' is 0; it must be at least 1");
}

TEST_F(ParametersTest, AcceptsBrightColoursForEmissionAndIndices) {
  Parameters& p = with({{"radiance", ColourValue{{17, 12, 4}}}, {"eta", ColourValue{{1.6f, 0.8f, 0.5f}}}});
  EXPECT_EQ(p.get_spectrum("radiance", Spectrum(0), SpectrumRole::kEmission), Spectrum(17, 12, 4));
  EXPECT_EQ(p.get_texture("eta", Spectrum(0), SpectrumRole::kIndex)->eval({}), Spectrum(1.6f, 0.8f, 0.5f));
  EXPECT_EQ(errors(), "no error");
}

TEST_F(ParametersTest, ListsChoices) {
  Parameters& p = with({{"distribution", std::string("gggx")}});
  EXPECT_EQ(p.get_choice("distribution", "beckmann", {"beckmann", "ggx"}), "beckmann");
  EXPECT_EQ(errors(),
            "scene.xml:2:5: parameter 'distribution' of bsdf 'test' is 'gggx'; expected one of 'beckmann', 'ggx'; did "
            "you mean "
            "'ggx'?");
}

TEST_F(ParametersTest, ReportsUnknownParametersWithTheNearestKnownOnes) {
  Parameters& p = with({{"reflectanc", 0.5}, {"zzzzzzzz", 1.0}, {"", Vec3{}}});
  p.get_texture("reflectance", 0.5f);
  p.get_bool("nonlinear", false);
  p.report_unknown();
  EXPECT_EQ(errors(),
            "scene.xml:2:5: unknown parameter 'reflectanc' of bsdf 'test'; did you mean 'reflectance'?\n"
            "scene.xml:3:5: unknown parameter 'zzzzzzzz' of bsdf 'test'; known: 'nonlinear', 'reflectance'\n"
            "scene.xml:4:5: bsdf 'test' cannot hold a vector");
}

TEST_F(ParametersTest, ReportsMissingRequiredStrings) {
  Parameters& p = with({{"filename", std::string()}});
  EXPECT_EQ(p.require_string("name"), "");
  EXPECT_EQ(p.require_file("filename"), "");
  EXPECT_EQ(errors(),
            "scene.xml:1:3: bsdf 'test': the string 'name' is missing\n"
            "scene.xml:2:5: parameter 'filename' of bsdf 'test' must not be empty");
}

TEST_F(ParametersTest, DoesNotReportValuesAgainThatCouldNotBeRead) {
  Parameters& p = with({{"filename", ObjectPtr()}, {"alpha", ObjectPtr()}, {"", ObjectPtr()}});
  EXPECT_EQ(p.require_string("filename"), "");
  EXPECT_EQ(p.get_float("alpha", 0.3f), 0.3f);
  p.report_unknown();
  EXPECT_EQ(errors(), "no error");
}

TEST_F(ParametersTest, HandsOutNestedObjects) {
  const auto texture = std::make_shared<ConstantTexture>(Spectrum(0.2f));
  const auto other = std::make_shared<ConstantTexture>(Spectrum(0.4f));
  Parameters& p = with({{"", objects_.nest("texture", other)},
                        {"weight", objects_.nest("texture", texture)},
                        {"", objects_.nest("emitter", nullptr)}});
  EXPECT_EQ(p.get_texture("weight", 1.0f), texture);
  const auto children = p.children<Texture>("texture");  // "weight" is taken
  ASSERT_EQ(children.size(), 1u);
  EXPECT_EQ(children[0], other);
  p.report_unknown();
  EXPECT_EQ(errors(), "scene.xml:4:5: bsdf 'test' cannot hold emitter 'given'");
}

TEST_F(ParametersTest, RejectsObjectsOfAnotherKindAsTextures) {
  Parameters& p = with({{"weight", objects_.nest("emitter", nullptr)}});
  EXPECT_EQ(p.find_texture("weight"), nullptr);
  EXPECT_EQ(errors(),
            "scene.xml:2:5: parameter 'weight' of bsdf 'test' must be a texture, float, rgb colour or spectrum, not an "
            "emitter");
}

TEST(Diagnostics, SortsAndMergesErrors) {
  Diagnostics diagnostics, other;
  diagnostics.error({"b.xml", 1, 1}, "fourth");
  diagnostics.error({"a.xml", 10, 1}, "third");
  other.error({"a.xml", 2, 7}, "second");
  other.error({"a.xml", 2, 3}, "first");
  other.error({"a.xml", 2, 3}, "first");  // reported twice, shown once
  other.warn({"a.xml", 3, 1}, "odd");
  diagnostics.append(other);
  EXPECT_EQ(message_of([&] { diagnostics.throw_if_errors(); }),
            "a.xml:2:3: first\na.xml:2:7: second\na.xml:10:1: third\nb.xml:1:1: fourth");
  ASSERT_EQ(diagnostics.warnings().size(), 1u);
  EXPECT_EQ(diagnostics.warnings()[0], "a.xml:3:1: odd");
}

TEST(Diagnostics, CountsManyErrorsOfAKind) {
  Diagnostics diagnostics;
  for (int line = 8; line >= 1; --line) diagnostics.error({"a.xml", line, 1}, "no mesh", "meshes not found in 'm'");
  diagnostics.error({"a.xml", 9, 1}, "another");
  diagnostics.error({"b.xml", 1, 1}, "no image", "images not found in 'i'");
  EXPECT_EQ(message_of([&] { diagnostics.throw_if_errors(); }),
            "a.xml:1:1: no mesh\na.xml:2:1: no mesh\na.xml:3:1: no mesh\na.xml:4:1: no mesh\na.xml:5:1: no mesh\n"
            "a.xml:9:1: another\nb.xml:1:1: no image\n… and 3 more meshes not found in 'm'");
}

TEST(SourceLocation, LeavesOutTheLineOfAWholeFile) {
  EXPECT_EQ((SourceLocation{"a.xml", 3, 4}).text(), "a.xml:3:4");
  EXPECT_EQ((SourceLocation{"a.xml"}).text(), "a.xml");
}

}  // namespace
}  // namespace covary
