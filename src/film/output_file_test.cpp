// SPDX-License-Identifier: Apache-2.0
// Files appear complete or not at all.
#include "imageio/output_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <thread>

#include "film/film_file.h"
#include "film/image_writer.h"
#include "support/files.h"

namespace covary {
namespace {

namespace fs = std::filesystem;
using test_support::contains, test_support::message_of, test_support::test_file, test_support::test_folder;

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

size_t n_files(const fs::path& folder) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// While it exists, files cannot grow beyond `bytes`, as if the disk were full.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_;
  sighandler_t handler_;
};

TEST(OutputFile, AppearsOnlyWhenCommitted) {
  const std::string path = test_file("a.txt");
  {
    OutputFile file(path);
    file.write("abc", 3);
    EXPECT_FALSE(fs::exists(path));
    EXPECT_EQ(n_files(test_folder()), 1u);  // the temporary one
  }
  EXPECT_EQ(n_files(test_folder()), 0u);
  write_text_file(path, "old");
  {
    OutputFile file(path);
    file.write("newer", 5);
    EXPECT_EQ(content(path), "old");
    file.commit();
  }
  EXPECT_EQ(content(path), "newer");
  EXPECT_EQ(n_files(test_folder()), 1u);
}

TEST(OutputFile, FollowsSymbolicLinks) {
  const std::string path = test_file("target.txt"), link = test_file("link.txt");
  write_text_file(path, "old");
  fs::create_symlink("target.txt", link);
  write_text_file(link, "new");
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(content(path), "new");
}

TEST(OutputFile, FollowsALinkToAFileThatIsNotThereYet) {
  const fs::path folder = test_file("folder");
  const std::string first = test_file("first.txt"), second = (folder / "second.txt").string();
  fs::create_directory(folder);
  fs::create_symlink("folder/second.txt", first);
  fs::create_symlink("../target.txt", second);
  write_text_file(first, "new");
  EXPECT_TRUE(fs::is_symlink(first));
  EXPECT_TRUE(fs::is_symlink(second));
  EXPECT_EQ(content(test_file("target.txt")), "new");
}

TEST(OutputFile, RefusesALoopOfLinks) {
  const std::string path = test_file("loop.txt");
  fs::create_symlink("loop.txt", path);
  EXPECT_TRUE(contains(message_of([&] { OutputFile{path}; }), "a symbolic link that leads nowhere"));
}

TEST(OutputFile, SendsEverythingToSpecialFiles) {
  write_text_file("/dev/null", "lost");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_TRUE(
      contains(message_of([] { write_text_file("/dev/full", "abc"); }), "cannot write /dev/full: No space left"));

  const std::string pipe = test_file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::string received;
  std::thread reader([&] { received = content(pipe); });
  Film film(16, 9, {0, 0, 16, 9}, 1);
  write_film(pipe, film);  // EXR files are not written sequentially
  reader.join();
  write_film(test_file("film.exr"), film);
  EXPECT_EQ(received, content(test_file("film.exr")));
  EXPECT_TRUE(fs::is_fifo(pipe));
}

TEST(OutputFile, WritesIntoTheFileThatIsStandardOutput) {
  const std::string path = test_file("log.txt");
  std::fflush(stdout);
  const int before = dup(STDOUT_FILENO), log = open(path.c_str(), O_CREAT | O_WRONLY, 0600);
  dup2(log, STDOUT_FILENO);
  std::fputs("first, ", stdout);
  write_text_file("/dev/stdout", "second, ");
  write_text_file(path, "third");
  dup2(before, STDOUT_FILENO);
  close(before), close(log);
  EXPECT_EQ(content(path), "first, second, third");
}

TEST(OutputFile, SaysWhyItCannotWrite) {
  EXPECT_TRUE(
      contains(message_of([] { OutputFile("/nowhere/a.exr"); }), "cannot write /nowhere/a.exr: no such folder"));
  EXPECT_TRUE(contains(message_of([] { OutputFile(test_folder().string()); }), ": it is a folder"));
  EXPECT_TRUE(contains(message_of([] { OutputFile(""); }), "it names no file"));
  EXPECT_TRUE(
      contains(message_of([] { OutputFile("/proc/self/covary.exr"); }), "cannot write /proc/self/covary.exr: "));
}

// The limit takes effect in the header, amid the pixels, and in OpenEXR's last write, whose failure OpenEXR hides.
TEST(OutputFile, AFullDiskLeavesTheOldFile) {
  Film film(64, 64, {0, 0, 64, 64}, 2);
  for (size_t i = 0; i < film.data().size(); ++i) film.data()[i] = static_cast<float>((i * 2654435761u) % 65537);
  const std::string path = test_file("film.exr"), png = test_file("image.png");
  write_film(path, film);
  const std::string before = content(path);
  const size_t size = before.size();
  for (size_t limit : {size_t{0}, size_t{10}, size_t{700}, size / 2, size - 1}) {
    const FullDisk disk(limit);
    EXPECT_TRUE(contains(message_of([&] { write_film(path, film); }), "cannot write " + path + ": File too large"))
        << limit;
    EXPECT_EQ(content(path), before);
    EXPECT_EQ(n_files(test_folder()), 1u);
  }
  {
    const FullDisk disk(100);
    EXPECT_TRUE(contains(message_of([&] { write_png(png, film.mean_image()); }), "cannot write " + png));
    EXPECT_EQ(n_files(test_folder()), 1u);
  }
  const FullDisk disk(size);
  write_film(path, film);
  EXPECT_EQ(content(path), before);
}

}  // namespace
}  // namespace covary
