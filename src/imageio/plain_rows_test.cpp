// SPDX-License-Identifier: Apache-2.0
// PNG, JPEG and HDR textures are read to the same bits as by OpenImageIO.
#include "imageio/plain_rows.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "imageio/png.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::message_of;
using test_support::TemporaryFolder;

constexpr int kWidth = 19, kHeight = 11;

std::vector<uint8_t> noise(size_t n) {
  std::vector<uint8_t> values(n);
  uint32_t state = 1;
  for (uint8_t& value : values) value = static_cast<uint8_t>((state = state * 1664525 + 1013904223) >> 24);
  return values;
}

void expect_same(const ImageReader& a, const ImageReader& b) {
  EXPECT_EQ(a.header().format, b.header().format);
  EXPECT_EQ(a.header().width, b.header().width);
  EXPECT_EQ(a.header().height, b.header().height);
  EXPECT_EQ(a.header().frame_width, b.header().frame_width);
  EXPECT_EQ(a.header().frame_height, b.header().frame_height);
  EXPECT_EQ(a.header().type, b.header().type);
  EXPECT_EQ(a.header().floating_point, b.header().floating_point);
  EXPECT_EQ(a.header().channels, b.header().channels);
  EXPECT_EQ(a.header().alpha_channel, b.header().alpha_channel);
}

void expect_same_as_openimageio(ImageReader* plain, const std::string& path) {
  ASSERT_TRUE(plain);
  const auto other = open_image(path);
  expect_same(*plain, *other);
  const int n_channels = static_cast<int>(other->header().channels.size());
  EXPECT_EQ(plain->read_floats(0, n_channels), other->read_floats(0, n_channels));
  EXPECT_EQ(plain->read_floats(n_channels - 1, n_channels), other->read_floats(n_channels - 1, n_channels));
  if (other->header().type == "uint8")
    EXPECT_EQ(plain->read_bytes(0, n_channels), other->read_bytes(0, n_channels));
  else
    EXPECT_THROW(plain->read_bytes(0, n_channels), Error);
}

TEST(PlainRows, PngIsWhatOpenImageIoReads) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.png");
  const uint32_t linear = PNG_FORMAT_FLAG_LINEAR;  // 16 bits
  for (const uint32_t format :
       std::initializer_list<uint32_t>{PNG_FORMAT_GRAY, PNG_FORMAT_GA, PNG_FORMAT_RGB, PNG_FORMAT_RGBA, linear,
                                       linear | PNG_FORMAT_GA, linear | PNG_FORMAT_RGB, linear | PNG_FORMAT_RGBA}) {
    SCOPED_TRACE(format);
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = kWidth, image.height = kHeight, image.format = format;
    const std::vector<uint8_t> values = noise(PNG_IMAGE_SIZE(image));
    ASSERT_TRUE(png_image_write_to_file(&image, path.c_str(), 0, values.data(), 0, nullptr)) << image.message;
    expect_same_as_openimageio(open_plain_png(path).get(), path);
  }
}

TEST(PlainRows, PalettesOfFewBitsAreColours) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.png");
  for (const uint8_t alpha : {255, 100}) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = kWidth, image.height = kHeight, image.format = PNG_FORMAT_RGBA_COLORMAP;
    image.colormap_entries = 3;
    const std::vector<uint8_t> colours = {255, 10, 20, 255, 30, 200, 40, alpha, 1, 2, 3, 255};
    std::vector<uint8_t> indices = noise(size_t{kWidth} * kHeight);
    for (uint8_t& index : indices) index %= 3;
    ASSERT_TRUE(png_image_write_to_file(&image, path.c_str(), 0, indices.data(), 0, colours.data())) << image.message;
    expect_same_as_openimageio(open_plain_png(path).get(), path);
  }
}

TEST(PlainRows, JpegIsWhatOpenImageIoReads) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.jpg");
  for (const int channels : {1, 3})
    for (const int quality : {30, 95}) {
      SCOPED_TRACE(channels);
      const std::vector<uint8_t> values = noise(size_t{kWidth} * kHeight * channels);
      ImageToEncode image{kWidth, kHeight, channels, values.data()};
      image.quality = quality;
      const std::vector<unsigned char> content = encode_image("jpg", image);
      std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(content.data()), std::ssize(content));
      expect_same_as_openimageio(open_plain_jpeg(path).get(), path);
    }
}

TEST(PlainRows, HdrIsWhatOpenImageIoReads) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.hdr");
  const std::vector<uint8_t> bits = noise(size_t{2} * kWidth * kHeight * 3);
  for (const int width : {kWidth, 5}) {
    std::vector<float> values(static_cast<size_t>(width) * kHeight * 3);
    for (size_t i = 0; i < values.size(); ++i)  // runs of equal pixels, black ones, and all exponents
      values[i] = i < 60 ? 0 : i < 120 ? 0.7f : std::ldexp(static_cast<float>(bits[2 * i]), bits[2 * i + 1] / 2 - 64);
    ImageToEncode image{width, kHeight};
    image.floats = values.data();
    const std::vector<unsigned char> content = encode_image("hdr", image);
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(content.data()), std::ssize(content));
    expect_same_as_openimageio(open_plain_hdr(path).get(), path);
    std::filesystem::resize_file(path, content.size() - 5);
    const auto reader = open_plain_hdr(path);
    EXPECT_TRUE(contains(message_of([&] { reader->read_floats(0, 3); }), "damaged or incomplete image: it ends early"));
  }
}

/// Damaged files and other formats are left to OpenImageIO.
TEST(PlainRows, DamagedFilesAreNamedAndOthersLeft) {
  const TemporaryFolder folder;
  const std::vector<uint8_t> values = noise(size_t{64} * 64 * 3);
  const ImageToEncode image{64, 64, 3, values.data()};
  for (const char* extension : {"png", "jpg"}) {
    const std::vector<unsigned char> content = encode_image(extension, image);
    const std::string path = folder.file(std::string("a.") + extension);
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(content.data()), std::ssize(content));
    std::filesystem::resize_file(path, content.size() / 2);
    const auto reader = open_image(path, OtherColours::kKeep);
    EXPECT_TRUE(contains(message_of([&] { reader->read_bytes(0, 3); }), path + ": damaged or incomplete image: "));
    std::ofstream(path, std::ios::binary | std::ios::trunc) << "P6\n1 1\n255\nabc";
    EXPECT_FALSE(open_plain_png(path));
    EXPECT_FALSE(open_plain_jpeg(path));
    EXPECT_FALSE(open_plain_hdr(path));
    EXPECT_FALSE(open_plain_png(folder.file("missing")));
  }
}

}  // namespace
}  // namespace covary
