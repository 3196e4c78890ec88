// SPDX-License-Identifier: Apache-2.0
#include "plans/camera_path.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "core/error.h"
#include "plans/render.h"
#include "support/plans.h"

namespace covary {
namespace {

const char* const kTwoKeys = R"({"frames_per_second": 2, "keyframes": [
    {"time": 0, "to_world": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
    {"time": 2, "to_world": [[1, 0, 0, 8], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}]})";

std::string problem_of(const std::string& text) {
  try {
    parse_camera_path(text, "p.json");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInput);
    return error.what();
  }
  return "";
}

TEST(CameraPath, CountsFramesByTheirRate) {
  const CameraPath path = parse_camera_path(kTwoKeys, "p.json");
  EXPECT_EQ(path.at(0).matrix()[0][3], 0);
  EXPECT_DOUBLE_EQ(path.at(1 / path.frames_per_second()).matrix()[0][3], 2);
  EXPECT_EQ(path.at(4 / path.frames_per_second()).matrix()[0][3], 8);
}

TEST(CameraPath, SaysWhatIsWrongAndWhere) {
  const std::string file = "camera path 'p.json': ";
  EXPECT_EQ(problem_of("3"), file + "expected a JSON object");
  EXPECT_TRUE(problem_of("{").starts_with(file + "is no JSON: parse error at line 1, column 2: ")) << problem_of("{");
  EXPECT_EQ(problem_of("{}"), file + "the array 'keyframes' is missing");
  EXPECT_EQ(problem_of(R"({"keyframes": []})"), file + "there are no keyframes");
  EXPECT_EQ(problem_of(R"({"frames": []})"),
            file + "unknown member 'frames'; expected 'frames_per_second', 'keyframes'");
  EXPECT_EQ(problem_of(R"({"frames_per_second": 0, "keyframes": []})"), file + "'frames_per_second' is not above 0");
  EXPECT_EQ(problem_of(R"({"keyframes": [{"time": 0}]})"), file + "keyframe 0: 'to_world' is missing");
  EXPECT_EQ(problem_of(R"({"keyframes": [{"time": "0", "to_world": []}]})"),
            file + "keyframe 0: 'time' is not a number");
  for (const char* matrix : {"[]", "[[1], [1], [1], [1]]", "[1, 2, 3, 4]", "1"})
    EXPECT_EQ(problem_of(fmt::format(R"({{"keyframes": [{{"time": 0, "to_world": {}}}]}})", matrix)),
              file + "keyframe 0: 'to_world' is not a matrix: expected 4 rows of 4 numbers, or 16 numbers by rows");
  EXPECT_EQ(problem_of(std::string(100, '[')), file + "arrays and objects nest deeper than 64");
  EXPECT_THROW(read_camera_path("/nowhere/p.json"), Error);
}

std::string box_scene(const Matrix4& m) {
  std::string numbers;
  for (const auto& row : m)
    for (const double entry : row) numbers += fmt::format("{} ", entry);
  return fmt::format(R"(<scene version="3.0.0"><integrator type="path"/>
    <sensor type="perspective"><transform name="to_world"><matrix value="{}"/></transform>
      <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="12"/></film></sensor>
    <shape type="cube"><transform name="to_world"><translate z="4"/></transform></shape>
    <emitter type="constant"/></scene>)",
                     numbers);
}

Image picture_of(const LoadedScene& scene) {
  return render(scene, plain_plan(Sampling::kIndependent), request_of(4)).picture();
}

TEST(PlacedCamera, RendersAsASceneWithThatCamera) {
  LoadOptions options;
  options.make_integrator = integrator_maker({});
  const CameraPath path = parse_camera_path(R"({"keyframes": [
      {"time": 0, "to_world": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
      {"time": 3, "to_world": [0, 0, -1, 3, 0, 1, 0, 0.5, 1, 0, 0, 4, 0, 0, 0, 1]}]})",
                                            "p.json");
  LoadedScene moved = load_scene_text(box_scene(Transform().matrix()), "box.xml", options);
  const Image at_first = picture_of(moved);
  const std::string first_hash = moved.content_hash;
  const Transform there = path.at(1 / path.frames_per_second());
  place_camera(moved, there);
  EXPECT_NE(moved.content_hash, first_hash);
  const LoadedScene alone = load_scene_text(box_scene(there.matrix()), "box.xml", options);
  const Image picture = picture_of(moved);
  EXPECT_EQ(picture.data, picture_of(alone).data);
  EXPECT_NE(picture.data, at_first.data);
  place_camera(moved, path.at(0));
  EXPECT_EQ(picture_of(moved).data, at_first.data);
}

TEST(PlacedCamera, MayNotScale) {
  LoadedScene scene = load_scene_text(box_scene(Transform().matrix()), "box.xml", {});
  EXPECT_THROW(place_camera(scene, Transform::scale({2, 2, 2})), Error);
}

}  // namespace
}  // namespace covary
