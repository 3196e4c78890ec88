// SPDX-License-Identifier: Apache-2.0
// Files written by OpenEXR.
#include "imageio/exr_image.h"

#include <OpenEXR/ImfArray.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfCompression.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>

#include "core/error.h"
#include "support/files.h"

namespace covary {
namespace {

namespace Imf = OPENEXR_IMF_NAMESPACE;
using test_support::TemporaryFolder;

const Imath::Box2i kFrame({-1, -2}, {10, 20}), kData({2, 3}, {5, 5});  // 4 x 3 pixels

/// Channel c of pixel i is i + 100 c + 0.25, which half represents exactly.
void write(const std::string& path, const std::vector<const char*>& channels, Imf::PixelType type = Imf::FLOAT) {
  Imf::Header header(kFrame, kData);
  header.insert("note", Imf::StringAttribute("a text"));
  Imf::FrameBuffer buffer;
  std::vector<std::vector<float>> floats(channels.size());
  std::vector<std::vector<half>> halves(channels.size());
  for (size_t c = 0; c < channels.size(); ++c) {
    for (int i = 0; i < 12; ++i)
      floats[c].push_back(static_cast<float>(i) + 100 * static_cast<float>(c) + 0.25f),
          halves[c].push_back(floats[c][i]);
    header.channels().insert(channels[c], Imf::Channel(type));
    buffer.insert(channels[c], type == Imf::HALF ? Imf::Slice::Make(type, halves[c].data(), kData)
                                                 : Imf::Slice::Make(type, floats[c].data(), kData));
  }
  Imf::OutputFile file(path.c_str(), header);
  file.setFrameBuffer(buffer);
  file.writePixels(3);
}

TEST(ExrImage, ReadsColoursOfBothTypes) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
    write(path, {"A", "B", "G", "R"}, type);
    const auto reader = open_exr(path);
    ASSERT_TRUE(reader);
    const ImageHeader& header = reader->header();
    EXPECT_EQ(header.channels, (std::vector<std::string>{"R", "G", "B", "A"}));
    EXPECT_EQ(header.type, type == Imf::HALF ? "half" : "float");
    EXPECT_EQ(header.alpha_channel, 3);
    EXPECT_EQ((std::array{header.width, header.height, header.x, header.y, header.frame_width, header.frame_height}),
              (std::array{4, 3, 3, 5, 12, 23}));
    EXPECT_EQ(header.attributes.at("note"), "a text");
    const std::vector<float> values = reader->read_floats(0, 3);
    for (int i = 0; i < 12; ++i)
      for (int c = 0; c < 3; ++c)
        EXPECT_EQ(values[static_cast<size_t>(3 * i + c)], static_cast<float>(i + 100 * (3 - c)) + 0.25f);
    EXPECT_EQ(reader->read_floats(1, 2)[0], 200.25f);
    EXPECT_THROW(reader->read_bytes(0, 3), Error);
  }
}

TEST(ExrImage, PutsThePictureFirst) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  write(path, {"A", "B", "G", "Other", "R"});
  const auto reader = open_image(path);
  EXPECT_EQ(reader->header().channels, (std::vector<std::string>{"R", "G", "B", "A", "Other"}));
  EXPECT_EQ(reader->header().n_picture, 3);
  EXPECT_EQ(reader->header().alpha_channel, 3);
  const std::vector<float> values = reader->read_floats(0, 5);  // channels 4, 2, 1, 0, 3 of write()
  EXPECT_EQ(std::vector(values.begin(), values.begin() + 5),
            (std::vector<float>{400.25f, 200.25f, 100.25f, 0.25f, 300.25f}));
  write(path, {"A", "glow.A", "glow.B", "glow.G", "glow.R"});
  const auto other = open_image(path);
  const ImageHeader& layer = other->header();
  EXPECT_EQ(layer.channels, (std::vector<std::string>{"glow.R", "glow.G", "glow.B", "A", "glow.A"}));
  EXPECT_EQ(layer.alpha_channel, 4);
}

