// SPDX-License-Identifier: Apache-2.0
// glTF scenes against the same scenes written by hand in Mitsuba XML: camera rays, hits, reflection and light. No
// statistics.
#include "gltf/gltf_reader.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/arena.h"
#include "core/random.h"
#include "io/convert_scene.h"
#include "io/load_scene.h"
#include "support/files.h"
#include "support/gltf_builder.h"
#include "support/same_scene.h"

namespace covary {
namespace {

using nlohmann::json;
using test_support::contains;
using test_support::Gltf;
using test_support::message_of;

class GltfReader : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.file(name), std::ios::binary) << text;
    return folder_.file(name);
  }
  LoadedScene load(const Gltf& file, const std::string& environment = "none") {
    LoadOptions options;
    options.view.environment = environment;
    return load_scene(write("scene.glb", file.glb()), options);
  }
  LoadedScene xml(const std::string& body) {
    return load_scene(write("scene.xml", "<scene version=\"3.0.0\">\n" + body + "\n</scene>\n"));
  }
  std::string errors(const Gltf& file) {
    return message_of([&] { load(file); });
  }

  test_support::TemporaryFolder folder_;
};

using test_support::picture;
using test_support::png;

const std::string kHead = R"(<integrator type="path"/>
<sensor type="perspective"><float name="fov" value="40.10704565915763"/><string name="fov_axis" value="y"/>
<float name="near_clip" value=".01"/>
<transform name="to_world"><lookat origin=".2, .1, 4" target=".2, .1, 3" up="0, 1, 0"/></transform>
<sampler type="independent"><integer name="sample_count" value="64"/></sampler>
<film type="hdrfilm"><integer name="width" value="1080"/><integer name="height" value="720"/></film></sensor>
)";
const std::string kSquare = R"(<shape type="ply"><string name="filename" value="square.ply"/>)";

std::string square_ply(bool normals) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
  if (normals) text += "property float nx\nproperty float ny\nproperty float nz\n";
  text += "property float u\nproperty float v\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
  const char *const p[] = {"-1 -1 0", "1 -1 0", "-1 1 0", "1 1 0"}, *const n[] = {"0 0 1", "0 0 1", ".3 0 1", "0 .2 1"},
                    *const uv[] = {"0 0", "1 0", "0 1", "1 1"};
  for (int i = 0; i < 4; ++i) text += fmt::format("{} {} {}\n", p[i], normals ? n[i] : "", uv[i]);
  return text + "3 1 2 0\n3 1 3 2\n";
}

