// SPDX-License-Identifier: Apache-2.0
// Round trips through each format preserve pictures up to the format's precision.
#include "film/image_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/srgb.h"
#include "film/image_file.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of, test_support::test_file;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Values from -1 to 40, some of which need full float precision.
Image picture() {
  Image image(7, 5, 3);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = 0.4f * static_cast<float>(i) - 1 + 1e-5f;
  return image;
}

PlacedImage written(const std::string& name, const Image& image) {
  const std::string path = test_file(name);
  write_image(path, image, {7, 5, {0, 0, 7, 5}}, {{"covary:seed", "3"}});
  return read_image(path);
}

TEST(ImageWriter, WithoutAPlaceTheImageIsTheFrame) {
  for (const char* name : {"whole.exr", "whole.pfm"}) {
    write_image(test_file(name), picture(), {}, {});
    const PlacedImage read = read_image(test_file(name));
    EXPECT_EQ(read.place, (ImagePlace{7, 5, {0, 0, 7, 5}})) << name;
    EXPECT_EQ(read.image.data, picture().data) << name;
  }
}

TEST(ImageWriter, PngKeepsEveryCode) {
  Image image(256, 2, 3);
  for (int i = 0; i < 256; ++i)
    for (int c = 0; c < 3; ++c) image.pixel(i, 0)[c] = srgb_to_linear(static_cast<float>(i) / 255);
  image.pixel(0, 1)[0] = std::numeric_limits<float>::quiet_NaN();
  image.pixel(0, 1)[1] = -std::numeric_limits<float>::infinity();
  image.pixel(0, 1)[2] = std::numeric_limits<float>::infinity();
  const std::string path = test_file("image.png");
  write_png(path, image);
  const PlacedImage read = read_image(path);
  EXPECT_TRUE(read.low_dynamic_range);
  EXPECT_EQ(read.place, (ImagePlace{256, 2, {0, 0, 256, 2}}));
  for (int i = 0; i < 256; ++i) ASSERT_NEAR(read.image.rgb(i, 0).g, image.rgb(i, 0).g, 1e-6f) << i;
  EXPECT_EQ(read.image.rgb(0, 1), Spectrum(0, 0, 1));
}

TEST(ImageWriter, FloatFormatsKeepEveryBit) {
  for (const char* name : {"a.exr", "a.pfm", "a.tif", "a.TIFF"}) {
    const PlacedImage read = written(name, picture());
    EXPECT_FALSE(read.low_dynamic_range) << name;
    EXPECT_EQ(read.image.data, picture().data) << name;
  }
  EXPECT_EQ(inspect_image(test_file("a.exr")).attributes.at("covary:seed"), "3");
}

TEST(ImageWriter, ExrKeepsTheWindow) {
  const ImagePlace place{20, 10, {3, 4, 7, 5}};
  write_image(test_file("a.exr"), picture(), place, {});
  EXPECT_EQ(read_image(test_file("a.exr")).place, place);
}

/// A shared exponent, 8 bits for the largest channel; nothing negative, no infinity, no NaN.
TEST(ImageWriter, WritesExrByRowsWithTheBytesOfTheWhole) {
  Image image(5, 150, 3), alpha(5, 150, 1);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = 0.1f * static_cast<float>(i) + 1e-5f;
  for (size_t i = 0; i < alpha.data.size(); ++i) alpha.data[i] = 1 / static_cast<float>(1 + i % 7);
  const ImagePlace place{9, 160, {2, 4, 5, 150}};
  const std::map<std::string, std::string> attributes = {{"covary:seed", "3"}};
  for (const Image& a : {alpha, Image()}) {
    std::vector<int> asked;
    const auto rows = [&](int first, int n) {
      asked.push_back(first);
      const auto of = [&](const Image& all) {
        Image part(5, all.data.empty() ? 0 : n, all.channels);
        std::copy_n(all.data.begin() + static_cast<ptrdiff_t>(first) * 5 * all.channels, part.data.size(),
                    part.data.begin());
        return part;
      };
      return std::pair(of(image), a.data.empty() ? Image() : of(a));
    };
    write_image(test_file("whole.exr"), image, place, attributes, a);
    write_exr_rows(test_file("rows.exr"), place, attributes, rows);
    EXPECT_EQ(content(test_file("rows.exr")), content(test_file("whole.exr")));
    EXPECT_EQ(asked, (std::vector{0, 64, 128, 0, 64, 128}));
    EXPECT_EQ(read_image(test_file("rows.exr")).image.data, image.data);
  }
}

