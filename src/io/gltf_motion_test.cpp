// SPDX-License-Identifier: Apache-2.0
// Animations of glTF files by appendix C of the specification, and what directs their textures: several sets of
// coordinates, tangents, the normals of clear coats. No statistics.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/arena.h"
#include "io/load_scene.h"
#include "support/files.h"
#include "support/gltf_builder.h"

namespace covary::gltf_motion_test {
namespace {

using nlohmann::json;
using test_support::contains;
using test_support::Gltf;
using test_support::message_of;

constexpr int kFloat = 5126;

class GltfMotion : public ::testing::Test {
 protected:
  LoadedScene load(const Gltf& file, std::optional<double> time = std::nullopt) {
    std::ofstream(folder_.file("scene.glb"), std::ios::binary) << file.glb();
    LoadOptions options;
    options.time = time;
    return load_scene(folder_.file("scene.glb"), options);
  }
  /// A square that the given properties of node 1 move.
  struct Key {
    std::string path, interpolation;
    std::vector<float> times, values;
  };
  static void animate(Gltf& file, const std::vector<Key>& keys, const std::string& name = "walk") {
    json animation = {{"name", name}, {"channels", json::array()}, {"samplers", json::array()}};
    for (const Key& key : keys) {
      const int width = key.path == "weights" ? 1 : key.path == "rotation" ? 4 : 3;
      const char* type = width == 1 ? "SCALAR" : width == 4 ? "VEC4" : "VEC3";
      const int in = file.add_accessor<float>(key.times, kFloat, "SCALAR", 1);
      const int out = file.add_accessor<float>(key.values, kFloat, type, width);
      animation["channels"].push_back(
          {{"sampler", animation["samplers"].size()}, {"target", {{"node", 1}, {"path", key.path}}}});
      animation["samplers"].push_back({{"input", in}, {"output", out}, {"interpolation", key.interpolation}});
    }
    file.add("animations", animation);
  }
  static Gltf square(const json& material = json::object()) {
    Gltf file;
    file.add_camera();
    file.add("materials", material);
    file.add_root({{"mesh", file.add_square(0)}});
    return file;
  }
  static SurfaceHit at(const LoadedScene& scene, float x, float y) {
    SurfaceHit hit;
    EXPECT_TRUE(scene.scene->intersect({{x, y, 3}, {0, 0, -1}}, hit)) << x << " " << y;
    return hit;
  }

  test_support::TemporaryFolder folder_;
};

TEST_F(GltfMotion, NodesMoveTurnAndGrow) {
  Gltf file = square();
  const float r = std::sqrt(0.5f);  // a quarter turn about z
  animate(file, {{"translation", "LINEAR", {1, 3}, {0, 0, 0, 8, 0, 0}},
                 {"rotation", "LINEAR", {1, 3}, {0, 0, 0, 1, 0, 0, r, r}},
                 {"scale", "STEP", {1, 2}, {1, 1, 1, 3, 3, 3}}});
  const auto bounds = [&](double time) { return load(file, time).scene->bounds(); };
  EXPECT_NEAR(bounds(0).upper.x, 1, 1e-5f);  // before the first key
  const float diagonal = std::sqrt(2.0f);
  EXPECT_NEAR(bounds(2).upper.x, 4 + 3 * diagonal, 1e-4f);  // an eighth of a turn; three times as large from 2 on
  EXPECT_NEAR(bounds(1.999).upper.x, 4 + diagonal, 1e-2f);
  EXPECT_NEAR(bounds(3).upper.x, 8 + 3, 1e-4f);
  EXPECT_NEAR(bounds(9).upper.x, 8 + 3, 1e-4f);
  const LoadedScene rest = load(file);
  EXPECT_TRUE(rest.is_animated);
  EXPECT_NEAR(rest.scene->bounds().upper.x, 1, 1e-5f);
  ASSERT_EQ(rest.warnings.size(), 1u);
  EXPECT_TRUE(contains(rest.warnings[0], "is animated: all is where it stands at rest; `--frames` shows it in motion"));
  EXPECT_NE(rest.content_hash, load(file, 0).content_hash);
  EXPECT_NE(load(file, 1).content_hash, load(file, 0).content_hash);
  EXPECT_EQ(load(file, 1).content_hash, load(file, 1).content_hash);
}

TEST_F(GltfMotion, SplinesFollowTheirTangents) {
  Gltf file = square();
  // Tangent before, value, tangent after, of each key.
  animate(file, {{"translation", "CUBICSPLINE", {0, 2}, {0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 6, 0, 4, 0, 0, 0, 0, 0}}});
  const float t = 0.25f, t2 = t * t, t3 = t2 * t;  // at 0.5 s
  const Vec3 centre = load(file, 0.5).scene->bounds().center();
  EXPECT_NEAR(centre.x, 2 * (t3 - 2 * t2 + t) * 3 + (-2 * t3 + 3 * t2) * 4, 1e-5f);
  EXPECT_NEAR(centre.y, 2 * (t3 - t2) * 6, 1e-5f);
}

TEST_F(GltfMotion, WeightsOfMorphTargetsMove) {
  Gltf file = square();
  const int up = file.add_accessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, kFloat, "VEC3", 3);
  const int down = file.add_accessor<float>({0, 0, -8, 0, 0, -8, 0, 0, -8, 0, 0, -8}, kFloat, "VEC3", 3);
  file.scene["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", up}}, {{"POSITION", down}}};
  file.scene["meshes"][0]["weights"] = {1, 1};
  animate(file, {{"weights", "LINEAR", {0, 1}, {0, 0, 1, 0.5f}}});
  EXPECT_NEAR(at(load(file, 0.5), 0, 0).p.z, 0.5f - 0.25f * 8, 1e-5f);
  EXPECT_NEAR(at(load(file), 0, 0).p.z, 1 - 8, 1e-5f);
}

