// SPDX-License-Identifier: Apache-2.0
// What other programs write into glTF files: values by the specification and its extensions. No statistics.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/arena.h"
#include "io/load_scene.h"
#include "scene/medium.h"
#include "support/files.h"
#include "support/gltf_builder.h"
#include "support/same_scene.h"

#if __has_include(<meshoptimizer.h>)
#include <meshoptimizer.h>
#endif
#if __has_include(<draco/compression/encode.h>)
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#endif
#if __has_include(<webp/encode.h>)
#include <webp/encode.h>
#endif

namespace covary::gltf_features_test {
namespace {

using nlohmann::json;
using test_support::contains;
using test_support::expect_same_scene;
using test_support::Gltf;
using test_support::message_of;

constexpr int kFloat = 5126, kByte = 5121, kShort = 5123;

class GltfFeatures : public ::testing::Test {
 protected:
  LoadedScene load(const Gltf& file) {
    std::ofstream(folder_.file("scene.glb"), std::ios::binary) << file.glb();
    return load_scene(folder_.file("scene.glb"));
  }
  static Gltf square(const json& material, bool normals = false) {
    Gltf file;
    file.add_camera();
    file.add("materials", material);
    file.add_root({{"mesh", file.add_square(0, normals)}});
    return file;
  }
  /// The hit at (x, y, z = anything) from the front, or from behind.
  static SurfaceHit at(const LoadedScene& scene, float x, float y, float from = 3) {
    SurfaceHit hit;
    EXPECT_TRUE(scene.scene->intersect({{x, y, from}, {0, 0, from > 0 ? -1.0f : 1.0f}}, hit)) << x << " " << y;
    return hit;
  }
  static Spectrum emitted(const SurfaceHit& hit, float z) {
    return hit.emitter ? hit.emitter->surface_radiance(hit, {0, 0, z}) : Spectrum(-1);
  }
  static void expect_colour(const Spectrum& found, const Spectrum& expected) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-4f) << c;
  }

  test_support::TemporaryFolder folder_;
};

TEST_F(GltfFeatures, ColoursOfVerticesMultiplyTheBaseColour) {
  Gltf file = square({{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 1, 1, 1}}}}});
  json& attributes = file.scene["meshes"][0]["primitives"][0]["attributes"];
  attributes["COLOR_0"] = file.add_accessor<float>({1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0}, kFloat, "VEC3", 3);
  const LoadedScene scene = load(file);
  EXPECT_TRUE(scene.warnings.empty());
  const auto albedo = [&](float x, float y) {
    const SurfaceHit hit = at(scene, x, y);
    return hit.bsdf->albedo(hit);
  };
  expect_colour(albedo(-0.9999f, -0.9999f), {0.5f, 0, 0});
  expect_colour(albedo(0.9999f, -0.9999f), {0, 1, 0});
  expect_colour(albedo(0.9999f, 0.9999f), {0.5f, 1, 0});
  expect_colour(albedo(0, -0.9999f), {0.25f, 0.5f, 0});  // interpolated
}

TEST_F(GltfFeatures, UnlitMaterialsShineAsTheyArePainted) {
  Gltf file = square({{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.2, 0.1, 1}}}},
                      {"extensions", {{"KHR_materials_unlit", json::object()}}}});
  const LoadedScene scene = load(file);
  for (const float side : {3.0f, -3.0f}) {
    const SurfaceHit hit = at(scene, 0.1f, 0.2f, side);
    expect_colour(emitted(hit, side / 3), {0.5f, 0.2f, 0.1f});
    EXPECT_EQ(hit.bsdf->albedo(hit), Spectrum(0));
  }
}