// A textured square under two nodes, a square area light, and the three kinds of lights.
TEST_F(GltfReader, IsTheSceneByHand) {
  Gltf file;
  file.add_camera();
  file.add("images", {{"bufferView", file.add_view(png())}, {"mimeType", "image/png"}});
  file.add("textures", {{"source", 0}});
  file.scene["extensionsUsed"] = {"KHR_lights_punctual", "KHR_materials_emissive_strength"};
  const int wood = file.add(
      "materials", {{"name", "wood"},
                    {"pbrMetallicRoughness",
                     {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0.25}, {"roughnessFactor", 0.6}}}});
  const int lamp =
      file.add("materials", {{"emissiveFactor", {1, 0.5, 0.25}},
                             {"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}}},
                             {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 8}}}}}});
  const int square = file.add_square(wood), shining = file.add_square(lamp);
  const int child = file.add("nodes", {{"mesh", square}, {"rotation", {0, 0.3826834, 0, 0.9238795}}});
  file.add_root({{"children", {child}}, {"translation", {0.1, 0.2, -0.3}}, {"scale", {1.2, 1.2, 1.2}}});
  file.add_root({{"mesh", shining}, {"matrix", {0.3, 0, 0, 0, 0, 0.3, 0, 0, 0, 0, 0.3, 0, 0.9, 0.8, 0.5, 1}}});
  file.scene["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"color", {1, 0.8, 0.6}}, {"intensity", 20}},
      {{"type", "directional"}, {"intensity", 3}},
      {{"type", "spot"}, {"intensity", 30}, {"spot", {{"innerConeAngle", 0.2}, {"outerConeAngle", 0.5}}}}};
  for (int i = 0; i < 3; ++i)
    file.add_root({{"translation", {0, 2, 1}},
                   {"rotation", {-0.3826834, 0, 0, 0.9238795}},
                   {"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
  const LoadedScene a = load(file);
  EXPECT_TRUE(a.warnings.empty()) << a.warnings[0];

  write("picture.png", png());
  write("square.ply", square_ply(false));
  const LoadedScene b = xml(kHead + kSquare + R"(
<boolean name="face_normals" value="true"/><transform name="to_world"><rotate y="1" angle="45"/><scale value="1.2"/>
<translate x=".1" y=".2" z="-.3"/></transform>
<bsdf type="twosided"><bsdf type="metallicroughness"><texture type="bitmap" name="base_color">
<string name="filename" value="picture.png"/>
<transform name="to_uv"><scale y="-1"/><translate y="1"/></transform></texture>
<float name="metallic" value=".25"/><float name="roughness" value=".6"/></bsdf></bsdf></shape>)" +
                            kSquare + R"(
<boolean name="face_normals" value="true"/><transform name="to_world"><scale value=".3"/>
<translate x=".9" y=".8" z=".5"/></transform>
<emitter type="area"><rgb name="radiance" value="8, 4, 2"/></emitter>
<bsdf type="twosided"><bsdf type="metallicroughness"><rgb name="base_color" value="0"/>
<float name="metallic" value="1"/>
<float name="roughness" value="1"/></bsdf></bsdf></shape>
<emitter type="point"><point name="position" x="0" y="2" z="1"/><rgb name="intensity" value="20, 16, 12"/></emitter>
<emitter type="directional"><vector name="direction" x="0" y="-1" z="-1"/><rgb name="irradiance" value="3"/></emitter>
<emitter type="spot"><rgb name="intensity" value="30"/><float name="cutoff_angle" value="28.6478897565"/>
<string name="falloff" value="squared"/>
<float name="beam_width" value="11.4591559026"/><transform name="to_world">
<lookat origin="0, 2, 1" target="0, 1, 0" up="0, 1, 0"/></transform></emitter>)");
  test_support::expect_same_scene(a, b, 100);
}

TEST_F(GltfReader, MaterialsAreThoseByHand) {
  Gltf file;
  file.add_camera();
  const int view = file.add_view(png());
  file.add("images", {{"bufferView", view}, {"mimeType", "image/png"}});
  file.add("samplers", {{"magFilter", 9728}, {"wrapS", 33071}, {"wrapT", 33071}});
  file.add("textures", {{"source", 0}, {"sampler", 0}});
  file.scene["extensionsUsed"] = {"KHR_texture_transform", "KHR_materials_clearcoat"};
  const int material = file.add(
      "materials",
      {{"alphaMode", "MASK"},
       {"extensions", {{"KHR_materials_clearcoat", {{"clearcoatFactor", 0.5}, {"clearcoatRoughnessFactor", 0.25}}}}},
       {"normalTexture", {{"index", 0}}},
       {"pbrMetallicRoughness",
        {{"baseColorFactor", {0.5, 0.25, 1, 0.75}},
         {"baseColorTexture",
          {{"index", 0},
           {"extensions",
            {{"KHR_texture_transform", {{"offset", {0.25, 0.5}}, {"scale", {0.5, 0.25}}, {"rotation", 0.3}}}}}}},
         {"metallicRoughnessTexture", {{"index", 0}}},
         {"roughnessFactor", 0.5}}}});
  file.add_root({{"mesh", file.add_square(material, true)}});
  const LoadedScene a = load(file, "white");

  write("square.ply", square_ply(true));
  write("picture.png", png());
  // The image's channels as separate textures; roughness with its factor.
  std::string rough = "Pf\n4 2\n-1.0\n", metal = "P5\n4 2\n255\n";
  const std::string rgb = picture();
  for (const int row : {1, 0})
    for (int x = 0; x < 4; ++x) {
      const float value = static_cast<float>(static_cast<uint8_t>(rgb[3 * (4 * row + x) + 1])) / 255 * 0.5f;
      rough.append(reinterpret_cast<const char*>(&value), 4);
    }
  for (int i = 0; i < 8; ++i) metal += rgb[3 * i + 2];
  write("rough.pfm", rough), write("metal.pgm", metal);
  const std::string flip = "<scale y=\"-1\"/><translate y=\"1\"/>";
  const auto bitmap = [&](const char* name, const char* filename, bool raw, const std::string& to_uv) {
    return fmt::format(R"(<texture type="bitmap" name="{}"><string name="filename" value="{}"/>
<boolean name="raw" value="{}"/><string name="wrap_mode" value="clamp"/><string name="filter_type" value="nearest"/>
<transform name="to_uv">{}</transform></texture>)",
                       name, filename, raw, to_uv);
  };
  const std::string moved = flip + R"(<scale x=".5" y=".25"/><rotate z="1" angle="-17.188733853924695"/>
<translate x=".25" y=".5"/>)";
  const LoadedScene b = xml(kHead + kSquare + R"(<bsdf type="mask"><float name="opacity" value="1"/>
<bsdf type="twosided"><bsdf type="normalmap">)" +
                            bitmap("normalmap", "picture.png", true, flip) + R"(<bsdf type="metallicroughness">