TEST_F(GltfMotion, TheFirstOfAlternativesIsShown) {
  Gltf file = square();
  animate(file, {{"translation", "LINEAR", {0, 1}, {0, 0, 0, 1, 0, 0}}});
  animate(file, {{"scale", "LINEAR", {0, 1}, {1, 1, 1, 2, 2, 2}}}, "grow");  // of another property: both
  animate(file, {{"translation", "LINEAR", {0, 1}, {0, 0, 0, 9, 0, 0}}}, "run");
  const LoadedScene scene = load(file, 1);
  EXPECT_NEAR(scene.scene->bounds().upper.x, 3, 1e-5f);
  EXPECT_TRUE(contains(scene.warnings[0], "of several animations, the first is shown; left out: 'run'"));
  Gltf broken = square();
  animate(broken, {{"translation", "LINEAR", {1, 0}, {0, 0, 0, 1, 0, 0}}});
  EXPECT_TRUE(contains(message_of([&] { load(broken, 1); }),
                       "animation 'walk', node 1: has 6 numbers for 2 keys, or times "
                       "that do not increase"));
}

/// The picture is darker in blue from left to right; the second set turns it around, the third holds one texel.
TEST_F(GltfMotion, TexturesHaveSetsOfCoordinatesOfTheirOwn) {
  Gltf file =
      square({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0}}},
              {"emissiveFactor", {1, 1, 1}},
              {"emissiveTexture",
               {{"index", 0}, {"extensions", {{"KHR_texture_transform", {{"texCoord", 1}, {"offset", {0, 0}}}}}}}}});
  file.add("images", {{"bufferView", file.add_view(test_support::png())}, {"mimeType", "image/png"}});
  file.add("samplers", {{"magFilter", 9728}});
  file.add("textures", {{"source", 0}, {"sampler", 0}});
  json& attributes = file.scene["meshes"][0]["primitives"][0]["attributes"];
  attributes["TEXCOORD_1"] = file.add_accessor<float>({1, 1, 0, 1, 1, 0, 0, 0}, kFloat, "VEC2", 2);
  const LoadedScene scene = load(file);
  EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
  for (const float x : {-0.9f, -0.3f, 0.3f, 0.9f}) {
    const SurfaceHit here = at(scene, x, 0.5f), there = at(scene, -x, 0.5f);
    const Spectrum shining = here.emitter->surface_radiance(here, {0, 0, 1}), painted = there.bsdf->albedo(there);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(shining[c], painted[c], 1e-4f) << x;
  }
}

