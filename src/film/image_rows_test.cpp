// SPDX-License-Identifier: Apache-2.0
#include "film/image_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "core/random.h"
#include "film/image_writer.h"
#include "imageio/image_io.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of, test_support::test_file;

Image noise(int width, int height) {
  Image image(width, height, 3);
  for (size_t i = 0; i < image.data.size(); ++i)
    image.data[i] = static_cast<float>(mix64(i) >> 40) / static_cast<float>(1 << 24);
  return image;
}

ImagePlace place_of(const Image& image) { return {image.width, image.height, {0, 0, image.width, image.height}}; }

/// One file of each format.
std::vector<std::string> files_of(const Image& image) {
  std::vector<std::string> paths;
  for (const char* ending : {"exr", "png", "pfm", "tif", "hdr"}) {
    paths.push_back(test_file(std::string("rows.") + ending));
    write_image(paths.back(), image, place_of(image), {});
  }
  return paths;
}

TEST(ImageRows, AreThoseOfTheWholeImage) {
  for (const std::string& path : files_of(noise(13, 11))) {
    const Image whole = read_image(path).image;
    ImageRows file(path);
    EXPECT_EQ(file.low_dynamic_range(), read_image(path).low_dynamic_range) << path;
    // Downwards, with overlapping rows, and back up.
    for (const auto& [first, n] : std::vector<std::pair<int, int>>{{0, 4}, {3, 5}, {8, 3}, {2, 1}, {0, 11}, {5, 6}}) {
      const Image rows = file.read(first, n);
      ASSERT_EQ(rows.height, n);
      EXPECT_TRUE(std::equal(rows.data.begin(), rows.data.end(), whole.pixel(0, first))) << path << " " << first;
    }
  }
}

TEST(ImageRows, OfADamagedFilmAreNotGivenAway) {
  const std::string path = test_file("damaged.exr");
  write_image(path, noise(64, 64), place_of(noise(64, 64)), {});
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(0, std::ios::end);
  const std::streamoff place = static_cast<std::streamoff>(file.tellg()) - 40;
  file.seekg(place);
  const char byte = static_cast<char>(file.get() ^ 1);
  file.seekp(place);
  file.put(byte);
  file.close();
  ImageRows rows(path);
  EXPECT_NE(message_of([&] { rows.read(0, 4); }), "");
}

}  // namespace
}  // namespace covary
