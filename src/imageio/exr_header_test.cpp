// SPDX-License-Identifier: Apache-2.0
#include "imageio/exr_image.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "core/error.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::TemporaryFolder;

std::string number(uint32_t v) {
  std::string bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(v >> shift & 255);
  return bytes;
}

std::string attribute(const std::string& name, const std::string& type, const std::string& value, uint32_t claimed) {
  return name + '\0' + type + '\0' + number(claimed) + value;
}
std::string attribute(const std::string& name, const std::string& type, const std::string& value) {
  return attribute(name, type, value, static_cast<uint32_t>(value.size()));
}

/// The error of check_exr_header() for a file with this content after the magic number and version.
std::string complaint(const std::string& content, uint32_t version = 2) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  std::ofstream(path, std::ios::binary) << "\x76\x2f\x31\x01" << number(version) << content;
  EXPECT_TRUE(is_exr(path));
  try {
    check_exr_header(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInput);
    const std::string text = error.what(), prefix = path + ": damaged EXR file: ";
    EXPECT_TRUE(text.starts_with(prefix)) << text;
    return text.substr(std::min(prefix.size(), text.size()));
  }
  return "";
}

const std::string kEnd(1, '\0');

TEST(ExrHeader, AcceptsAttributesThatFitIntoTheFile) {
  EXPECT_EQ(complaint(attribute("owner", "string", "somebody") + kEnd), "");
  EXPECT_EQ(complaint(attribute("views", "stringvector", number(4) + "left" + number(0)) + kEnd), "");
  EXPECT_EQ(complaint(attribute("preview", "preview", number(1) + number(2) + "12345678") + kEnd), "");
  const uint32_t parts = 0x1002;
  EXPECT_EQ(complaint(attribute("a", "string", "b") + kEnd + attribute("a", "string", "b") + kEnd + kEnd, parts), "");
}

TEST(ExrHeader, RejectsAttributesThatClaimMoreThanTheFileHas) {
  EXPECT_EQ(complaint(attribute("owner", "string", "somebody", 2000000000) + kEnd),
            "the attribute 'owner' claims 2000000000 bytes; 9 bytes of the file are left");
  EXPECT_EQ(complaint(attribute("owner", "string", "somebody", 0xffffffff) + kEnd),
            "the attribute 'owner' claims 4294967295 bytes; 9 bytes of the file are left");
  EXPECT_EQ(complaint(attribute("views", "stringvector", number(2000000000) + "left") + kEnd),
            "a text of the attribute 'views' claims 2000000000 bytes; 4 bytes are left");
  EXPECT_EQ(complaint(attribute("views", "stringvector", "xy") + kEnd), "the attribute 'views' ends early");
  EXPECT_EQ(complaint(attribute("p", "preview", number(30000) + number(30000) + "12345678") + kEnd),
            "the preview claims 30000 x 30000 pixels in 16 bytes");
  EXPECT_EQ(complaint(attribute("p", "preview", number(0x80000000) + number(0x80000000)) + kEnd),
            "the preview claims 2147483648 x 2147483648 pixels in 8 bytes");
}

TEST(ExrHeader, RejectsHeadersThatDoNotEnd) {
  EXPECT_EQ(complaint(""), "the file ends in its header");
  EXPECT_EQ(complaint("own"), "the file ends in its header");
  EXPECT_EQ(complaint(attribute("owner", "string", "somebody")), "the file ends in its header");
  EXPECT_EQ(complaint(attribute("owner", "string", "somebody") + kEnd, 0x1002), "the file ends in its header");
  EXPECT_EQ(complaint(std::string(300, 'x') + kEnd), "a name is longer than 255 characters");
}

TEST(ExrHeader, LooksAtRegularFilesOnly) {
  const TemporaryFolder folder;
  const std::string pipe = folder.file("pipe.exr");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const auto& [path, message] :
       {std::pair{pipe, "cannot read " + pipe + ": not a regular file"},
        {folder.path().string(), "cannot read " + folder.path().string() + ": it is a folder"}}) {
    try {
      is_exr(path);
      ADD_FAILURE() << "accepts " << path;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kIo);
      EXPECT_EQ(error.what(), message);
    }
  }
  std::ofstream(folder.file("short")) << "\x76\x2f";
  EXPECT_FALSE(is_exr(folder.file("short")));
}

}  // namespace
}  // namespace covary