/// dp/du is the tangent, dp/dv the normal times the tangent on its side.
TEST_F(GltfMotion, TangentsDirectNormalMaps) {
  for (const float side : {1.0f, -1.0f}) {
    Gltf file = square({{"normalTexture", {{"index", 0}}}});
    file.add("images", {{"bufferView", file.add_view(test_support::png())}, {"mimeType", "image/png"}});
    file.add("textures", {{"source", 0}});
    json& attributes = file.scene["meshes"][0]["primitives"][0]["attributes"];
    attributes["NORMAL"] = file.add_accessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, kFloat, "VEC3", 3);
    attributes["TANGENT"] =
        file.add_accessor<float>({0, 1, 0, side, 0, 1, 0, side, 0, 1, 0, side, 0, 1, 0, side}, kFloat, "VEC4", 4);
    for (const bool mirrored : {false, true}) {
      file.scene["nodes"][1]["scale"] = {mirrored ? -1 : 1, 1, 1};
      const SurfaceHit hit = at(load(file), 0.25f, 0.5f);
      const Vec3 u = normalize(hit.dp_du), v = normalize(hit.dp_dv);
      EXPECT_NEAR(u.y, 1, 1e-5f);
      EXPECT_NEAR(v.x, mirrored ? side : -side, 1e-5f);  // z x y = -x
    }
  }
}

/// A map that tilts normals towards increasing v reflects towards it, also where u is mirrored.
TEST_F(GltfMotion, NormalMapsFollowMirroredCoordinates) {
  for (const bool mirrored : {false, true}) {
    Gltf file = square({{"normalTexture", {{"index", 0}}}, {"pbrMetallicRoughness", {{"roughnessFactor", 0.3}}}});
    std::vector<unsigned char> texels;
    for (int i = 0; i < 4; ++i)
      for (const unsigned char value : {128, 191, 238}) texels.push_back(value);  // (0, 0.5, 0.87)
    const std::vector<unsigned char> bytes = encode_png(2, 2, texels);
    file.add("images", {{"bufferView", file.add_view({bytes.begin(), bytes.end()})}, {"mimeType", "image/png"}});
    file.add("textures", {{"source", 0}});
    json& attributes = file.scene["meshes"][0]["primitives"][0]["attributes"];
    if (mirrored) attributes["TEXCOORD_0"] = file.add_accessor<float>({1, 1, 0, 1, 1, 0, 0, 0}, kFloat, "VEC2", 2);
    const LoadedScene scene = load(file);
    const SurfaceHit hit = at(scene, 0.25f, 0.5f);
    Arena arena;
    const BsdfClosure* bsdf = hit.bsdf->bind(hit, true, TransportMode::kRadiance, arena);
    const auto towards = [&](float y) {  // mirrored about a normal tilted by 30 degrees in y
      return bsdf->eval(hit.frame.to_local({0, 0, 1}), hit.frame.to_local(normalize(Vec3{0, y, 0.5f}))).value.g;
    };
    EXPECT_GT(towards(0.866f), 0.5f) << mirrored;
    EXPECT_LT(towards(-0.866f), 0.1f) << mirrored;
  }
}

/// Without a map of its own, a coat has the normal of the mesh.
TEST_F(GltfMotion, CoatsHaveNormalsOfTheirOwn) {
  const auto reflected = [&](const json& coat, float y) {
    Gltf file = square({{"normalTexture", {{"index", 0}}},
                        {"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}, {"metallicFactor", 1}}},
                        {"extensions", {{"KHR_materials_clearcoat", coat}}}});
    std::vector<unsigned char> texels;
    for (int i = 0; i < 4; ++i)
      for (const unsigned char value : {128, 191, 238}) texels.push_back(value);
    const std::vector<unsigned char> bytes = encode_png(2, 2, texels);
    file.add("images", {{"bufferView", file.add_view({bytes.begin(), bytes.end()})}, {"mimeType", "image/png"}});
    file.add("textures", {{"source", 0}});
    const LoadedScene scene = load(file);
    const SurfaceHit hit = at(scene, 0.25f, 0.5f);
    Arena arena;
    return hit.bsdf->bind(hit, true, TransportMode::kRadiance, arena)
        ->eval(hit.frame.to_local({0, 0, 1}), hit.frame.to_local(normalize(Vec3{0, y, 0.5f})))
        .value.g;
  };
  const json flat = {{"clearcoatFactor", 1}, {"clearcoatRoughnessFactor", 0.3}};
  json tilted = flat;
  tilted["clearcoatNormalTexture"] = {{"index", 0}};
  EXPECT_GT(reflected(tilted, 0.866f), 5 * reflected(flat, 0.866f));
  EXPECT_GT(reflected(flat, 0), 5 * reflected(tilted, 0));
}

}  // namespace
}  // namespace covary::gltf_motion_test
