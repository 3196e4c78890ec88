// SPDX-License-Identifier: Apache-2.0
// Whole scenes from files: the objects created, and all errors reported at once.
#include "io/load_scene.h"

#include <gtest/gtest.h>

#include <fstream>

#include "support/describe.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::message_of;

const std::string kSensor = R"(<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0 0 5" target="0 0 0" up="0 1 0"/></transform>
<sampler type="independent"><integer name="sample_count" value="16"/></sampler>
<film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/><rfilter type="box"/>)"
                            R"(</film></sensor>)";

const std::string kTrianglePly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 1\n";

class LoadScene : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.file(name), std::ios::binary) << text;
  }
  LoadedScene load(const std::string& body, const LoadOptions& options = {}) {
    write("scene.xml", "<scene version=\"3.0.0\">\n" + body + "\n</scene>\n");
    return load_scene(folder_.file("scene.xml"), options);
  }
  /// The error text, without the folder's path.
  std::string errors(const std::string& body, const LoadOptions& options = {}) {
    std::string text = message_of([&] { load(body, options); });
    for (size_t i; (i = text.find(folder_.file(""))) != std::string::npos;) text.erase(i, folder_.file("").size());
    return text;
  }
  bool hits(const LoadedScene& scene, const Vec3& o, const Vec3& d) {
    hit_ = {};
    return scene.scene->intersect({o, d}, hit_);
  }

  test_support::TemporaryFolder folder_;
  SurfaceHit hit_;
};

TEST_F(LoadScene, ReadsSettingsOfTheSensor) {
  const LoadedScene s = load(kSensor + "<shape type=\"cube\"/><integrator type=\"path\"/>");
  EXPECT_EQ(s.width, 32);
  EXPECT_EQ(s.height, 24);
  EXPECT_EQ(s.crop_width, 32);
  EXPECT_EQ(s.crop_height, 24);
  EXPECT_EQ(s.spp, 16);
  EXPECT_EQ(s.filter.kind, FilterKind::kBox);
  EXPECT_EQ(s.integrator_type, "path");
  EXPECT_EQ(s.scene->camera().settings().fov_degrees, 40);
  EXPECT_EQ(s.content_hash.size(), 16u);
  EXPECT_TRUE(s.warnings.empty());
}

TEST_F(LoadScene, HasMitsubasDefaults) {
  const LoadedScene s = load("<sensor type=\"perspective\"/>");
  EXPECT_EQ(s.width, 768);
  EXPECT_EQ(s.height, 576);
  EXPECT_EQ(s.spp, 4);
  EXPECT_EQ(s.filter.kind, FilterKind::kGaussian);
  EXPECT_EQ(s.filter.stddev, 0.5f);
  EXPECT_EQ(s.filter.radius, 2.0f);
  EXPECT_EQ(s.integrator_type, "path");
  const CameraSettings& camera = s.scene->camera().settings();
  // A 50 mm lens on 36 x 24 mm film: 2 atan(43.267 / 100) over the diagonal.
  EXPECT_NEAR(camera.fov_degrees, 46.793f, 1e-3f);
  EXPECT_EQ(camera.fov_axis, FovAxis::kDiagonal);
  EXPECT_EQ(camera.near_clip, 0.01f);
  EXPECT_EQ(camera.far_clip, 10000.0f);
}

TEST_F(LoadScene, ReadsCropFilterAndThinLens) {
  const LoadedScene s = load(
      R"(<sensor type="thinlens"><float name="aperture_radius" value="0.5"/><float name="focus_distance" value="7"/>
<string name="focal_length" value="35mm"/><float name="near_clip" value="0.1"/><float name="far_clip" value="100"/>
<film type="hdrfilm"><integer name="width" value="100"/><integer name="height" value="50"/>)"
      R"(<integer name="crop_offset_x" value="10"/>
<integer name="crop_offset_y" value="20"/><integer name="crop_width" value="30"/>)"
      R"(<integer name="crop_height" value="25"/>
<string name="pixel_format" value="rgb"/><string name="file_format" value="openexr"/>)"
      R"(<string name="component_format" value="float16"/>
