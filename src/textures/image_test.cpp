// SPDX-License-Identifier: Apache-2.0
// Files that must be rejected with an error naming them. Valid files: bitmap_test.cpp.
#include "textures/image.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/srgb.h"
#include "support/describe.h"
#include "support/files.h"
#include "support/leaks.h"

namespace covary {
namespace {

using test_support::TemporaryFolder;

std::string error_of(const std::string& path) {
  try {
    read_texels(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

void write(const std::string& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

/// An image of random numbers, which no format can compress.
void write_noise(const std::string& path, int width, int height, const std::vector<std::string>& channels) {
  const auto output = OIIO::ImageOutput::create(path);
  ASSERT_TRUE(output);
  OIIO::ImageSpec spec(width, height, static_cast<int>(channels.size()), OIIO::TypeDesc::UINT8);
  if (path.ends_with(".exr")) spec.format = OIIO::TypeDesc::FLOAT;
  spec.channelnames = channels;
  ASSERT_TRUE(output->open(path, spec)) << output->geterror();
  std::vector<uint8_t> pixels(static_cast<size_t>(width) * height * channels.size());
  for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<uint8_t>((i * 2654435761u) >> 13);
  ASSERT_TRUE(output->write_image(OIIO::TypeDesc::UINT8, pixels.data()));
  ASSERT_TRUE(output->close());
}

TEST(Image, NamesAFileThatDoesNotExist) {
  EXPECT_EQ(error_of("/no/such/file.png"), "cannot read /no/such/file.png: no such file");
}

TEST(Image, RejectsWhatIsNotAnImage) {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "a.jpg", "a.exr", "a.hdr", "a.pfm", "a.tga", "a.xyz"}) {
    const std::string path = folder.file(name);
    write(path, "plain text is not a picture, however long it may be");
    EXPECT_NE(error_of(path).find(path), std::string::npos) << name << ": " << error_of(path);
    write(path, "");
    EXPECT_NE(error_of(path).find(path), std::string::npos) << name << ": " << error_of(path);
  }
}

/// pbrt's mipmap.cpp, Bilerp<Float>: alpha of images that are not opaque, otherwise the mean of linear colours.
TEST(Image, NumbersAreAlphaOrTheMean) {
  const TemporaryFolder folder;
  const auto write_pixel = [&](const char* name, const std::vector<std::string>& channels, std::vector<uint8_t> pixel) {
    const auto output = OIIO::ImageOutput::create(folder.file(name));
    ASSERT_TRUE(output);
    OIIO::ImageSpec spec(1, 1, static_cast<int>(channels.size()), OIIO::TypeDesc::UINT8);
    spec.channelnames = channels;
    spec.attribute("oiio:UnassociatedAlpha", 1);
    ASSERT_TRUE(output->open(folder.file(name), spec)) << output->geterror();
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::UINT8, pixel.data()));
    ASSERT_TRUE(output->close());
  };
  write_pixel("leaf.png", {"R", "G", "B", "A"}, {255, 0, 0, 51});
  write_pixel("opaque.png", {"R", "G", "B", "A"}, {255, 51, 0, 255});
  write_pixel("colour.png", {"R", "G", "B"}, {255, 51, 0});
  write_pixel("grey.png", {"Y"}, {51});
  const auto value = [&](const char* name, bool raw) {
    const TexelImage image = read_alpha_or_mean(folder.file(name), raw);
    EXPECT_EQ(image.channels, 1) << name;
    const float stored = image.bytes.empty() ? image.floats.at(0) : static_cast<float>(image.bytes.at(0)) / 255;
    return image.srgb && !raw ? srgb_to_linear(stored) : stored;
  };
  const float low = srgb_to_linear(0.2f);
  EXPECT_NEAR(value("leaf.png", false), low, 1e-6f);
  EXPECT_NEAR(value("leaf.png", true), 0.2f, 1e-6f);
  for (const char* name : {"opaque.png", "colour.png"}) {
    EXPECT_NEAR(value(name, false), (1 + low) / 3, 1e-6f) << name;
    EXPECT_NEAR(value(name, true), 1.2f / 3, 1e-6f) << name;
  }
  EXPECT_NEAR(value("grey.png", false), low, 1e-6f);
}

TEST(Image, RejectsTruncatedFiles) {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "a.exr", "a.tga"}) {
    const std::string path = folder.file(name);
    write_noise(path, 64, 64, {"R", "G", "B"});
    const TexelImage whole = read_texels(path);
    EXPECT_EQ(whole.width, 64) << name;
    std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
    const test_support::LeaksOfOthers of_openimageio;  // libpng longjmps past the destructor of a string
    const std::string error = error_of(path);
    const bool is_found_when_opened = error.find(path + ": not an image that can be read: TGA header claims") == 0;
    EXPECT_TRUE(error.find(path + ": damaged or incomplete image: ") == 0 || is_found_when_opened) << name << error;
  }
}

