// SPDX-License-Identifier: Apache-2.0
// Files written by OpenEXR. The tests of the module check that OpenImageIO reads the same values.
#include "imageio/exr_image.h"

#include <OpenEXR/ImfArray.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

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
    const auto reader = open_plain_exr(path);
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

TEST(ExrImage, IsWhatOpenImageIoReads) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  write(path, {"A", "B", "G", "R"});
  const auto plain = open_image(path);
  write(folder.file("b.exr"), {"A", "B", "G", "R", "other"});
  const auto other = open_image(folder.file("b.exr"));
  EXPECT_EQ(plain->read_floats(0, 4), other->read_floats(0, 4));
  EXPECT_EQ(plain->header().format, other->header().format);
  EXPECT_EQ(plain->header().type, other->header().type);
  EXPECT_EQ(plain->header().x, other->header().x);
  EXPECT_EQ(plain->header().frame_height, other->header().frame_height);
  EXPECT_EQ(plain->header().attributes.at("note"), other->header().attributes.at("note"));
}

TEST(ExrImage, LeavesOthersToOpenImageIo) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  for (const std::vector<const char*>& channels :
       {std::vector<const char*>{"R", "G"}, {"Y", "RY", "BY"}, {"R", "G", "B", "Z"}, {"R", "G", "B", "Y"}, {"A"}}) {
    write(path, channels);
    EXPECT_FALSE(open_plain_exr(path)) << channels[0] << channels.size();
  }
  write(path, {"Y", "A"});
  EXPECT_TRUE(open_plain_exr(path));
  EXPECT_FALSE(open_plain_exr(folder.file("none.exr")));
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