<boolean name="banner" value="false"/><boolean name="high_quality_edges" value="false"/>
<rfilter type="tent"><float name="radius" value="1.5"/></rfilter></film></sensor>)");
  EXPECT_EQ(s.crop_x, 10);
  EXPECT_EQ(s.crop_y, 20);
  EXPECT_EQ(s.crop_width, 30);
  EXPECT_EQ(s.crop_height, 25);
  EXPECT_EQ(s.filter.kind, FilterKind::kTent);
  EXPECT_EQ(s.filter.radius, 1.5f);
  EXPECT_EQ(s.scene->camera().settings().aperture_radius, 0.5f);
  EXPECT_EQ(s.scene->camera().settings().focus_distance, 7);
  EXPECT_EQ(s.scene->camera().settings().far_clip, 100);
}

TEST_F(LoadScene, OverridesTheFilmSizeAndDropsTheCrop) {
  LoadOptions options;
  options.width = 64, options.height = 16;
  const LoadedScene s = load(R"(<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="100"/>
<integer name="height" value="50"/><integer name="crop_offset_x" value="10"/><integer name="crop_width" value="30"/>)"
                             R"(</film></sensor>)",
                             options);
  EXPECT_EQ(s.width, 64);
  EXPECT_EQ(s.height, 16);
  EXPECT_EQ(s.crop_x, 0);
  EXPECT_EQ(s.crop_width, 64);
  EXPECT_EQ(s.scene->camera().width(), 64);
}

TEST_F(LoadScene, ReportsWrongSensors) {
  EXPECT_EQ(
      errors(R"(<sensor type="thinlens"><float name="fov" value="180"/>
<float name="near_clip" value="2"/><float name="far_clip" value="1"/>
<film type="hdrfilm"><integer name="width" value="0"/><integer name="crop_width" value="1000"/>
<string name="file_format" value="png"/><rfilter type="lanczo"/></film>
<film type="hdrfilm"/><sampler type="sobl"/></sensor>)"),
      "scene.xml:2:1: sensor 'thinlens': has 2 films; expected one\n"
      "scene.xml:2:1: sensor 'thinlens': near_clip is 2 and far_clip 1; expected 0 < near_clip < far_clip\n"
      "scene.xml:2:1: sensor 'thinlens': the float 'aperture_radius' is missing\n"
      "scene.xml:2:25: parameter 'fov' of sensor 'thinlens' is 180; it must lie in (0, 180)\n"
      "scene.xml:4:1: film 'hdrfilm': the crop window of 1000 x 576 pixels at (0, 0) leaves the film of 768 x 576\n"
      "scene.xml:4:22: parameter 'width' of film 'hdrfilm' is 0; it must lie in [1, 65536]\n"
      "scene.xml:5:1: parameter 'file_format' of film 'hdrfilm' is 'png'; expected one of 'openexr', 'exr', 'rgbe', "
      "'hdr', 'pfm'\n"
      "scene.xml:5:41: unknown rfilter 'lanczo'; did you mean 'lanczos'? Supported: 'box', 'catmullrom', 'gaussian', "
      "'lanczos', 'mitchell', 'tent'\n"
      "scene.xml:6:23: unknown sampler 'sobl'; did you mean 'sobol'? Supported: 'halton', 'hammersley', 'independent', "
      "'ldsampler', 'multijitter', 'orthogonal', 'sobol', 'stratified'");
  EXPECT_EQ(errors("<bsdf type=\"diffuse\" id=\"a\"/>"), "scene.xml:1:1: the scene has no sensor");
  EXPECT_TRUE(contains(
      errors(R"(<sensor type="perspective"><transform name="to_world"><scale value="2"/></transform></sensor>)"),
      "scene.xml:2:1: sensor 'perspective': the to_world transformation of a sensor must not scale"));
  EXPECT_EQ(errors("<sensor type=\"perspective\"><string name=\"focal_length\" value=\"long\"/></sensor>"),
            "scene.xml:2:28: parameter 'focal_length' of sensor 'perspective' 'long' is not a number; expected a "
            "length like '50mm'");
}