TEST_F(GltfFeatures, DoubleSidedMaterialsShineFromBothSides) {
  for (const bool both : {true, false}) {
    const LoadedScene scene = load(square({{"emissiveFactor", {1, 0.5, 0.25}}, {"doubleSided", both}}));
    EXPECT_TRUE(scene.warnings.empty());
    expect_colour(emitted(at(scene, 0, 0), 1), {1, 0.5f, 0.25f});
    expect_colour(emitted(at(scene, 0, 0, -3), -1), both ? Spectrum(1, 0.5f, 0.25f) : Spectrum(0));
    // Radiance times pi times 4 square units, on one or two sides.
    EXPECT_NEAR(scene.scene->emitters()[0]->power().r, (both ? 8 : 4) * kPi, 1e-4f);
  }
}

TEST_F(GltfFeatures, WhatIsTransparentShinesLess) {
  const LoadedScene scene = load(square({{"emissiveFactor", {1, 1, 1}},
                                         {"alphaMode", "BLEND"},
                                         {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.25}}}}}));
  expect_colour(emitted(at(scene, 0, 0), 1), Spectrum(0.25f));
}

TEST_F(GltfFeatures, SparseAccessorsReplaceSomeElements) {
  Gltf file = square(json::object());
  const int places = file.add_view(std::string("\x03", 1));
  const float corner[3] = {2, 1, 0};
  const int values = file.add_view(std::string(reinterpret_cast<const char*>(corner), sizeof corner));
  file.scene["accessors"][0]["sparse"] = {{"count", 1},
                                          {"indices", {{"bufferView", places}, {"componentType", kByte}}},
                                          {"values", {{"bufferView", values}}}};
  const LoadedScene scene = load(file);
  EXPECT_EQ(scene.scene->bounds().upper, Vec3(2, 1, 0));
  EXPECT_EQ(scene.scene->bounds().lower, Vec3(-1, -1, 0));
}

TEST_F(GltfFeatures, MorphTargetsHaveTheWeightsOfTheNodeOrMesh) {
  Gltf file = square(json::object());
  const int target = file.add_accessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 2, 1}, kFloat, "VEC3", 3);
  file.scene["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", target}}};
  file.scene["meshes"][0]["weights"] = {0.5};
  EXPECT_NEAR(at(load(file), -0.5f, -0.5f).p.z, 0.5, 1e-6);
  EXPECT_NEAR(load(file).scene->bounds().upper.y, 2, 1e-6);
  file.scene["nodes"][1]["weights"] = {-0.25};
  EXPECT_NEAR(at(load(file), -0.5f, -0.5f).p.z, -0.25, 1e-6);
}

/// A vertex is moved by the weighted mean of its joints' matrices times the inverse bind matrices; the node's own
/// transformation does not count.
TEST_F(GltfFeatures, SkinsAreAsTheJointsStand) {
  Gltf file = square(json::object(), true);
  json& attributes = file.scene["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] =
      file.add_accessor<uint8_t>({0, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0}, kByte, "VEC4", 4);
  attributes["WEIGHTS_0"] =
      file.add_accessor<float>({1, 0, 0, 0, 1, 0, 0, 0, 0.25, 0.75, 0, 0, 0.5, 0.5, 0, 0}, kFloat, "VEC4", 4);
  // Both joints were bound at (0, 0, 1); the first stands at (0, 0, 3), the second at (4, 0, 1).
  const std::vector<float> bind = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -1, 1};
  std::vector<float> both = bind;
  both.insert(both.end(), bind.begin(), bind.end());
  const int inverse = file.add_accessor<float>(both, kFloat, "MAT4", 16);
  file.add_root({{"translation", {0, 0, 3}}});
  file.add_root({{"translation", {4, 0, 1}}});
  file.add("skins", {{"joints", {2, 3}}, {"inverseBindMatrices", inverse}});
  file.scene["nodes"][1]["skin"] = 0;
  file.scene["nodes"][1]["translation"] = {100, 100, 100};
  const LoadedScene scene = load(file);
  // (-1,-1,0) + (0,0,2); (1,-1,0) + (4,0,0); (-1,1,0) + (3,0,0.5); (1,1,0) + (2,0,1).
  EXPECT_EQ(scene.scene->bounds().lower, Vec3(-1, -1, 0));
  EXPECT_EQ(scene.scene->bounds().upper, Vec3(5, 1, 2));
}

