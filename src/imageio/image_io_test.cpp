// SPDX-License-Identifier: Apache-2.0
#include "imageio/image_io.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>

#include "core/error.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::TemporaryFolder;

constexpr int kWidth = 4, kHeight = 3;

std::string error_of(const std::string& path) {
  try {
    open_image(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// The pixels of an encoded image, read back from a file.
std::vector<float> read_back(const std::string& extension, const ImageToEncode& image) {
  const TemporaryFolder folder;
  const std::vector<unsigned char> content = encode_image(extension, image);
  const std::string path = folder.file("a." + extension);
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(content.data()), std::ssize(content));
  const auto reader = open_image(path);
  EXPECT_EQ(reader->header().width, kWidth);
  EXPECT_EQ(reader->header().height, kHeight);
  return reader->read_floats(0, 3);
}

TEST(ImageIo, KeepsFloatsInFormatsOfFloats) {
  std::vector<float> values;
  for (int i = 0; i < kWidth * kHeight * 3; ++i)
    values.push_back(std::ldexp(1 + 0.125f * static_cast<float>(i % 8), i % 5));
  ImageToEncode image{kWidth, kHeight};
  image.floats = values.data();
  EXPECT_EQ(read_back("pfm", image), values);
  EXPECT_EQ(read_back("tif", image), values);
  const std::vector<float> shared_exponent = read_back("hdr", image);
  for (size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(shared_exponent[i], values[i], 0.05f * 32) << i;
}

TEST(ImageIo, KeepsBytesInFormatsOfBytes) {
  std::vector<uint8_t> bytes;
  for (int i = 0; i < kWidth * kHeight * 3; ++i) bytes.push_back(static_cast<uint8_t>(100 + i));
  ImageToEncode image{kWidth, kHeight};
  image.bytes = bytes.data();
  for (const char* extension : {"png", "tif", "jpg"}) {
    const std::vector<float> values = read_back(extension, image);
    const float tolerance = extension == std::string("jpg") ? 0.05f : 0x1p-24f;
    for (size_t i = 0; i < bytes.size(); ++i)
      EXPECT_NEAR(values[i], static_cast<float>(bytes[i]) / 255, tolerance) << extension << " " << i;
  }
}

TEST(ImageIo, SaysWhichFormatItCannotWrite) {
  const uint8_t pixel[3] = {1, 2, 3};
  ImageToEncode image{1, 1};
  image.bytes = pixel;
  try {
    encode_image("xyz", image);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kIo);
    EXPECT_NE(std::string(error.what()).find("cannot write images with the extension '.xyz'"), std::string::npos);
  }
}

TEST(ImageIo, OpensRegularFilesOnly) {
  const TemporaryFolder folder;
  const std::string pipe = folder.file("pipe.png");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(error_of(pipe), "cannot read " + pipe + ": not a regular file");
  EXPECT_EQ(error_of(folder.path().string()), "cannot read " + folder.path().string() + ": not a regular file");
  EXPECT_EQ(error_of("/no/such.png"), "cannot read /no/such.png: no such file");
}

TEST(ImageIo, RejectsMorePixelsThanTheFileCanHold) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.pfm");
  std::ofstream(path) << "PF\n30000 30000\n-1\n1234";
  const std::string error = error_of(path);
  if (error.find(path + ": not an image that can be read: pnm header claims") != 0) {  // as OpenImageIO 3.1 says
    EXPECT_EQ(error, path +
                         ": claims 30000 x 30000 pixels of 3 channels in 22 bytes; at most "
                         "1073741824 pixels are accepted, and 10000 values per byte of the file");
  }
}

}  // namespace
}  // namespace covary