TEST_F(LoadScene, SaysWhatToUseInstead) {
  const std::string found = errors(R"(<sensor type="batch"><sensor type="perspective"/></sensor>
<shape type="merge"><shape type="cube"/></shape><emitter type="timed_sunsky"/>)");
  for (const char* message :
       {"scene.xml:2:1: sensor 'batch' is not supported: denoising would look across the edges of "
        "its pictures; render each of its sensors separately. Supported: 'orthographic'",
        "shape 'merge' is not supported: put the shapes that it holds in its place",
        "emitter 'timed_sunsky' is not supported: nothing moves; use 'sunsky'"})
    EXPECT_TRUE(contains(found, message));
}

TEST_F(LoadScene, UsesTheFirstOfSeveralSensors) {
  const LoadedScene s = load(kSensor + "\n<sensor type=\"perspective\"/>");
  EXPECT_EQ(s.width, 32);
  ASSERT_EQ(s.warnings.size(), 1u);
  EXPECT_TRUE(contains(s.warnings[0], "scene.xml:6:1: the scene has 2 cameras; the first is used"));
}

TEST_F(LoadScene, MakesTheIntegratorWithItsParameters) {
  struct Depth : SceneObject {
    int depth = 0;
  };
  LoadOptions options;
  options.make_integrator = [](Parameters& p) -> std::shared_ptr<SceneObject> {
    auto made = std::make_shared<Depth>();
    made->depth = p.get_int("max_depth", -1, -1, 100);
    return made;
  };
  const LoadedScene s =
      load(kSensor + "<integrator type=\"path\"><integer name=\"max_depth\" value=\"7\"/></integrator>", options);
  EXPECT_EQ(std::dynamic_pointer_cast<Depth>(s.integrator)->depth, 7);
  EXPECT_EQ(errors(kSensor + "\n<integrator type=\"path\"><integer name=\"maxdepth\" "
                             "value=\"7\"/></integrator>\n<integrator type=\"path\"/>",
                   options),
            "scene.xml:6:25: unknown parameter 'maxdepth' of integrator 'path'; did you mean 'max_depth'?\n"
            "scene.xml:7:1: a second integrator; the first is at scene.xml:6:1");
}

// ---- shapes ----

TEST_F(LoadScene, MakesEveryShape) {
  write("a.ply", kTrianglePly);
  write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const LoadedScene s = load(kSensor + R"(<shape type="ply"><string name="filename" value="a.ply"/></shape>
<shape type="obj"><string name="filename" value="a.obj"/></shape><shape type="rectangle"/><shape type="cube"/>
<shape type="sphere"><point name="center" x="0" y="0" z="9"/><float name="radius" value="2"/></shape>)"
                                       R"(<shape type="disk"/>
<shape type="cylinder"><point name="p1" x="0" y="0" z="4"/><float name="radius" value="0.5"/></shape>)");
  EXPECT_EQ(s.scene->n_shapes(), 7u);
  EXPECT_EQ(s.scene->n_triangles(), 1u + 1 + 2 + 12);
  ASSERT_EQ(s.warnings.size(), 1u);
  EXPECT_TRUE(contains(s.warnings[0], "left out 1 triangle of zero area in 1 mesh, the first in "));
  EXPECT_TRUE(contains(s.warnings[0], "scene.xml:5:"));
  ASSERT_TRUE(hits(s, {0.1f, 0.1f, 20}, {0, 0, -1}));
  EXPECT_NEAR(hit_.p.z, 9 + std::sqrt(4 - 0.02f), 1e-4f);
  EXPECT_NE(hit_.bsdf, nullptr);
}

TEST_F(LoadScene, RectangleHasMitsubasParametrisation) {
  const LoadedScene s = load(kSensor + "<shape type=\"rectangle\"/>");
  ASSERT_TRUE(hits(s, {0.5f, -0.4f, 3}, {0, 0, -1}));
  EXPECT_NEAR(hit_.uv.x, 0.75f, 1e-6f);
  EXPECT_NEAR(hit_.uv.y, 0.3f, 1e-6f);
  EXPECT_NEAR(hit_.frame.n.z, 1, 1e-6f);
  const LoadedScene flipped =
      load(kSensor + "<shape type=\"rectangle\"><boolean name=\"flip_normals\" value=\"true\"/></shape>");
  ASSERT_TRUE(hits(flipped, {0.5f, -0.4f, 3}, {0, 0, -1}));
  EXPECT_NEAR(hit_.uv.x, 0.75f, 1e-6f);
  EXPECT_NEAR(hit_.frame.n.z, -1, 1e-6f);
  EXPECT_NEAR(hit_.ng.z, -1, 1e-6f);
}