TEST_F(GltfFeatures, InstancesOfNodesAreCopies) {
  Gltf file = square(json::object());
  const int places = file.add_accessor<float>({0, 0, 0, 5, 0, 0, 0, 7, 0}, kFloat, "VEC3", 3);
  const int sizes = file.add_accessor<float>({1, 1, 1, 2, 2, 2, 1, 1, 1}, kFloat, "VEC3", 3);
  file.scene["extensionsRequired"] = file.scene["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  file.scene["nodes"][1]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", places},
                                                                                   {"SCALE", sizes}};
  file.scene["nodes"][1]["translation"] = {0, 0, -1};
  const LoadedScene scene = load(file);
  EXPECT_EQ(scene.scene->instances().size(), 3u);
  EXPECT_EQ(scene.scene->bounds().lower, Vec3(-1, -2, -1));
  EXPECT_EQ(scene.scene->bounds().upper, Vec3(7, 8, -1));
}

/// KHR_materials_volume: white light that has gone `attenuationDistance` through the medium has `attenuationColor`.
TEST_F(GltfFeatures, VolumesAbsorb) {
  const LoadedScene scene =
      load(square({{"extensions",
                    {{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
                     {"KHR_materials_volume",
                      {{"thicknessFactor", 1}, {"attenuationDistance", 2}, {"attenuationColor", {0.5, 0.25, 1}}}}}}}));
  const SurfaceHit hit = at(scene, 0, 0);
  const Medium* inside = hit.shape->medium_towards(hit.ng, -hit.ng);
  ASSERT_TRUE(inside);
  const Medium::Coefficients medium = inside->at({});
  expect_colour(
      {std::exp(-2 * medium.extinction.r), std::exp(-2 * medium.extinction.g), std::exp(-2 * medium.extinction.b)},
      {0.5f, 0.25f, 1});
  EXPECT_EQ(medium.scattering, Spectrum(0));
}

/// KHR_materials_pbrSpecularGlossiness: f0 is the specular colour, alpha (1 - glossiness)^2.
TEST_F(GltfFeatures, SpecularGlossinessIsADielectricOfThatReflectance) {
  Gltf file = square(
      {{"extensions",
        {{"KHR_materials_pbrSpecularGlossiness",
          {{"diffuseFactor", {0.4, 0.2, 0.1, 1}}, {"specularFactor", {0.3, 0.3, 0.3}}, {"glossinessFactor", 0.25}}}}}},
      true);
  file.scene["extensionsRequired"] = file.scene["extensionsUsed"] = {"KHR_materials_pbrSpecularGlossiness"};
  const LoadedScene scene = load(file);
  EXPECT_TRUE(scene.warnings.empty());
  const SurfaceHit hit = at(scene, -0.9999f, -0.9999f);  // its normal is (0, 0, 1)
  Arena arena;
  const Vec3 o = normalize({0.5f, 0, 1}), i = normalize({-0.3f, 0.4f, 1}), h = normalize(o + i);
  const Spectrum value = hit.bsdf->bind(hit, true, TransportMode::kRadiance, arena)
                             ->eval(hit.frame.to_local(o), hit.frame.to_local(i))
                             .value;
  const double f = 0.3 + 0.7 * std::pow(1 - dot(o, h), 5), a2 = std::pow(0.75, 4);
  const double d = a2 / (M_PI * std::pow(h.z * h.z * (a2 - 1) + 1, 2));
  const auto g = [&](double c) { return 2 * c / (c + std::sqrt(a2 + (1 - a2) * c * c)); };
  EXPECT_NEAR(value.r, (f * d * g(o.z) * g(i.z) / (4 * o.z * i.z) + (1 - f) * 0.4 / M_PI) * i.z, 2e-4);
  EXPECT_NEAR(value.r - value.b, (1 - f) * 0.3 / M_PI * i.z, 2e-4);
}

/// Emission below a twentieth of what white surroundings give, and unlit materials, light nothing: a studio does.
TEST_F(GltfFeatures, LightsThatHardlyMatterAreNotAlone) {
  const auto has_studio = [&](double radiance, double size, const json& extensions) {
    Gltf file = square(json::object());
    file.add("images", {{"bufferView", file.add_view(test_support::png())}, {"mimeType", "image/png"}});
    file.add("textures", {{"source", 0}});
    file.add("materials", {{"emissiveFactor", {radiance, radiance, radiance}},
                           {"emissiveTexture", {{"index", 0}}},
                           {"extensions", extensions}});
    file.add_root({{"mesh", file.add_square(1)}, {"scale", {size, size, size}}, {"translation", {0, 0, 1}}});
    std::ofstream(folder_.file("scene.glb"), std::ios::binary) << file.glb();
    LoadOptions options;
    options.view.environment = "auto";
    return load_scene(folder_.file("scene.glb"), options).scene->environment() != nullptr;
  };
  EXPECT_TRUE(has_studio(1, 0.05, json::object()));
  EXPECT_FALSE(has_studio(1, 1, json::object()));
  EXPECT_TRUE(has_studio(0, 1, {{"KHR_materials_unlit", json::object()}}));
}

TEST_F(GltfFeatures, CamerasHaveNames) {
  Gltf file = square(json::object());
  file.scene["cameras"][0]["name"] = "front";
  const int second = file.add("cameras", {{"type", "orthographic"},
                                          {"orthographic", {{"xmag", 2}, {"ymag", 1}, {"znear", 0.1}, {"zfar", 10}}}});
  file.add_root({{"camera", second}, {"name", "side"}});
  std::ofstream(folder_.file("scene.glb"), std::ios::binary) << file.glb();
  const auto width = [&](const std::string& camera) {
    LoadOptions options;
    options.view.camera = camera;
    return load_scene(folder_.file("scene.glb"), options).width;
  };
  EXPECT_EQ(width(""), 1080);  // aspects of 1.5 and 2
  EXPECT_EQ(width("front"), 1080);
  EXPECT_EQ(width("side"), 1440);
  EXPECT_EQ(width("2"), 1440);
  EXPECT_TRUE(
      contains(message_of([&] { width("top"); }), "there is no camera 'top'; the scene has 1 'front', 2 'side'"));
}

TEST_F(GltfFeatures, WhatMovesIsReadPast) {
  Gltf file = square(json::object());
  file.scene["animations"] = {
      {{"channels", {{{"sampler", 0}, {"target", {{"path", "pointer"}}}}}}, {"samplers", {{{"a", 1}}}}}};
  file.scene["extensionsRequired"] = file.scene["extensionsUsed"] = {"KHR_animation_pointer", "KHR_materials_variants"};
  const LoadedScene scene = load(file);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_TRUE(contains(scene.warnings[0], "(KHR_animation_pointer) are not read"));
}

#if __has_include(<meshoptimizer.h>)
TEST_F(GltfFeatures, MeshesCompressedByMeshoptAreTheSame) {
  const json material = {{"pbrMetallicRoughness", {{"baseColorFactor", {0.2, 0.4, 0.6, 1}}}}};
  const LoadedScene plain = load(square(material));
  Gltf file = square(material);
  // Positions (buffer view 0) and indices (2) are replaced; the views' own buffer has no bytes.
  const auto compress = [&](int view, size_t count, size_t stride, const char* mode) {
    json& given = file.scene["bufferViews"][view];
    const char* from = file.buffer.data() + given["byteOffset"].get<size_t>();
    std::vector<unsigned char> bytes(1000);
    std::vector<unsigned int> indices;
    for (size_t i = 0; i < count; ++i) indices.push_back(stride == 2 ? static_cast<unsigned char>(from[2 * i]) : 0);
    bytes.resize(stride == 2 ? meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), indices.data(), count)
                             : meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), from, count, stride));
    ASSERT_GT(bytes.size(), 0u);
    const int packed = file.add_view({bytes.begin(), bytes.end()});
    const json& place = file.scene["bufferViews"][packed];
    file.scene["bufferViews"][view]["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0},
                                                                                {"byteOffset", place["byteOffset"]},
                                                                                {"byteLength", place["byteLength"]},
                                                                                {"count", count},
                                                                                {"byteStride", stride},
                                                                                {"mode", mode}};
    file.scene["bufferViews"][view]["byteOffset"] = 0;
  };
  compress(0, 4, 12, "ATTRIBUTES");
  compress(2, 6, 2, "TRIANGLES");
  file.scene["extensionsRequired"] = file.scene["extensionsUsed"] = {"EXT_meshopt_compression"};
  expect_same_scene(load(file), plain, 100);
  file.scene["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["mode"] = "MAGIC";
  EXPECT_TRUE(contains(message_of([&] { load(file); }), "in the mode 'MAGIC', which there is not"));
}
#endif