<texture type="scale" name="base_color"><rgb name="scale" value=".5, .25, 1"/>)" +
                            bitmap("t", "picture.png", false, moved) + "</texture>" +
                            bitmap("roughness", "rough.pfm", true, flip) + bitmap("metallic", "metal.pgm", true, flip) +
                            R"(<float name="clearcoat" value=".5"/><float name="clearcoat_roughness" value=".25"/>
<rgb name="clearcoat_normal" value=".5, .5, 1"/>)" +
                            bitmap("base_normal", "picture.png", true, flip) +
                            R"(</bsdf></bsdf></bsdf></bsdf></shape><emitter type="constant"/>)");
  test_support::expect_same_scene(a, b, 100);
}

/// The extensions' parameters, from images and as factors.
TEST_F(GltfReader, ExtensionsOfMaterialsAreThoseByHand) {
  write("square.ply", square_ply(true));
  std::string red = "P5\n4 2\n255\n", green = red;
  const std::string rgb = picture();
  for (int i = 0; i < 8; ++i) red += rgb[3 * i], green += rgb[3 * i + 1];
  write("red.pgm", red), write("green.pgm", green), write("picture.png", png());
  const auto bitmap = [&](const char* name, const char* filename, bool raw) {
    return fmt::format(R"(<texture type="bitmap" name="{}"><string name="filename" value="{}"/>
<boolean name="raw" value="{}"/><transform name="to_uv"><scale y="-1"/><translate y="1"/></transform></texture>)",
                       name, filename, raw);
  };
  const auto expect = [&](const json& extensions, const std::string& expected) {
    Gltf file;
    file.add_camera();
    file.add("images", {{"bufferView", file.add_view(png())}, {"mimeType", "image/png"}});
    file.add("textures", {{"source", 0}});
    const int material = file.add(
        "materials", {{"extensions", extensions},
                      {"pbrMetallicRoughness",
                       {{"baseColorFactor", {0.5, 0.25, 1, 1}}, {"metallicFactor", 0.25}, {"roughnessFactor", 0.5}}}});
    file.add_root({{"mesh", file.add_square(material, true)}});
    const LoadedScene b = xml(kHead + kSquare + expected + "</shape><emitter type=\"constant\"/>");
    test_support::expect_same_scene(load(file, "white"), b, 100);
  };
  const std::string model = R"(<bsdf type="metallicroughness"><rgb name="base_color" value=".5, .25, 1"/>
<float name="metallic" value=".25"/><float name="roughness" value=".5"/>)";
  const json image = {{"index", 0}};
  expect({{"KHR_materials_specular", {{"specularFactor", 0.75}, {"specularColorFactor", {2, 1, 0.5}}}},
          {"KHR_materials_ior", {{"ior", 1.75}}}},
         "<bsdf type=\"twosided\">" + model + R"(<float name="ior" value="1.75"/><float name="specular" value=".75"/>
<rgb name="specular_color" value="2, 1, .5"/></bsdf></bsdf>)");
  expect({{"KHR_materials_specular", {{"specularColorTexture", image}}},
          {"KHR_materials_clearcoat",
           {{"clearcoatFactor", 1},
            {"clearcoatTexture", image},
            {"clearcoatRoughnessFactor", 1},
            {"clearcoatRoughnessTexture", image}}}},
         "<bsdf type=\"twosided\">" + model + bitmap("specular_color", "picture.png", false) +
             bitmap("clearcoat", "red.pgm", true) + bitmap("clearcoat_roughness", "green.pgm", true) +
             "</bsdf></bsdf>");
  expect({{"KHR_materials_transmission", {{"transmissionFactor", 1}, {"transmissionTexture", image}}}},
         model + bitmap("transmission", "red.pgm", true) + "</bsdf>");
  expect({{"KHR_materials_transmission", {{"transmissionFactor", 0.5}}},
          {"KHR_materials_volume", {{"thicknessFactor", 1}}}},
         model + R"(<float name="transmission" value=".5"/><boolean name="thin" value="false"/></bsdf>)");
}