TEST_F(LoadScene, CubeHasMitsubasParametrisation) {
  const LoadedScene s = load(kSensor + "<shape type=\"cube\"/>");
  // Mitsuba 3.9.1: (u, v) where a ray towards the origin hits each face, offset by (0.5, 0.2) along the other two axes.
  struct Case {
    Vec3 o, d, n;
    Vec2 uv;
  };
  const Case cases[] = {{{5, 0.5f, 0.2f}, {-1, 0, 0}, {1, 0, 0}, {0.75f, 0.4f}},
                        {{-5, 0.5f, 0.2f}, {1, 0, 0}, {-1, 0, 0}, {0.75f, 0.6f}},
                        {{0.5f, 5, 0.2f}, {0, -1, 0}, {0, 1, 0}, {0.25f, 0.4f}},
                        {{0.5f, -5, 0.2f}, {0, 1, 0}, {0, -1, 0}, {0.6f, 0.75f}},
                        {{0.5f, 0.2f, 5}, {0, 0, -1}, {0, 0, 1}, {0.6f, 0.75f}},
                        {{0.5f, 0.2f, -5}, {0, 0, 1}, {0, 0, -1}, {0.4f, 0.75f}}};
  for (const Case& c : cases) {
    ASSERT_TRUE(hits(s, c.o, c.d));
    EXPECT_NEAR(dot(hit_.ng, c.n), 1, 1e-6f);
    EXPECT_NEAR(dot(hit_.frame.n, c.n), 1, 1e-6f);
    EXPECT_NEAR(hit_.uv.x, c.uv.x, 1e-5f) << c.n.x << c.n.y << c.n.z;
    EXPECT_NEAR(hit_.uv.y, c.uv.y, 1e-5f) << c.n.x << c.n.y << c.n.z;
  }
}

TEST_F(LoadScene, ReportsEveryProblemOfShapesAtOnce) {
  write("short.ply", kTrianglePly.substr(0, kTrianglePly.size() - 8));
  write("bad.obj", "v 0 0 0\nf 1 2 3\n");
  const std::string found = errors(kSensor + R"(
<shape type="pli"/>
<shape type="ply"><string name="filename" value="short.ply"/><float name="smooth" value="1"/></shape>
<shape type="obj"><string name="filename" value="bad.obj"/></shape>
<shape type="ply"/>
<shape type="obj"><string name="filename" value="bed.obj"/></shape>
<shape type="sphere"><float name="radius" value="0"/><bsdf type="difuse"/></shape>
<shape type="cube"><bsdf type="diffuse"/><bsdf type="diffuse"/><emitter type="point"/></shape>
<shape type="cube"><medium type="homogeneous"/></shape>
<emitter type="area"/>
<subsurface type="dipole"/>
<float name="gravity" value="9.81"/>)");
  const char* expected[] = {
      "scene.xml:6:1: unknown shape 'pli'; did you mean 'ply'? Supported: 'bsplinecurve', 'cube', 'cylinder', 'disk', "
      "'instance', 'linearcurve', 'obj', 'ply', "
      "'rectangle', 'sdfgrid', 'serialized', 'shapegroup', 'sphere'",
      "scene.xml:7:19: parameter 'filename' of shape 'ply' names 'short.ply': PLY: the file ends, or a number cannot "
      "be read, in "
      "face 1 of 2",
      "scene.xml:7:62: unknown parameter 'smooth' of shape 'ply'; known: 'exterior', 'face_normals', 'filename', "
      "'flip_normals', 'flip_tex_coords', 'interior', 'to_world'",
      "scene.xml:8:19: parameter 'filename' of shape 'obj' names 'bad.obj': OBJ: line 2: vertex 2 does not exist; "
      "there are 1",
      "scene.xml:9:1: shape 'ply': the string 'filename' is missing",
      "scene.xml:10:19: file 'bed.obj' not found in '",
      "'; did you mean 'bad.obj'?",
      "scene.xml:11:1: shape 'sphere': the radius is 0; it must be positive",
      "scene.xml:11:54: unknown bsdf 'difuse'; did you mean 'diffuse'? Supported: 'blendbsdf', 'bumpmap', ",
      "scene.xml:12:1: shape 'cube': has 2 bsdfs; expected one",
      "scene.xml:12:1: shape 'cube': only an emitter 'area' can be part of a shape",
      "scene.xml:13:20: shape 'cube' cannot hold medium 'homogeneous'",
      "scene.xml:14:1: emitter 'area' must stand inside the shape that emits, or have an id to which shapes refer",
      "scene.xml:15:1: unknown part <subsurface> of <scene>",
      "scene.xml:16:1: unknown parameter 'gravity' of <scene>",
  };
  size_t from = 0;  // in this order
  for (const char* message : expected) {
    const size_t at = found.find(message, from);
    EXPECT_NE(at, std::string::npos) << message << "\nnot in\n" << found.substr(from);
    if (at != std::string::npos) from = at;
  }
  EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 13);  // and no others
}