#if __has_include(<draco/compression/encode.h>)
TEST_F(GltfFeatures, MeshesCompressedByDracoAreTheSame) {
  const json material = {{"pbrMetallicRoughness", {{"baseColorFactor", {0.2, 0.4, 0.6, 1}}}}};
  const LoadedScene plain = load(square(material));
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(2);
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const float p[4][3] = {{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}};
  builder.SetAttributeValuesForFace(position, draco::FaceIndex(0), p[1], p[2], p[0]);
  builder.SetAttributeValuesForFace(position, draco::FaceIndex(1), p[1], p[3], p[2]);
  draco::Encoder encoder;
  draco::EncoderBuffer buffer;
  ASSERT_TRUE(encoder.EncodeMeshToBuffer(*builder.Finalize(), &buffer).ok());
  Gltf file = square(material);
  const int view = file.add_view({buffer.data(), buffer.size()});
  json& primitive = file.scene["meshes"][0]["primitives"][0];
  primitive["attributes"].erase("TEXCOORD_0");
  primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view}, {"attributes", {{"POSITION", 0}}}};
  for (const int accessor : {0, 2}) file.scene["accessors"][accessor].erase("bufferView");
  file.scene["extensionsRequired"] = file.scene["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  expect_same_scene(load(file), plain, 100);
  primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 9;
  EXPECT_TRUE(contains(message_of([&] { load(file); }), "is compressed by Draco without the attribute 9"));
}
#endif