/// A converted file is the same scene, with images in formats that Mitsuba reads.
TEST_F(GltfReader, CanBeConverted) {
  Gltf file;
  file.add_camera();
  file.add("images", {{"bufferView", file.add_view(png())}, {"mimeType", "image/png"}});
  file.add("textures", {{"source", 0}});
  file.add("materials", {{"normalTexture", {{"index", 0}}},
                         {"pbrMetallicRoughness",
                          {{"baseColorTexture", {{"index", 0}}}, {"metallicRoughnessTexture", {{"index", 0}}}}}});
  file.add_root({{"mesh", file.add_square(0, true)}});
  const LoadedScene a = load(file);
  const ConvertedScene converted = convert_scene(folder_.file("scene.glb"), folder_.file("out.xml"));
  write("out.xml", converted.document.xml);
  std::filesystem::create_directory(folder_.file("out-files"));
  std::map<std::string, int> kinds;
  for (const SceneDocumentFile& part : converted.document.files) {
    write(part.path, std::string(part.bytes));
    ++kinds[std::filesystem::path(part.path).extension().string()];
  }
  ASSERT_FALSE(converted.warnings.empty());
  EXPECT_TRUE(
      contains(converted.warnings.back(), "becomes the bsdf 'metallicroughness', which Mitsuba 3 does not have"));
  // The original image, shared by colours and normals; its green and its blue channel; the mesh.
  EXPECT_EQ(kinds, (std::map<std::string, int>{{".pfm", 2}, {".ply", 1}, {".png", 1}}));
  test_support::expect_same_scene(a, load_scene(folder_.file("out.xml")), 100);
}

TEST_F(GltfReader, MeshesThatAreUsedAgainAreInstances) {
  Gltf file;
  file.add_camera();
  const int material = file.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {0.2, 0.4, 0.6, 1}}}}});
  const int square = file.add_square(material);
  for (const double x : {-0.5, 0.5})
    file.add_root({{"mesh", square}, {"translation", {x, 0, x}}, {"scale", {0.4, 0.4, 0.4}}});
  // The same square as a strip and as a fan.
  const int p = file.add_accessor<float>({-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0}, 5126, "VEC3", 3);
  const int strip = file.add_accessor<uint8_t>({0, 1, 2, 3}, 5121, "SCALAR", 1);
  const int fan = file.add_accessor<uint32_t>({0, 1, 3, 2}, 5125, "SCALAR", 1);
  for (const auto& [mode, indices, x] : {std::tuple(5, strip, -0.5), std::tuple(6, fan, 0.5)})
    file.add_root(
        {{"mesh", file.add("meshes", {{"primitives",
                                       {{{"attributes", {{"POSITION", p}}}, {"indices", indices}, {"mode", mode}}}}})},
         {"translation", {x, 0.9, x}},
         {"scale", {0.4, 0.4, 0.4}}});
  const LoadedScene a = load(file);
  EXPECT_EQ(a.scene->n_triangles(), 4 * 2u);
  EXPECT_TRUE(a.warnings.empty());
  for (const float x : {-0.5f, 0.5f})
    for (const float y : {0.0f, 0.9f}) {
      SurfaceHit hit;
      ASSERT_TRUE(a.scene->intersect({{x + 0.3f, y - 0.2f, 3}, {0, 0, -1}}, hit)) << x << y;
      EXPECT_NEAR(hit.p.z, x, 1e-5f);
      EXPECT_NEAR(hit.ng.z, 1, 1e-5f);
    }
}

TEST_F(GltfReader, FilesWithoutCameraAreSeenFromTheFront) {
  Gltf file;
  file.add_root({{"mesh", file.add_square(-1)}, {"translation", {5, 6, 7}}});
  file.scene["meshes"][0]["primitives"][0].erase("material");
  const LoadedScene a = load(file);
  EXPECT_EQ(a.warnings.size(), 1u);
  SurfaceHit hit;
  ASSERT_TRUE(a.scene->intersect(a.scene->camera().ray({640, 360}, {}), hit));
  EXPECT_LT(length(hit.p - Vec3{5, 6, 7}), 1e-4f);
  int hits = 0;
  for (int i = 0; i < 100; ++i)
    hits += a.scene->intersect(a.scene->camera().ray({64.0f * (i % 10) + 350, 72.0f * (i / 10) + 36}, {}), hit);
  EXPECT_GT(hits, 20);
  EXPECT_LT(hits, 90);
}

TEST_F(GltfReader, JsonFilesNameTheirBuffersAndImages) {
  Gltf file;
  file.add_camera();
  file.add("images", {{"uri", "my%20picture.png"}});
  file.add("textures", {{"source", 0}});
  file.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  file.add_root({{"mesh", file.add_square(0)}});
  write("my picture.png", png());
  write("data.bin", file.buffer);
  json text = file.scene;
  text["buffers"] = {{{"byteLength", file.buffer.size()}, {"uri", "data.bin"}}};
  const LoadedScene a = load_scene(write("scene.gltf", text.dump()));
  EXPECT_EQ(a.files.size(), 2u);
  const std::string hash = a.content_hash;
  file.buffer[0] ^= 1;
  write("data.bin", file.buffer);
  EXPECT_NE(load_scene(folder_.file("scene.gltf")).content_hash, hash);
  std::filesystem::remove(folder_.file("data.bin"));
  EXPECT_TRUE(contains(message_of([&] { load_scene(folder_.file("scene.gltf")); }), "data.bin"));
}

