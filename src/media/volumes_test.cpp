// SPDX-License-Identifier: Apache-2.0
// Volumes: interpolation between cells, wrap modes outside the grid, errors in files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>

#include "media/registry.h"
#include "media/volume_file.h"
#include "support/describe.h"
#include "support/files.h"
#include "support/volume_text.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::make_plugin;
using test_support::message_of;
using test_support::test_file;
using test_support::volume_text;

std::string write(const std::string& bytes) {
  const std::string path = test_file("grid.vol");
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

VolumePtr grid(const std::string& bytes, test_support::NamedValues values = {}) {
  values.push_back({"filename", write(bytes)});
  auto made = make_plugin<Volume>(volume_plugins(), "volume", "gridvolume", values);
  EXPECT_EQ(made.errors, "");
  return made.object;
}

// Two cells along x, one along y, three along z.
const std::string kGrey = volume_text(2, 1, 3, 1, {1, 2, 3, 4, 5, 6});

TEST(GridVolume, IsLinearBetweenTheCentresOfCells) {
  const VolumePtr volume = grid(kGrey);
  EXPECT_FLOAT_EQ(volume->eval({0.25f, 0.5f, 1 / 6.0f}).g, 1);
  EXPECT_FLOAT_EQ(volume->eval({0.75f, 0.1f, 1 / 6.0f}).g, 2);
  EXPECT_FLOAT_EQ(volume->eval({0.5f, 0.9f, 1 / 6.0f}).g, 1.5f);
  EXPECT_FLOAT_EQ(volume->eval({0.25f, 0.5f, 0.5f}).g, 3);
  EXPECT_FLOAT_EQ(volume->eval({0.5f, 0.5f, 1 / 3.0f}).g, 2.5f);
  EXPECT_EQ(volume->largest(), Spectrum(6));
  EXPECT_EQ(volume->smallest(), Spectrum(1));
  EXPECT_FALSE(volume->is_constant());
}

TEST(GridVolume, NearestTakesTheCell) {
  const VolumePtr volume = grid(kGrey, {{"filter_type", std::string("nearest")}});
  EXPECT_EQ(volume->eval({0.49f, 0.5f, 0.3f}).g, 1);
  EXPECT_EQ(volume->eval({0.51f, 0.5f, 0.3f}).g, 2);
  EXPECT_EQ(volume->eval({0.51f, 0.5f, 0.99f}).g, 6);
}

TEST(GridVolume, WrapModesSayWhatLiesOutside) {
  const auto at = [](const std::string& mode, float x) {
    return grid(kGrey, {{"filter_type", std::string("nearest")}, {"wrap_mode", mode}})->eval({x, 0.5f, 0.1f}).g;
  };
  EXPECT_EQ(at("clamp", -0.3f), 1);
  EXPECT_EQ(at("clamp", 1.7f), 2);
  EXPECT_EQ(at("repeat", -0.3f), 2);
  EXPECT_EQ(at("repeat", 1.3f), 1);
  EXPECT_EQ(at("mirror", -0.3f), 1);
  EXPECT_EQ(at("mirror", 1.3f), 2);
  EXPECT_EQ(at("mirror", 1.7f), 1);
  EXPECT_EQ(at("repeat", 1e30f), at("repeat", 1e30f));  // far away: some value, no undefined behaviour
}

TEST(GridVolume, ThreeChannelsAreColours) {
  const VolumePtr volume = grid(volume_text(1, 1, 2, 3, {1, 2, 3, 5, 1, 4}));
  EXPECT_EQ(volume->eval({0.5f, 0.5f, 0}), Spectrum(1, 2, 3));
  EXPECT_EQ(volume->eval({0.5f, 0.5f, 0.5f}), Spectrum(3, 1.5f, 3.5f));
  EXPECT_EQ(volume->largest(), Spectrum(5, 2, 4));
}

TEST(GridVolume, LiesWhereTheTransformAndTheFileSay) {
  const VolumePtr moved = grid(kGrey, {{"to_world", Transform::translate({10, 0, 0}) * Transform::scale({2, 1, 1})}});
  EXPECT_FLOAT_EQ(moved->eval({11.5f, 0.5f, 1 / 6.0f}).g, 2);
  EXPECT_EQ(moved->bounds().lower, Vec3(10, 0, 0));
  EXPECT_EQ(moved->bounds().upper, Vec3(12, 1, 1));
  const VolumePtr boxed = grid(kGrey, {{"use_grid_bbox", true}});  // volume_text() writes the box [-1, 1]³
  EXPECT_FLOAT_EQ(boxed->eval({-0.5f, 0, -2 / 3.0f}).g, 1);
  EXPECT_EQ(boxed->bounds().lower, Vec3(-1, -1, -1));
}

TEST(VolumeFile, EveryDefectIsNamed) {
  const auto message = [](const std::string& bytes) {
    return message_of([&] { read_volume_file(write(bytes)); }, ErrorCode::kInput);
  };
  const auto changed = [](size_t place, int value) {
    std::string bytes = kGrey;
    std::memcpy(bytes.data() + place, &value, place == 3 ? 1 : 4);
    return bytes;
  };
  EXPECT_TRUE(contains(message("VOX" + kGrey.substr(3)), "begins with 'VOL'"));
  EXPECT_TRUE(contains(message("VOL"), "a header of 48 bytes"));
  EXPECT_TRUE(contains(message(changed(3, 2)), "of version 2; expected 3"));
  EXPECT_TRUE(contains(message(changed(4, 2)), "encoding 2; expected 1"));
  EXPECT_TRUE(contains(message(changed(12, 0)), "has 0 cells along y"));
  EXPECT_TRUE(contains(message(changed(8, -5)), "has -5 cells along x"));
  EXPECT_TRUE(contains(message(changed(20, 6)), "has 6 channels; expected 1 or 3"));
  EXPECT_TRUE(contains(message(kGrey + "x"), "has 73 bytes; a grid of 2 x 1 x 3 cells with 1 channels has 72"));
  EXPECT_TRUE(contains(message(kGrey.substr(0, 71)), "has 71 bytes"));
  // The largest header: no allocation beyond the size of the file.
  std::string huge = kGrey;
  for (const size_t place : {8, 12, 16}) {
    const int most = 1 << 20;
    std::memcpy(huge.data() + place, &most, 4);
  }
  EXPECT_TRUE(contains(message(huge), "cells with 1 channels has"));
  EXPECT_TRUE(contains(message(volume_text(1, 1, 2, 1, {1, NAN})), "value 1 is not finite"));
  EXPECT_TRUE(contains(message_of([] { read_volume_file("/no/such.vol"); }, ErrorCode::kIo), "cannot be read"));
}

TEST(GridVolume, AnEmptyBoxIsAnError) {
  std::string flat = kGrey;
  std::memcpy(flat.data() + 36, flat.data() + 24, 4);
  const auto made = make_plugin<Volume>(volume_plugins(), "volume", "gridvolume",
                                        {{"filename", write(flat)}, {"use_grid_bbox", true}});
  EXPECT_TRUE(contains(made.errors, "asks for the box of the file, which is empty"));
}

}  // namespace
}  // namespace covary