#if __has_include(<webp/encode.h>)
TEST_F(GltfFeatures, PicturesMayBeWebp) {
  const std::string rgb = test_support::picture();
  uint8_t* bytes = nullptr;
  const size_t size = WebPEncodeLosslessRGB(reinterpret_cast<const uint8_t*>(rgb.data()), 4, 2, 12, &bytes);
  const std::string webp(reinterpret_cast<const char*>(bytes), size);
  WebPFree(bytes);
  const auto with = [&](const std::string& image, const char* type, const json& texture) {
    Gltf file = square({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
    file.add("images", {{"bufferView", file.add_view(image)}, {"mimeType", type}});
    file.add("textures", texture);
    return file;
  };
  const Gltf file = with(webp, "image/webp", {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}});
  const LoadedScene plain = load(with(test_support::png(), "image/png", {{"source", 0}}));
  expect_same_scene(load(file), plain, 100);
}
#endif

TEST_F(GltfFeatures, BasisUniversalIsNamed) {
  Gltf file = square({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  file.add("images", {{"bufferView", file.add_view("\xabKTX 20\xbb\r\n\x1a\n picture")}, {"mimeType", "image/ktx2"}});
  file.add("textures", {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}});
  EXPECT_TRUE(contains(message_of([&] { load(file); }), "not supported; 'gltf-transform ktxdecompress IN OUT'"));
}

}  // namespace
}  // namespace covary::gltf_features_test