TEST(ExrImage, LeavesOthersToOpenImageIo) {
  const TemporaryFolder folder;
  EXPECT_FALSE(open_exr(folder.file("none.exr")));
  const std::string deep = folder.file("deep.exr");
  Imf::Header header(kFrame, kData);
  header.setType(Imf::DEEPSCANLINE);
  header.compression() = Imf::ZIPS_COMPRESSION;
  header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
  Imf::DeepScanLineOutputFile(deep.c_str(), header);
  EXPECT_FALSE(open_exr(deep));
}

/// OpenEXR's technical introduction: integers are stored as they are, such as numbers of objects.
TEST(ExrImage, KeepsTheValuesOfIntegers) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  Imf::Header header(kData, kData);
  std::vector<uint32_t> integers = {0, 1, 2, 255, 256, 65535, 65536, 1u << 24, 1u << 31, 7, 8, 9};
  std::vector<half> halves(12, half(0.5f));
  Imf::FrameBuffer buffer;
  for (const char* name : {"R", "G"}) {
    header.channels().insert(name, Imf::Channel(Imf::UINT));
    buffer.insert(name, Imf::Slice::Make(Imf::UINT, integers.data(), kData));
  }
  header.channels().insert("B", Imf::Channel(Imf::HALF));
  buffer.insert("B", Imf::Slice::Make(Imf::HALF, halves.data(), kData));
  {
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(3);
  }
  const auto reader = open_image(path);
  EXPECT_EQ(reader->header().type, "uint");
  EXPECT_TRUE(reader->header().floating_point);  // not encoded as sRGB
  const std::vector<float> values = reader->read_floats(0, 3);
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(values[3 * i], static_cast<float>(integers[i]));
    EXPECT_EQ(values[3 * i + 1], static_cast<float>(integers[i]));
    EXPECT_EQ(values[3 * i + 2], 0.5f);
  }
}

TEST(ExrImage, ReadsThePartThatIsThePicture) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  const Imath::Box2i small({0, 0}, {1, 0});  // parts may differ in size
  std::array<Imf::Header, 2> headers = {Imf::Header(kFrame, kData), Imf::Header(kFrame, small)};
  headers[0].setName("depth"), headers[1].setName("rgba");
  headers[0].channels().insert("Z", Imf::Channel(Imf::FLOAT));
  for (const char* name : {"R", "G", "B"}) headers[1].channels().insert(name, Imf::Channel(Imf::FLOAT));
  for (Imf::Header& header : headers) header.setType(Imf::SCANLINEIMAGE);
  std::vector<float> depths(12, 2.0f);
  std::array<float, 6> colours = {0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f};
  {
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), 2);
    Imf::FrameBuffer first, second;
    first.insert("Z", Imf::Slice::Make(Imf::FLOAT, depths.data(), kData));
    for (int c = 0; c < 3; ++c)
      second.insert(std::array{"R", "G", "B"}[c], Imf::Slice::Make(Imf::FLOAT, &colours[c], small, 3 * sizeof(float)));
    Imf::OutputPart depth(file, 0), picture(file, 1);
    depth.setFrameBuffer(first), picture.setFrameBuffer(second);
    depth.writePixels(3), picture.writePixels(1);
  }
  const auto reader = open_image(path);
  EXPECT_EQ(reader->header().width, 2);
  EXPECT_EQ(reader->read_floats(0, 3), std::vector<float>(colours.begin(), colours.end()));
}

TEST(ExrImage, IsCompleteWithItsLastPixels) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  write(path, {"R", "G", "B"});
  EXPECT_TRUE(is_complete_exr(path));
  for (auto size = std::filesystem::file_size(path); size > 0; --size) {
    std::filesystem::resize_file(path, size - 1);
    EXPECT_FALSE(is_complete_exr(path)) << size - 1;
  }
  EXPECT_FALSE(is_complete_exr(folder.file("none.exr")));
}

TEST(ExrImage, TellsOfMissingPixels) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  write(path, {"R", "G", "B"});
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 20);
  const auto reader = open_image(path);
  EXPECT_THROW(reader->read_floats(0, 3), Error);
}

}  // namespace
}  // namespace covary