// ---- materials and lights ----

TEST_F(LoadScene, SharesReferencedMaterialsAndGivesShapesADefault) {
  const LoadedScene s = load(kSensor + R"(<bsdf type="diffuse" id="m"><rgb name="reflectance" value="0.2"/></bsdf>
<shape type="rectangle"><ref id="m"/></shape><shape type="rectangle"><ref id="m"/><transform name="to_world">)"
                                       R"(<translate x="10"/></transform></shape>
<shape type="rectangle"><transform name="to_world"><translate x="20"/></transform></shape>)");
  ASSERT_TRUE(hits(s, {0, 0, 3}, {0, 0, -1}));
  const Bsdf* first = hit_.bsdf;
  EXPECT_NEAR(first->albedo(hit_).r, 0.2f, 1e-6f);
  ASSERT_TRUE(hits(s, {10, 0, 3}, {0, 0, -1}));
  EXPECT_EQ(hit_.bsdf, first);
  ASSERT_TRUE(hits(s, {20, 0, 3}, {0, 0, -1}));
  EXPECT_NEAR(hit_.bsdf->albedo(hit_).g, 0.5f, 1e-6f);
}

TEST_F(LoadScene, ReportsMistakesOfEqualTexturesOnce) {
  EXPECT_EQ(errors(kSensor + R"(
<bsdf type="diffuse"><texture name="reflectance" type="checkerboard"><float name="size" value="3"/></texture></bsdf>
<bsdf type="diffuse"><texture name="reflectance" type="checkerboard"><float name="size" value="3"/></texture></bsdf>
<bsdf type="diffuse"><texture name="reflectance" type="checkerboard"><float name="size" value="4"/></texture></bsdf>)"),
            "scene.xml:6:70: unknown parameter 'size' of texture 'checkerboard'; known: 'color0', 'color1', "
            "'dimension', 'to_uv', 'to_world'\n"
            "scene.xml:8:70: unknown parameter 'size' of texture 'checkerboard'; known: 'color0', 'color1', "
            "'dimension', 'to_uv', 'to_world'");
}

TEST_F(LoadScene, GivesEveryEmittingShapeItsOwnLight) {
  const LoadedScene s = load(kSensor + R"(<emitter type="constant"/>
<shape type="rectangle"><emitter type="area" id="l"><rgb name="radiance" value="1 2 3"/></emitter></shape>
<emitter type="point"/>
<shape type="rectangle"><transform name="to_world"><translate x="10"/></transform><ref id="l"/></shape>)");
  ASSERT_EQ(s.scene->emitters().size(), 4u);  // in file order
  EXPECT_TRUE(s.scene->emitters()[0]->is_environment());
  EXPECT_TRUE(s.scene->emitters()[2]->is_delta());
  ASSERT_TRUE(hits(s, {0, 0, 3}, {0, 0, -1}));
  const Emitter* first = hit_.emitter;
  EXPECT_EQ(first, s.scene->emitters()[1].get());
  EXPECT_EQ(first->surface_radiance(hit_, {0, 0, 1}), Spectrum(1, 2, 3));
  ASSERT_TRUE(hits(s, {10, 0, 3}, {0, 0, -1}));
  EXPECT_EQ(hit_.emitter, s.scene->emitters()[3].get());
  EXPECT_NE(hit_.emitter, first);
}

