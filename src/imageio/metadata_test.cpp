// SPDX-License-Identifier: Apache-2.0
// Files as cameras and paint programs write them, with EXIF data and ICC profiles, opened by many threads at once in
// processes that have not opened one before: OpenImageIO 2.4 decodes both into shared tables without a lock (its issue
// 3756). Without our lock, 8 of 40 such processes crashed on two processors. Each profile holds tags unknown to
// OpenImageIO, which it adds to a table.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include <atomic>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "core/error.h"
#include "imageio/image_io.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::test_file;

constexpr int kFiles = 8;  // of each format
constexpr int kTags = 3000;

/// `value` as `n_bytes` bytes, big-endian.
std::string big_endian(uint32_t value, int n_bytes = 4) {
  std::string bytes;
  for (int i = n_bytes - 1; i >= 0; --i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

/// EXIF directories with camera make, EXIF version and GPS data, in Motorola (big-endian) byte order.
std::string exif() {
  const auto entry = [](uint32_t tag, uint32_t type, uint32_t count, const std::string& value) {
    return big_endian(tag, 2) + big_endian(type, 2) + big_endian(count) + value;
  };
  const uint32_t make = 50, details = make + 8, place = details + 18;
  return std::string("MM\0*", 4) + big_endian(8) + big_endian(3, 2) +                             //
         entry(0x010f, 2, 7, big_endian(make)) + entry(0x8769, 4, 1, big_endian(details)) +       //
         entry(0x8825, 4, 1, big_endian(place)) + big_endian(0) + std::string("Nobody\0\0", 8) +  //
         big_endian(1, 2) + entry(0x9000, 7, 4, "0230") + big_endian(0) +                         //
         big_endian(1, 2) + entry(0, 1, 4, std::string("\2\3\0\0", 4)) + big_endian(0);
}

/// A colour profile with tags that no other number's profile has.
std::string profile(int number) {
  std::string tags = big_endian(kTags);
  const uint32_t body = 128 + 4 + 12 * kTags;
  for (int i = 0; i < kTags; ++i)
    tags += big_endian(static_cast<uint32_t>(0x61000000 + number * kTags + i)) + big_endian(body) + big_endian(8);
  std::string head = big_endian(body + 8) + "none" + big_endian(0x02400000) + "mntrRGB XYZ ";
  head += std::string("\x07\xe4\0\1\0\2\0\3\0\4\0\5", 12) + "acspAPPL" + big_endian(0) + "nonenone" + big_endian(0) +
          big_endian(0) + big_endian(0) + big_endian(0xf6d6) + big_endian(0x10000) + big_endian(0xd32d);
  head.resize(128);
  return head + tags + "XYZ " + big_endian(0);
}

std::string packed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                     bytes.size()),
            Z_OK);
  result.resize(size);
  return result;
}

std::string png(int number) {
  const auto chunk = [](const std::string& type, const std::string& data) {
    const std::string body = type + data;
    const uLong checksum = crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    return big_endian(static_cast<uint32_t>(data.size())) + body + big_endian(static_cast<uint32_t>(checksum));
  };
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", big_endian(1) + big_endian(1) + std::string("\x08\2\0\0\0", 5)) +
         chunk("iCCP", std::string("p\0\0", 3) + packed(profile(number))) + chunk("eXIf", exif()) +
         chunk("IDAT", packed(std::string("\0abc", 4))) + chunk("IEND", "");
}

/// Inserts the metadata after the first marker of a JPEG file.
std::string jpeg(int number) {
  const std::vector<uint8_t> grey(3, 128);
  ImageToEncode image{1, 1};
  image.bytes = grey.data();
  const std::vector<unsigned char> plain = encode_image("jpg", image);
  const auto segment = [](char marker, const std::string& data) {
    return std::string("\xff") + marker + big_endian(static_cast<uint32_t>(data.size() + 2), 2) + data;
  };
  return std::string(plain.begin(), plain.begin() + 2) + segment('\xe1', std::string("Exif\0\0", 6) + exif()) +
         segment('\xe2', std::string("ICC_PROFILE\0\1\1", 14) + profile(number)) +
         std::string(plain.begin() + 2, plain.end());
}

/// Runs `work` in a new process; returns 0, or the status that waitpid() gives.
int end_of_process(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      work();
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      _exit(1);
    }
    _exit(0);
  }
  int status = -1;
  waitpid(child, &status, 0);
  return status;
}

/// Opens and reads all files at once.
void read_all(const std::vector<std::string>& paths) {
  std::atomic<size_t> waiting = 0, failed = 0;
  std::vector<std::thread> threads;
  for (const std::string& path : paths)
    threads.emplace_back([&] {
      for (++waiting; waiting < paths.size();) std::this_thread::yield();
      try {
        if (open_image(path)->read_bytes(0, 3).size() != 3) ++failed;
      } catch (const Error&) {
        ++failed;
      }
    });
  for (std::thread& thread : threads) thread.join();
  COVARY_CHECK(failed == 0, "every file is read");
}

TEST(Metadata, IsDecodedByOneThreadAtATime) {
  std::vector<std::string> paths;
  for (int i = 0; i < kFiles; ++i)
    for (const char* extension : {"png", "jpg"}) paths.push_back(test_file(std::to_string(i) + "." + extension));
  // This process must not load OpenImageIO, or its children would not start fresh.
  ASSERT_EQ(end_of_process([&] {
              for (size_t i = 0; i < paths.size(); ++i) {
                const int number = static_cast<int>(i);
                std::ofstream(paths[i], std::ios::binary) << (i % 2 == 0 ? png(number) : jpeg(number));
              }
            }),
            0);
  for (int process = 0; process < 20; ++process) ASSERT_EQ(end_of_process([&] { read_all(paths); }), 0) << process;
}

}  // namespace
}  // namespace covary