TEST_F(GltfReader, WhatIsWrongIsNamed) {
  const auto with = [](const std::function<void(Gltf&)>& change) {
    Gltf file;
    file.add_camera();
    file.add("materials", json::object());
    file.add_root({{"mesh", file.add_square(0)}});
    change(file);
    return file;
  };
  const auto expect = [&](const std::function<void(Gltf&)>& change, const std::string& message) {
    EXPECT_TRUE(contains(errors(with(change)), message));
  };
  expect([](Gltf& f) { f.scene["extensionsRequired"] = f.scene["extensionsUsed"] = {"ABC_mesh_magic"}; },
         "needs the extension 'ABC_mesh_magic', which is not supported; export without it");
  expect([](Gltf& f) { f.scene["accessors"][0]["count"] = 1000000000; }, "with 1000000000 elements reaches beyond");
  expect([](Gltf& f) { f.scene["bufferViews"][0]["byteLength"] = 4000000; }, "reaches beyond its buffer");
  expect([](Gltf& f) { f.scene["meshes"][0]["primitives"][0]["indices"] = 99; },
         "primitive indices accessor out of bounds");
  expect([](Gltf& f) { f.scene["accessors"][2]["bufferView"] = 0; }, "; there are 4 vertices");
  expect([](Gltf& f) { f.scene["nodes"][1]["children"] = {1}; }, "is not there, or has several parents");
  expect([](Gltf& f) { f.scene["materials"][0]["normalTexture"]["index"] = 7; }, "there is no texture 7");
  expect([](Gltf& f) { f.scene["cameras"][0]["perspective"]["yfov"] = 0; }, "has a field of view of 0");
  expect([](Gltf& f) { f.scene["asset"]["version"] = "1.0"; }, "is of glTF 1.0; supported: 2.0");
  expect([](Gltf& f) { f.scene["asset"].clear(), f.scene["meshes"] = {{"a", 1}}; }, "is of glTF 1.0; supported: 2.0");
  expect([](Gltf& f) { f.scene["scenes"][0]["nodes"] = json::array(); }, "has neither a camera nor a mesh");
  EXPECT_TRUE(contains(message_of([&] { load_scene(write("a.glb", "glTF")); }), "is not a readable glTF file"));
  EXPECT_TRUE(contains(message_of([&] { load_scene(write("a.gltf", "{")); }), "is not a readable glTF file"));
  LoadOptions options;
  options.defines["a"] = "1";
  EXPECT_TRUE(contains(message_of([&] { load_scene(folder_.file("a.gltf"), options); }),
                       "scenes of glTF have no parameters to define"));
}

/// 2,000 files with a few bytes changed or truncated: each loads or is rejected with a message.
TEST_F(GltfReader, DamagedFilesDoNoHarm) {
  Gltf file;
  file.add_camera();
  file.add("images", {{"bufferView", file.add_view(png())}, {"mimeType", "image/png"}});
  file.add("textures", {{"source", 0}});
  file.add("materials", {{"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", 0}}}}}});
  file.add_root({{"mesh", file.add_square(0, true)}});
  const std::string whole = file.glb();
  int loaded = 0;
  for (int i = 0; i < 2000; ++i) {
    const PathRandom random(Sampling::kIndependent, 3, 0, 0, i);
    std::string bytes = whole;
    for (uint32_t k = 0; k < 1 + static_cast<uint32_t>(i % 3); ++k) {
      const Vec2 u = random.get_2d(k, Event::kDirection);
      const auto place = static_cast<size_t>(u.x * static_cast<float>(bytes.size()));
      if (i % 5 == 0)
        bytes.resize(place);
      else if (i % 5 == 1)
        bytes[place] = static_cast<char>(u.y * 256);
      else
        bytes[place] = "-0123456789\"]}e."[static_cast<size_t>(u.y * 16)];
      if (bytes.empty()) break;
    }
    try {
      load_scene_text(bytes, folder_.file("scene.glb"));
      ++loaded;
    } catch (const Error& error) {
      EXPECT_NE(error.code(), ErrorCode::kInternal) << error.what();
    }
  }
  EXPECT_GT(loaded, 150);
}

}  // namespace
}  // namespace covary
