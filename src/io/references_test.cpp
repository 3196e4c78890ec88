// SPDX-License-Identifier: Apache-2.0
// Top-level objects that others reference, and integrators that wrap others.
#include <gtest/gtest.h>

#include "io/load_scene.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::message_of;

/// Records the properties of the integrator created.
struct IntegratorRecord : SceneObject {
  std::vector<std::string> names;
};

LoadedScene load(const std::string& body) {
  LoadOptions options;
  options.make_integrator = [](Parameters& p) -> std::shared_ptr<SceneObject> {
    auto record = std::make_shared<IntegratorRecord>();
    p.get_int("max_depth", -1, -1, 100);
    for (const Property& property : p.object().properties) record->names.push_back(property.name);
    return record;
  };
  return load_scene_text("<scene version=\"3.0.0\">\n" + body + "\n</scene>\n", "scene.xml", options);
}

std::string errors(const std::string& body) {
  return message_of([&] { load(body); });
}

std::string warnings(const LoadedScene& scene) {
  std::string text;
  for (const std::string& warning : scene.warnings) text += warning + "\n";
  return text;
}

const std::string kSensor = "<sensor type=\"perspective\"/>\n";

TEST(SceneReferences, LightAtTopShinesWhereShapesReferToIt) {
  const LoadedScene s = load(kSensor +
                             "<emitter type=\"area\" id=\"lamp\"><rgb name=\"radiance\" value=\"3\"/></emitter>"
                             "<shape type=\"sphere\"><ref id=\"lamp\"/></shape>"
                             "<shape type=\"disk\"><ref id=\"lamp\" name=\"light\"/></shape><shape type=\"cube\"/>");
  ASSERT_EQ(s.scene->emitters().size(), 2u);
  for (const auto& emitter : s.scene->emitters()) EXPECT_GT(emitter->power().r, 0);
  EXPECT_EQ(warnings(s), "");
}

TEST(SceneReferences, LightThatNothingRefersTo) {
  const std::string shape = kSensor + "<shape type=\"sphere\"/>";
  const LoadedScene s = load(shape + "<emitter type=\"area\" id=\"lamp\"/>");
  EXPECT_EQ(s.scene->emitters().size(), 0u);
  EXPECT_EQ(warnings(s), "scene.xml:3:23: emitter 'area' is not used: nothing refers to the id 'lamp'\n");
  EXPECT_TRUE(contains(errors(shape + "<emitter type=\"area\"/>"), "must stand inside the shape"));
}

TEST(SceneReferences, PartsOfSensors) {
  const LoadedScene s = load(
      "<sampler type=\"sobol\" id=\"points\"><integer name=\"sample_count\" value=\"33\"/></sampler>"
      "<rfilter type=\"tent\" id=\"filter\"/>"
      "<film type=\"hdrfilm\" id=\"film\"><integer name=\"width\" value=\"7\"/><ref id=\"filter\"/></film>"
      "<sensor type=\"perspective\"><ref id=\"points\"/><ref id=\"film\"/></sensor><shape type=\"sphere\"/>");
  EXPECT_EQ(s.spp, 33);
  EXPECT_EQ(s.width, 7);
  EXPECT_EQ(s.filter.kind, FilterKind::kTent);
  EXPECT_EQ(warnings(s), "");
  EXPECT_TRUE(contains(warnings(load(kSensor + "<shape type=\"sphere\"/><sampler type=\"sobol\" id=\"a\"/>")),
                       "sampler 'sobol' is not used"));
  EXPECT_TRUE(contains(errors(kSensor + "<shape type=\"sphere\"/><sampler type=\"sobol\"/>"),
                       "unknown part <sampler> of <scene>"));
}

TEST(SceneReferences, WrappedIntegratorIsRendered) {
  const std::string rest = kSensor + "<shape type=\"sphere\"/>";
  const auto names = [](const LoadedScene& s) { return static_cast<IntegratorRecord&>(*s.integrator).names; };
  const std::string path =
      "<integrator type=\"path\" name=\"image\"><integer name=\"max_depth\" value=\"3\"/>"
      "<integer name=\"samples_per_pass\" value=\"8\"/></integrator>";
  const LoadedScene moment = load(rest + "<integrator type=\"moment\">" + path + "</integrator>");
  EXPECT_EQ(moment.integrator_type, "path");
  EXPECT_EQ(names(moment), std::vector<std::string>{"max_depth"});
  EXPECT_TRUE(contains(warnings(moment), "second moments are left out"));
  const LoadedScene aov = load(rest +
                               "<integrator type=\"aov\"><string name=\"aovs\" value=\"dd:depth\"/>"
                               "<integrator type=\"moment\">" +
                               path + "</integrator></integrator>");
  EXPECT_EQ(aov.integrator_type, "path");
  EXPECT_TRUE(contains(warnings(aov), "the channels of 'aovs' are left out"));
  const LoadedScene by_id = load(rest +
                                 "<integrator type=\"direct\" id=\"inner\"/>"
                                 "<integrator type=\"moment\"><ref id=\"inner\"/></integrator>");
  EXPECT_EQ(by_id.integrator_type, "direct");
  const LoadedScene light = load(rest + "<integrator type=\"ptracer\"/>");
  EXPECT_EQ(light.integrator_type, "bdpt");
  EXPECT_TRUE(contains(warnings(light), "'ptracer' is read as 'bdpt'"));
}

TEST(SceneReferences, WrongWrappers) {
  const std::string rest = kSensor + "<shape type=\"sphere\"/>";
  EXPECT_TRUE(
      contains(errors(rest + "<integrator type=\"aov\"><string name=\"aovs\" value=\"dd:depth\"/></integrator>"),
               "integrator 'aov' holds no integrator"));
  EXPECT_TRUE(contains(errors(rest + "<integrator type=\"moment\"><string name=\"aovs\" value=\"dd:depth\"/>"
                                     "<integrator type=\"path\"/></integrator>"),
                       "unknown parameter 'aovs' of integrator 'moment'"));
  EXPECT_TRUE(contains(errors(rest + "<integrator type=\"path\"/><integrator type=\"moment\">"
                                     "<integrator type=\"path\"/></integrator>"),
                       "a second integrator"));
}

}  // namespace
}  // namespace covary
