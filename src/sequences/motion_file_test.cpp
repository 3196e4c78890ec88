// SPDX-License-Identifier: Apache-2.0
#include "sequences/motion_file.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "film/exr.h"
#include "support/files.h"

namespace covary {
namespace {

constexpr int kWidth = 24, kHeight = 16;

class MotionFile : public testing::Test {
 protected:
  /// Path of a file with constant channels.
  std::string file(const std::vector<std::pair<std::string, float>>& channels) {
    const std::string path = folder_.file("f.exr");
    std::vector<Image> images;
    std::vector<ExrPlane> planes;
    for (const auto& [name, value] : channels) {
      images.emplace_back(kWidth, kHeight, 1);
      std::fill(images.back().data.begin(), images.back().data.end(), value);
    }
    for (size_t i = 0; i < channels.size(); ++i)
      planes.push_back({channels[i].first, ExrPlane::Type::kFloat, images[i].data.data(), sizeof(float)});
    write_exr(path, {kWidth, kHeight, {0, 0, kWidth, kHeight}}, {}, planes);
    return path;
  }
  test_support::TemporaryFolder folder_;
};

TEST_F(MotionFile, OfCovaryHasDepthAndItsChange) {
  const MotionLayers layers =
      read_motion(file({{"Motion.X", 2}, {"Motion.Y", -1}, {"Motion.Z", 0.5f}, {"Depth", 7}, {"R", 1}}), {});
  EXPECT_TRUE(layers.knows_depth);
  EXPECT_EQ(layers.motion.pixel(5, 5)[0], 2);
  EXPECT_EQ(layers.motion.pixel(5, 5)[1], -1);
  EXPECT_EQ(layers.motion.pixel(5, 5)[2], 0.5f);
  EXPECT_EQ(*layers.depth.pixel(5, 5), 7);
}

TEST_F(MotionFile, OfOthersIsScaled) {
  const MotionLayers layers =
      read_motion(file({{"View.Vector.X", 2}, {"View.Vector.Y", 3}, {"View.Vector.Z", 9}, {"View.Depth.Z", 4}}),
                  {"View.Vector", "View.Depth", 1, -1});
  EXPECT_FALSE(layers.knows_depth);
  EXPECT_EQ(layers.motion.pixel(0, 0)[0], 2);
  EXPECT_EQ(layers.motion.pixel(0, 0)[1], -3);
  EXPECT_EQ(layers.motion.pixel(0, 0)[2], 0) << "motion to the next frame, not depth";
  EXPECT_EQ(*layers.depth.pixel(0, 0), 4);
  const MotionLayers flat = read_motion(file({{"flow.U", 2}, {"flow.V", 3}}), {"flow", "Depth", -1, 1});
  EXPECT_EQ(flat.motion.pixel(0, 0)[0], -2);
  EXPECT_EQ(*flat.depth.pixel(0, 0), 0);
}

TEST_F(MotionFile, OfBlenderIsFoundAndTurned) {
  const MotionLayers layers = read_motion(file({{"ViewLayer.Vector.X", 2},
                                                {"ViewLayer.Vector.Y", 3},
                                                {"ViewLayer.Vector.Z", 8},
                                                {"ViewLayer.Vector.W", 9},
                                                {"ViewLayer.Depth.Z", 4}}),
                                          {});
  EXPECT_EQ(layers.motion.pixel(0, 0)[0], 2);
  EXPECT_EQ(layers.motion.pixel(0, 0)[1], -3) << "Y is up there";
  EXPECT_EQ(layers.motion.pixel(0, 0)[2], 0);
  EXPECT_EQ(*layers.depth.pixel(0, 0), 4);
  EXPECT_FALSE(layers.knows_depth);
  const std::string two = file({{"A.Vector.X", 2}, {"A.Vector.Y", 3}, {"B.Vector.X", 2}, {"B.Vector.Y", 3}});
  EXPECT_FALSE(has_motion(two, {"Vector", "Depth", 1, 1})) << "which of both?";
  EXPECT_TRUE(has_motion(two, {"B.Vector", "Depth", 1, 1}));
}

TEST_F(MotionFile, WithoutMotionIsAnError) {
  try {
    read_motion(file({{"R", 1}, {"Vector.X", 2}}), {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInput);
    EXPECT_NE(std::string(error.what()).find("no layer 'Motion' of motion; it has the channels R, Vector.X"),
              std::string::npos);
  }
}

Image waves(float dx, float dy) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] = 2 + std::sin(0.5f * (static_cast<float>(x) + dx)) + std::cos(0.4f * (y + dy));
  return image;
}

TEST_F(MotionFile, FitsOrNot) {
  const auto moving = [&](float x, float y) { return read_motion(file({{"Motion.X", x}, {"Motion.Y", y}}), {}); };
  const auto misfit = [&](const Image& before, const Image& now, float x, float y) {
    const MotionLayers motion = moving(x, y);
    return misfits(before, now, {&motion, 1})[0];
  };
  EXPECT_LT(misfit(waves(0, 0), waves(2, 1), 2, 1), 0.1);
  EXPECT_GT(misfit(waves(0, 0), waves(2, 1), -2, -1), 1.2);
  EXPECT_GT(misfit(waves(0, 0), waves(2, 1), 2, -1), 0.3);
  EXPECT_EQ(misfit(waves(0, 0), waves(0, 0), 0, 0), 1);
}

TEST_F(MotionFile, FitsAreOfTheSamePixels) {
  // On the left, where only motion to the right is known, nothing fits; elsewhere to the left does.
  const auto moving = [&](float x) { return read_motion(file({{"Motion.X", x}, {"Motion.Y", 0}}), {}); };
  Image now = waves(2, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int c = 0; c < 3; ++c) now.pixel(kWidth - 1, y)[c] = now.pixel(kWidth - 2, y)[c] = 50;
  const std::vector<MotionLayers> both = {moving(2), moving(-2)};
  EXPECT_LT(misfits(waves(0, 0), now, both)[0], 0.1);
  EXPECT_EQ(misfits(waves(0, 0), now, std::vector{moving(static_cast<float>(kWidth))})[0], 1) << "no pixel is known";
}

}  // namespace
}  // namespace covary