TEST(Image, RejectsEmptyAndAbsurdSizes) {
  const TemporaryFolder folder;
  const std::string empty = folder.file("empty.pfm");
  write(empty, "PF\n0 0\n-1.0\n");
  EXPECT_NE(error_of(empty).find(empty), std::string::npos) << error_of(empty);

  const std::string png = folder.file("huge.png");
  write_noise(png, 8, 8, {"R", "G", "B"});
  std::fstream file(png, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(16);  // width and height in the header; the checksum becomes wrong, which is an error as well
  file << std::string("\x00\x0f\x00\x00\x00\x0f\x00\x00", 8);
  file.close();
  EXPECT_NE(error_of(png).find(png), std::string::npos) << error_of(png);

  const std::string pfm = folder.file("huge.pfm");
  write(pfm, "PF\n40000 40000\n-1.0\nabcdefgh");
  const std::string error = error_of(pfm);
  EXPECT_TRUE(error.find(pfm + ": claims 40000 x 40000 pixels of 3 channels in 28 bytes") == 0 ||
              error.find(pfm + ": not an image that can be read: pnm header claims") == 0)  // OpenImageIO 3.1
      << error;
}

TEST(Image, RejectsChannelsThatAreNotColours) {
  const TemporaryFolder folder;
  const std::string path = folder.file("xyz.exr");
  write_noise(path, 4, 4, {"X", "Y", "Z"});
  EXPECT_EQ(error_of(path), path + " has the channels X, Y, Z; a texture needs R, G, B or a grey one");
}

TEST(Image, FindsColoursAmongOtherChannels) {
  const TemporaryFolder folder;
  const std::string path = folder.file("many.exr");
  write_noise(path, 4, 4, {"depth", "B", "G", "id", "R"});
  const TexelImage image = read_texels(path);
  ASSERT_EQ(image.channels, 3);
  // OpenEXR stores channels by name; whatever their order in the file, value i of the five written is that of its name.
  const auto written = [](size_t i) { return static_cast<float>(static_cast<uint8_t>((i * 2654435761u) >> 13)) / 255; };
  for (size_t i = 0; i < 16; ++i) {
    EXPECT_FLOAT_EQ(image.floats[3 * i], written(5 * i + 4));
    EXPECT_FLOAT_EQ(image.floats[3 * i + 1], written(5 * i + 2));
    EXPECT_FLOAT_EQ(image.floats[3 * i + 2], written(5 * i + 1));
  }
}

/// Mitsuba 3.9.1 reads such a texture of ones as ones, too.
TEST(Image, TakesIntegersOfExrAsTheyAre) {
  const TemporaryFolder folder;
  const std::string path = folder.file("integers.exr");
  const auto output = OIIO::ImageOutput::create(path);
  OIIO::ImageSpec spec(2, 1, 3, OIIO::TypeDesc::UINT32);
  ASSERT_TRUE(output && output->open(path, spec));
  const std::vector<uint32_t> values = {0, 1, 2, 3, 70000, 1u << 31};
  ASSERT_TRUE(output->write_image(OIIO::TypeDesc::UINT32, values.data()) && output->close());
  const TexelImage texture = read_texels(path), environment = read_linear_rgb(path);
  EXPECT_FALSE(texture.srgb);
  EXPECT_EQ(texture.floats, std::vector<float>(values.begin(), values.end()));
  EXPECT_EQ(environment.floats, texture.floats);
}

TEST(Image, TakesALayerIfItIsTheOnlyPicture) {
  const TemporaryFolder folder;
  const std::string path = folder.file("layers.exr");
  write_noise(path, 4, 4, {"depth.Z", "glow.R", "glow.G", "glow.B"});
  EXPECT_EQ(read_texels(path).channels, 3);
  write_noise(path, 4, 4, {"a.R", "a.G", "a.B", "b.R", "b.G", "b.B"});
  EXPECT_NE(error_of(path).find(": 2 pictures; a texture needs one"), std::string::npos) << error_of(path);
}

TEST(Image, RejectsValuesThatAreNotFinite) {
  const TemporaryFolder folder;
  const std::string path = folder.file("bad.pfm");
  std::string bytes = "Pf\n2 2\n-1.0\n";
  const float values[4] = {1, 2, 3, std::numeric_limits<float>::infinity()};  // bottom row first
  bytes.append(reinterpret_cast<const char*>(values), sizeof(values));
  write(path, bytes);
  EXPECT_EQ(error_of(path), path + " holds the value inf at pixel (1, 0); all must be finite");
}

}  // namespace
}  // namespace covary
