// SPDX-License-Identifier: Apache-2.0
// New versions of EXR files keep what they do not change: the files are written and read by OpenEXR itself.
#include "film/exr_copy.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineInputPart.h>
#include <OpenEXR/ImfDeepScanLineOutputPart.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledOutputPart.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <numeric>

#include "film/image_file.h"
#include "support/files.h"

namespace covary::exr_copy_test {
namespace {

namespace Imf = OPENEXR_IMF_NAMESPACE;
using test_support::test_file;

constexpr int kWidth = 20, kHeight = 37;  // more than two blocks of ZIP
const Imath::Box2i kDisplay({5, 6}, {44, 55}), kWindow({-2, 8}, {-2 + kWidth - 1, 8 + kHeight - 1});

/// Bits of any kind: as numbers of Cryptomatte they are identifiers, some of them NaN or denormal.
std::vector<uint32_t> bits(uint32_t seed) {
  std::vector<uint32_t> values(kWidth * kHeight);
  for (uint32_t& value : values) value = seed = seed * 1664525 + 1013904223;
  return values;
}

Imf::Slice slice_of(Imf::PixelType type, void* values) {
  return Imf::Slice::Make(type, values, kWindow, type == Imf::HALF ? 2 : 4, (type == Imf::HALF ? 2 : 4) * kWidth);
}

Imf::Header header_of(const std::string& name, const std::string& type, Imf::Compression compression) {
  Imf::Header header(kDisplay, kWindow, 1.5f);
  header.setName(name), header.setType(type), header.compression() = compression;
  header.insert("cryptomatte/abc/manifest", Imf::StringAttribute("{\"ball\":\"0000ffff\"}"));
  header.insert("exposure_time", Imf::FloatAttribute(0.02f));
  header.insert("covary:predicted_relmse", Imf::StringAttribute("0.5"));
  header.insert("preview_of", Imf::StringAttribute(name));
  Imf::addChromaticities(
      header, Imf::Chromaticities({0.713f, 0.293f}, {0.165f, 0.83f}, {0.128f, 0.044f}, {0.32168f, 0.33767f}));
  return header;
}

/// A part of scan lines with a picture, alpha, identifiers; a view in lossy tiles; a deep part.
void write_source(const std::string& path) {
  std::vector<Imf::Header> headers = {header_of("left", Imf::SCANLINEIMAGE, Imf::PIZ_COMPRESSION),
                                      header_of("right", Imf::TILEDIMAGE, Imf::DWAA_COMPRESSION),
                                      header_of("deep", Imf::DEEPSCANLINE, Imf::ZIPS_COMPRESSION)};
  for (const char* name : {"R", "G", "B", "A"}) {
    headers[0].channels().insert(name, Imf::Channel(Imf::HALF));
    headers[1].channels().insert(name, Imf::Channel(Imf::HALF));
  }
  headers[0].channels().insert("crypto00.r", Imf::Channel(Imf::FLOAT));
  headers[0].channels().insert("object", Imf::Channel(Imf::UINT));
  headers[1].setTileDescription(Imf::TileDescription(16, 16));
  headers[2].channels().insert("Z", Imf::Channel(Imf::FLOAT));
  Imf::MultiPartOutputFile file(path.c_str(), headers.data(), 3);

  std::vector<half> halves(kWidth * kHeight);
  for (size_t i = 0; i < halves.size(); ++i) halves[i] = half(0.01f * static_cast<float>(i));
  std::vector<uint32_t> crypto = bits(1), object = bits(2);
  Imf::FrameBuffer buffer;
  for (const char* name : {"R", "G", "B", "A"}) buffer.insert(name, slice_of(Imf::HALF, halves.data()));
  Imf::FrameBuffer left = buffer;
  left.insert("crypto00.r", slice_of(Imf::FLOAT, crypto.data()));
  left.insert("object", slice_of(Imf::UINT, object.data()));
  Imf::OutputPart part(file, 0);
  part.setFrameBuffer(left);
  part.writePixels(kHeight);
  Imf::TiledOutputPart tiles(file, 1);
  tiles.setFrameBuffer(buffer);
  tiles.writeTiles(0, tiles.numXTiles() - 1, 0, tiles.numYTiles() - 1);

  std::vector<unsigned> counts(kWidth * kHeight, 1);
  std::vector<float> depths(kWidth * kHeight);
  std::iota(depths.begin(), depths.end(), 1.0f);
  std::vector<float*> pointers;
  for (float& depth : depths) pointers.push_back(&depth);
  const auto at_origin = [](auto* base) {
    return reinterpret_cast<char*>(base - (kWindow.min.x + kWindow.min.y * kWidth));
  };
  Imf::DeepFrameBuffer deep;
  deep.insertSampleCountSlice(Imf::Slice(Imf::UINT, at_origin(counts.data()), 4, 4 * kWidth));
  deep.insert("Z", Imf::DeepSlice(Imf::FLOAT, at_origin(pointers.data()), sizeof(float*), sizeof(float*) * kWidth, 4));
  Imf::DeepScanLineOutputPart deep_part(file, 2);
  deep_part.setFrameBuffer(deep);
  deep_part.writePixels(kHeight);
}

template <typename T>
std::vector<T> read_channel(const std::string& path, int part, const char* name, Imf::PixelType type) {
  Imf::MultiPartInputFile file(path.c_str());
  std::vector<T> values(kWidth * kHeight);
  Imf::FrameBuffer buffer;
  buffer.insert(name, slice_of(type, values.data()));
  Imf::InputPart input(file, part);
  input.setFrameBuffer(buffer);
  input.readPixels(kWindow.min.y, kWindow.max.y);
  return values;
}

std::vector<uint16_t> bits_of_halves(const std::string& path, int part, const char* name) {
  std::vector<uint16_t> result;
  for (const half value : read_channel<half>(path, part, name, Imf::HALF)) result.push_back(value.bits());
  return result;
}

class ExrCopy : public ::testing::Test {
 protected:
  void SetUp() override {
    write_source(source_);
    std::iota(red_.begin(), red_.end(), 1.0f);
    for (const char* name : {"left.R", "left.G", "left.B", "StdError.R"})
      changes_.planes.push_back({name, ExrPlane::Type::kFloat, red_.data(), sizeof(float)});
    changes_.picture = "left.R";
    changes_.attributes = {{"covary:version", "1"}};
  }
  const std::string source_ = test_file("source.exr"), path_ = test_file("copy.exr");
  std::vector<float> red_ = std::vector<float>(kWidth * kHeight);
  ExrChanges changes_;
};

TEST_F(ExrCopy, KeepsAllOtherChannelsBitByBit) {
  EXPECT_EQ(write_changed_exr(path_, source_, changes_), std::vector<std::string>{});
  EXPECT_EQ(read_channel<float>(path_, 0, "R", Imf::FLOAT), red_);
  EXPECT_EQ(read_channel<float>(path_, 0, "StdError.R", Imf::FLOAT), red_);
  EXPECT_EQ(read_channel<uint32_t>(path_, 0, "object", Imf::UINT), bits(2));
  std::vector<uint32_t> crypto;
  for (const float value : read_channel<float>(path_, 0, "crypto00.r", Imf::FLOAT))
    crypto.push_back(std::bit_cast<uint32_t>(value));
  EXPECT_EQ(crypto, bits(1));
  EXPECT_EQ(bits_of_halves(path_, 0, "A"), bits_of_halves(source_, 0, "A"));
  for (const char* name : {"R", "A"})  // would change if the lossy tiles were compressed again
    EXPECT_EQ(bits_of_halves(path_, 1, name), bits_of_halves(source_, 1, name));
}

TEST_F(ExrCopy, KeepsPartsWindowsAndAttributes) {
  write_changed_exr(path_, source_, changes_);
  Imf::MultiPartInputFile file(path_.c_str()), old(source_.c_str());
  ASSERT_EQ(file.parts(), 3);
  for (int part = 0; part < 3; ++part) {
    const Imf::Header &header = file.header(part), &before = old.header(part);
    EXPECT_EQ(header.name(), before.name());
    EXPECT_EQ(header.type(), before.type());
    EXPECT_EQ(header.displayWindow(), kDisplay);
    EXPECT_EQ(header.dataWindow(), kWindow);
    EXPECT_EQ(header.pixelAspectRatio(), 1.5f);
    EXPECT_EQ(header.typedAttribute<Imf::FloatAttribute>("exposure_time").value(), 0.02f);
    EXPECT_EQ(header.typedAttribute<Imf::StringAttribute>("cryptomatte/abc/manifest").value(),
              "{\"ball\":\"0000ffff\"}");
    EXPECT_EQ(Imf::chromaticities(header).red, Imath::V2f(0.713f, 0.293f));
    EXPECT_EQ(header.findTypedAttribute<Imf::StringAttribute>("covary:predicted_relmse"), nullptr);
  }
  EXPECT_EQ(file.header(1).compression(), Imf::DWAA_COMPRESSION);
  EXPECT_EQ(file.header(0).channels()["A"].type, Imf::HALF);
  EXPECT_EQ(file.header(0).channels()["R"].type, Imf::FLOAT);
  EXPECT_EQ(file.header(0).typedAttribute<Imf::StringAttribute>("covary:version").value(), "1");
}

TEST_F(ExrCopy, KeepsDeepParts) {
  write_changed_exr(path_, source_, changes_);
  Imf::MultiPartInputFile file(path_.c_str());
  Imf::DeepScanLineInputPart part(file, 2);
  std::vector<unsigned> counts(kWidth * kHeight);
  std::vector<float> depths(kWidth * kHeight);
  std::vector<float*> pointers;
  for (float& depth : depths) pointers.push_back(&depth);
  const ptrdiff_t origin = kWindow.min.x + kWindow.min.y * kWidth;
  Imf::DeepFrameBuffer deep;
  deep.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data() - origin), 4, 4 * kWidth));
  deep.insert("Z", Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(pointers.data() - origin), sizeof(float*),
                                  sizeof(float*) * kWidth, 4));
  part.setFrameBuffer(deep);
  part.readPixelSampleCounts(kWindow.min.y, kWindow.max.y);
  EXPECT_EQ(counts, std::vector<unsigned>(kWidth * kHeight, 1));
  part.readPixels(kWindow.min.y, kWindow.max.y);
  EXPECT_EQ(depths.front(), 1);
  EXPECT_EQ(depths.back(), kWidth * kHeight);
}