TEST_F(LoadScene, ReportsASecondEnvironment) {
  EXPECT_EQ(errors(kSensor + "\n<emitter type=\"constant\"/>\n<emitter type=\"constant\"/>"),
            "scene.xml:7:1: a second emitter at infinity; the first is at scene.xml:6:1");
}

// ---- instances ----

TEST_F(LoadScene, PlacesInstances) {
  const LoadedScene s =
      load(kSensor +
           R"(<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="10"/></transform></shape>
<shape type="shapegroup" id="g"><shape type="rectangle"><bsdf type="diffuse"><rgb name="reflectance" value="0.3"/>)"
           R"(</bsdf></shape>
<shape type="sphere"><point name="center" x="0" y="0" z="-5"/></shape></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="20"/></transform></shape>)");
  EXPECT_FALSE(hits(s, {0, 0, 3}, {0, 0, -1}));  // the group itself is not in the scene
  ASSERT_TRUE(hits(s, {10, 0, 3}, {0, 0, -1}));
  EXPECT_NEAR(hit_.bsdf->albedo(hit_).r, 0.3f, 1e-6f);
  ASSERT_TRUE(hits(s, {20, 0, -20}, {0, 0, 1}));
  EXPECT_NEAR(hit_.p.z, -6, 1e-4f);
}

TEST_F(LoadScene, ReportsWrongInstances) {
  EXPECT_EQ(errors(kSensor + R"(
<shape type="instance"/>
<shape type="instance"><shape type="cube"/></shape>
<shape type="shapegroup"/>
<shape type="shapegroup"><bsdf type="diffuse"/><shape type="cube"/></shape>)"),
            "scene.xml:6:1: shape 'instance': refers to 0 shapegroups; expected one\n"
            "scene.xml:7:1: shape 'instance': must refer to a shapegroup\n"
            "scene.xml:8:1: shape 'shapegroup': holds no shape\n"
            "scene.xml:9:26: a shapegroup can hold shapes only");
}

// ---- files ----

TEST_F(LoadScene, HashFollowsEveryFile) {
  write("a.ply", kTrianglePly);
  const std::string body = kSensor + "<shape type=\"ply\"><string name=\"filename\" value=\"a.ply\"/></shape>";
  const std::string hash = load(body).content_hash;
  EXPECT_EQ(load(body).content_hash, hash);
  write("a.ply", kTrianglePly + " ");
  EXPECT_NE(load(body).content_hash, hash);
  write("a.ply", kTrianglePly);
  EXPECT_EQ(load(body).content_hash, hash);
  EXPECT_NE(load(body + " ").content_hash, hash);
}

TEST_F(LoadScene, ReportsFilesThatCannotBeRead) {
  EXPECT_EQ(message_of([&] { load_scene(folder_.file("none.xml")); }),
            "cannot read '" + folder_.file("none.xml") + "': No such file or directory");
  EXPECT_EQ(message_of([&] { load_scene(folder_.file("")); }),
            "cannot read '" + folder_.file("") + "': not a regular file");
  std::filesystem::create_directory(folder_.file("sub"));
  EXPECT_TRUE(contains(errors(kSensor + "<shape type=\"ply\"><string name=\"filename\" value=\"sub\"/></shape>"),
                       "'sub' is a folder; expected a regular file"));
  write("tri.obj", "v 0 0 0\nf 1 1 1\n");
  EXPECT_EQ(message_of([&] { load_scene(folder_.file("tri.obj")); }),
            folder_.file("tri.obj") +
                ": not a scene that covary reads, which are Mitsuba XML, pbrt or glTF (.xml, .pbrt, "
                ".glb, .gltf); export it as one of them, e.g. as .glb");
  write("empty.xml", "");
  EXPECT_TRUE(contains(message_of([&] { load_scene(folder_.file("empty.xml")); }), "empty.xml:1:1: malformed XML: "));
}

}  // namespace
}  // namespace covary