TEST(ImageWriter, HdrHoldsItsRange) {
  Image image = picture();
  image.pixel(2, 2)[0] = kNan;
  image.pixel(2, 2)[1] = -1000;
  image.pixel(3, 2)[0] = std::numeric_limits<float>::infinity();
  const Image read = written("a.hdr", image).image;
  for (int y = 0; y < 5; ++y)
    for (int x = 0; x < 7; ++x) {
      if (x == 3 && y == 2) continue;
      std::array<float, 3> expected{};
      for (int c = 0; c < 3; ++c) expected[c] = image.pixel(x, y)[c] > 0 ? image.pixel(x, y)[c] : 0;
      const float step = *std::max_element(expected.begin(), expected.end()) / 128;
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(read.pixel(x, y)[c], expected[c], step) << x << ", " << y << ", " << c;
    }
  EXPECT_GT(read.pixel(3, 2)[0], 1e30f);
  EXPECT_TRUE(std::isfinite(read.pixel(3, 2)[0]));
}

TEST(ImageWriter, JpegIsForTheEye) {
  Image image(16, 16, 3);
  for (float& value : image.data) value = 0.25f;
  const std::string path = test_file("a.jpg");
  write_image(path, image, {16, 16, {0, 0, 16, 16}}, {});
  const PlacedImage read = read_image(path);
  EXPECT_TRUE(read.low_dynamic_range);
  for (float value : read.image.data) EXPECT_NEAR(value, 0.25f, 0.01f);
}

TEST(ImageWriter, KnowsItsOwnPngs) {
  const std::string path = test_file("a.png");
  write_png(path, picture());
  EXPECT_TRUE(is_own_png(path));
  std::string bytes;
  {
    std::ifstream file(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(file), {});
  }
  const size_t keyword = bytes.find("Software"), value = bytes.find("covary", keyword);
  ASSERT_TRUE(keyword != std::string::npos && value != std::string::npos);
  bytes.replace(value, 6, "gimp 2");  // now its checksum is wrong, as after any damage
  std::ofstream(path, std::ios::binary) << bytes;
  EXPECT_FALSE(is_own_png(path));
  write_image(test_file("a.jpg"), picture(), {}, {});
  EXPECT_FALSE(is_own_png(test_file("a.jpg")));
  std::ofstream(test_file("text.png")) << "no picture";
  EXPECT_FALSE(is_own_png(test_file("text.png")));
  EXPECT_FALSE(is_own_png(test_file("missing.png")));
}

TEST(ImageWriter, SaysWhatItCannotWrite) {
  const Image wide(65501, 1, 3);
  EXPECT_TRUE(contains(message_of([&] { write_image(test_file("wide.jpg"), wide, {}, {}); }, ErrorCode::kIo),
                       "cannot write " + test_file("wide.jpg") + ": 65501 x 1 pixels; a JPEG holds up to 65500"));
  EXPECT_TRUE(contains(message_of([] { write_image("/nowhere/a.tif", picture(), {}, {}); }, ErrorCode::kIo),
                       "cannot write /nowhere/a.tif: no such folder /nowhere"));
  EXPECT_TRUE(
      contains(message_of([] { write_image("/nowhere/a.pfm", picture(), {}, {}); }, ErrorCode::kIo), "no such folder"));
}

}  // namespace
}  // namespace covary
