// SPDX-License-Identifier: Apache-2.0
#include "imageio/png.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "imageio/image_io.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::TemporaryFolder;

std::string write(const TemporaryFolder& folder, const std::vector<unsigned char>& content) {
  const std::string path = folder.file("a.png");
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(content.data()), std::ssize(content));
  return path;
}

TEST(Png, IsReadBackByAnotherLibrary) {
  const TemporaryFolder folder;
  std::vector<uint8_t> rgb;
  for (int i = 0; i < 3 * 5 * 4; ++i) rgb.push_back(static_cast<uint8_t>(37 * i));
  const auto reader = open_image(write(folder, encode_png(5, 4, rgb)));
  EXPECT_EQ(reader->header().format, "png");
  EXPECT_EQ(reader->header().width, 5);
  EXPECT_EQ(reader->header().height, 4);
  const std::string space = reader->header().attributes.at("oiio:ColorSpace");
  EXPECT_TRUE(space == "sRGB" || space == "srgb_rec709_scene") << space;  // OpenImageIO 2, 3
  EXPECT_EQ(reader->read_bytes(0, 3), rgb);
}

TEST(Png, KeepsTexts) {
  const TemporaryFolder folder;
  const std::map<std::string, std::string> texts = {{"Software", "covary"}, {"Title", "Küche, 3 × 2"}, {"Empty", ""}};
  EXPECT_EQ(read_png_texts(write(folder, encode_png(1, 1, {1, 2, 3}, texts))), texts);
  EXPECT_TRUE(read_png_texts(write(folder, encode_png(1, 1, {1, 2, 3}))).empty());
}

TEST(Png, FindsNoTextsInOtherFiles) {
  const TemporaryFolder folder;
  EXPECT_TRUE(read_png_texts(folder.file("missing.png")).empty());
  EXPECT_TRUE(read_png_texts(write(folder, {'t', 'e', 'x', 't'})).empty());
  std::vector<unsigned char> cut = encode_png(1, 1, {1, 2, 3}, {{"Software", "covary"}});
  cut.resize(cut.size() / 2);
  EXPECT_TRUE(read_png_texts(write(folder, cut)).empty());
}

TEST(Png, SaysWhatItCannotWrite) {
  EXPECT_THROW(encode_png(1, 1, {1, 2}), Error);
  EXPECT_THROW(encode_png(2000000, 1, std::vector<uint8_t>(6000000)), Error);  // libpng's limit is a million
}

}  // namespace
}  // namespace covary
