// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "scene/mesh.h"
#include "support/describe.h"
#include "textures/registry.h"

namespace covary {
namespace {

using test_support::make_plugin;

TriangleMesh triangle(std::vector<Spectrum> colours) {
  MeshData data;
  data.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  data.triangles = {{0, 1, 2}};
  data.colours = std::move(colours);
  return TriangleMesh(std::move(data));
}

TEST(VertexColour, InterpolatesTheColoursOfTheMesh) {
  const TriangleMesh mesh = triangle({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  SurfaceHit hit;
  hit.shape = &mesh, hit.barycentric = {0.25f, 0.5f};
  const auto old_name = make_plugin<Texture>(texture_plugins(), "texture", "vertexcolor", {});
  EXPECT_EQ(old_name.object->eval(hit), Spectrum(0.25f, 0.25f, 0.5f));
  const auto new_name = make_plugin<Texture>(texture_plugins(), "texture", "mesh_attribute",
                                             {{"name", std::string("vertex_color")}, {"scale", 2.0}});
  ASSERT_EQ(new_name.errors, "");
  EXPECT_EQ(new_name.object->eval(hit), Spectrum(0.5f, 0.5f, 1.0f));
  EXPECT_FLOAT_EQ(new_name.object->eval_1(hit), luminance({0.5f, 0.5f, 1.0f}));
}

TEST(VertexColour, IsWhiteOnMeshesWithoutColours) {
  const TriangleMesh mesh = triangle({});
  SurfaceHit hit;
  hit.shape = &mesh;
  EXPECT_EQ(make_plugin<Texture>(texture_plugins(), "texture", "vertexcolor", {}).object->eval(hit), Spectrum(1));
}

TEST(VertexColour, RefusesOtherNames) {
  const auto made =
      make_plugin<Texture>(texture_plugins(), "texture", "mesh_attribute", {{"name", std::string("colour")}});
  EXPECT_EQ(made.object, nullptr);
  EXPECT_NE(made.errors.find("'name' of texture 'mesh_attribute' is 'colour'; expected a name that begins with "
                             "'vertex_' or 'face_'"),
            std::string::npos)
      << made.errors;
}

/// The first of two triangles has zero area and is dropped: the second must keep its own values.
TEST(MeshAttribute, IsOfTheVertexOrTheFace) {
  MeshData data;
  data.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  data.triangles = {{0, 1, 1}, {0, 1, 2}};
  data.attributes = {{"face_color", true, 3, {9, 9, 9, 1, 2, 3}}, {"vertex_weight", false, 1, {0, 4, 8}}};
  const TriangleMesh mesh(std::move(data));
  ASSERT_EQ(mesh.n_degenerate(), 1u);
  SurfaceHit hit;
  hit.shape = &mesh, hit.barycentric = {0.25f, 0.5f};
  const auto made = [](const char* name) {
    return make_plugin<Texture>(texture_plugins(), "texture", "mesh_attribute", {{"name", std::string(name)}}).object;
  };
  EXPECT_EQ(made("face_color")->eval(hit), Spectrum(1, 2, 3));
  EXPECT_EQ(made("vertex_weight")->eval(hit), Spectrum(5));
  EXPECT_FLOAT_EQ(made("vertex_weight")->eval_1(hit), 5);
  EXPECT_EQ(made("face_weight")->eval(hit), Spectrum(1));
  EXPECT_TRUE(mesh.has_attribute("face_color"));
  EXPECT_FALSE(mesh.has_attribute("vertex_color"));
  const auto moved = mesh.transformed(Transform::scale({-1, 1, 1}));
  hit.shape = moved.get();
  EXPECT_EQ(made("face_color")->eval(hit), Spectrum(1, 2, 3));
}

TEST(RawConstant, TakesNumbersAndVectors) {
  const auto number = make_plugin<Texture>(texture_plugins(), "texture", "rawconstant", {{"value", 7.5}});
  EXPECT_EQ(number.object->eval({}), Spectrum(7.5f));
  const auto vector = make_plugin<Texture>(texture_plugins(), "texture", "rawconstant", {{"value", Vec3{0.5f, -2, 3}}});
  EXPECT_EQ(vector.object->eval({}), Spectrum(0.5f, -2, 3));
  EXPECT_NE(make_plugin<Texture>(texture_plugins(), "texture", "rawconstant", {}).errors.find("'value' is missing"),
            std::string::npos);
}

}  // namespace
}  // namespace covary