TEST_F(ExrCopy, HasChecksumsOfAllChannels) {
  write_changed_exr(path_, source_, changes_);
  EXPECT_TRUE(ExrFile(path_).attributes().contains(kChecksums));
  check_image(path_);
  // A version of that version checks what it copies.
  changes_.planes.clear();
  write_changed_exr(test_file("again.exr"), path_, changes_);
  check_image(test_file("again.exr"));
  EXPECT_EQ(read_channel<float>(test_file("again.exr"), 0, "R", Imf::FLOAT), red_);
}

TEST_F(ExrCopy, LeavesOutWhatIsNamed) {
  changes_.left_out = {"left.object"};
  write_changed_exr(path_, source_, changes_);
  EXPECT_EQ(ExrFile(path_).find("left.object"), nullptr);
  EXPECT_NE(ExrFile(path_).find("left.crypto00.r"), nullptr);
  changes_.only_planes = true;
  changes_.planes.pop_back();
  write_changed_exr(path_, source_, changes_);
  const ExrFile file(path_);
  ASSERT_EQ(file.channels().size(), 3u);
  EXPECT_EQ(file.channels()[0].name, "B");
  EXPECT_EQ(file.colours().text(), "ACEScg");
  check_image(path_);
}

TEST(ExrChannels, AlphaOfThePicture) {
  const std::vector<ExrFile::Channel> channels = {{"A", "half"}, {"left.A", "half"}, {"beauty.alpha", "half"}};
  EXPECT_EQ(alpha_channel(channels, "R"), "A");
  EXPECT_EQ(alpha_channel(channels, "left.R"), "left.A");
  EXPECT_EQ(alpha_channel(channels, "beauty.red"), "beauty.alpha");
  EXPECT_EQ(alpha_channel(channels, "right.R"), "");
  EXPECT_EQ(alpha_channel(channels, "depth"), "");
}

}  // namespace
}  // namespace covary::exr_copy_test
