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

TEST(VertexColour, NamesTheAttributeItDoesNotKnow) {
  const auto made =
      make_plugin<Texture>(texture_plugins(), "texture", "mesh_attribute", {{"name", std::string("face_color")}});
  EXPECT_EQ(made.object, nullptr);
  EXPECT_NE(
      made.errors.find("test.xml:2:1: parameter 'name' of texture 'mesh_attribute' is 'face_color'; the only mesh "
                       "attribute known is 'vertex_color'"),
      std::string::npos)
      << made.errors;
}

}  // namespace
}  // namespace covary
