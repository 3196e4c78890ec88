// SPDX-License-Identifier: Apache-2.0
// No command overwrites its inputs, writes one file twice, or gives a file a name that belies its content.
#include "film/outputs.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "film/image_writer.h"
#include "imageio/output_file.h"
#include "support/files.h"

namespace covary {
namespace {

namespace fs = std::filesystem;
using test_support::contains, test_support::message_of, test_support::test_file, test_support::test_folder;

TEST(Outputs, AnInputIsNoOutput) {
  const std::string path = test_file("a.exr"), link = test_file("link.exr"), hard = test_file("hard.exr");
  write_text_file(path, "film");
  fs::create_symlink("a.exr", link);
  fs::create_hard_link(path, hard);
  for (const std::string& other : {path, link, hard, (test_folder() / "." / "a.exr").string()}) {
    Outputs outputs;
    outputs.reads(path);
    EXPECT_EQ(message_of([&] { outputs.writes("-o", other, OutputKind::kFilm); }, ErrorCode::kUsage),
              "-o '" + other + "' is a file that the same command reads; give another name");
    Outputs in_the_other_order;
    in_the_other_order.writes("-o", other, OutputKind::kFilm);
    EXPECT_TRUE(contains(message_of(
                             [&] {
                               in_the_other_order.reads({test_file("b.exr"), path});
                             },
                             ErrorCode::kUsage),
                         "that the same command reads"));
  }
}

TEST(Outputs, AnInputThatIsMissingIsLeftToItsReader) {
  Outputs outputs;
  outputs.reads(test_file("missing.exr"));
  outputs.writes("-o", test_file("a.exr"), OutputKind::kFilm);
}

TEST(Outputs, TwoOutputsAreTwoFiles) {
  const std::string path = test_file("a.txt");
  fs::create_symlink(test_folder(), test_file("folder"));
  fs::create_symlink("a.txt", test_file("link.txt"));  // a dangling link
  for (const std::string& other : {path, test_file("folder/a.txt"), test_file("link.txt")}) {
    Outputs outputs;
    outputs.writes("--json", path, OutputKind::kText);
    EXPECT_EQ(message_of([&] { outputs.writes("--more", other, OutputKind::kText); }, ErrorCode::kUsage),
              "--json '" + path + "' and --more '" + other + "' are the same file");
  }
}

TEST(Outputs, SpecialFilesTakeAnything) {
  Outputs outputs;
  outputs.reads("/dev/null");
  outputs.writes("-o", "/dev/null", OutputKind::kFilm);
  outputs.writes("--json", "/dev/null", OutputKind::kText);
  const std::string pipe = test_file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  outputs.writes("--map", pipe, OutputKind::kPng);
  EXPECT_TRUE(contains(message_of([&] { outputs.writes("--other", pipe, OutputKind::kPng); }), "are the same file"));
}

TEST(Outputs, NamesSayWhatFilesHold) {
  Outputs outputs;
  const auto message = [&](const char* name, OutputKind kind) {
    return message_of([&] { outputs.writes("-o", test_file(name), kind); }, ErrorCode::kUsage);
  };
  for (const char* name : {"a.png", "a.exrr", "a", "a.exr.gz"})
    EXPECT_TRUE(contains(message(name, OutputKind::kFilm), "the name must end in .exr; 'covary convert' makes PNG"));
  EXPECT_TRUE(
      contains(message("a.bmp", OutputKind::kImage), "must end in .exr, .png, .hdr, .pfm, .jpg, .jpeg, .tif, .tiff"));
  EXPECT_TRUE(contains(message("a.jpg", OutputKind::kPng), "must end in .png"));
  EXPECT_TRUE(contains(message("a.exr", OutputKind::kPage), "must end in .html, .htm"));
  for (const char* name : {"a.exr", "a.JPG", "a.xml", "a.ply", "a.html"})
    EXPECT_TRUE(contains(message(name, OutputKind::kText), "names an image, a page or part of a scene; give -o=- for"));
  for (const char* name : {"a.EXR", "b.exr"}) EXPECT_EQ(message(name, OutputKind::kFilm), "no error");
  for (const char* name : {"a.json", "a", "a.txt"}) EXPECT_EQ(message(name, OutputKind::kText), "no error");
  outputs.writes("--json", "-", OutputKind::kText);
  outputs.writes("--json", "", OutputKind::kText);
}

TEST(Outputs, TheLastFolderIsMade) {
  const std::string folder = test_file("made");
  Outputs outputs;
  EXPECT_EQ(message_of([&] { outputs.writes("-o", folder + "/a.txt", OutputKind::kFilm); }, ErrorCode::kUsage),
            "-o '" + folder +
                "/a.txt': the name must end in .exr; 'covary convert' makes PNG, HDR, PFM, JPEG and TIFF of it");
  EXPECT_FALSE(fs::exists(folder)) << "nothing will be written";
  outputs.writes("-o", folder + "/a.exr", OutputKind::kFilm);
  EXPECT_TRUE(fs::is_directory(folder));
}

TEST(Outputs, SayBeforeTheWorkThatNothingCanBeWritten) {
  Outputs outputs;
  const char* path = "/nowhere/at/a.exr";
  EXPECT_TRUE(contains(message_of([&] { outputs.writes("-o", path, OutputKind::kFilm); }, ErrorCode::kIo),
                       "cannot write /nowhere/at/a.exr: no such folder /nowhere/at"));
  EXPECT_TRUE(contains(message_of([&] { outputs.writes("-o", test_folder(), OutputKind::kFilm); }, ErrorCode::kIo),
                       "it is a folder"));
}

TEST(Outputs, WriteProtectedFilesAreNotReplaced) {
  const std::string path = test_file("a.exr");
  write_text_file(path, "film");
  fs::permissions(path, fs::perms::owner_read | fs::perms::group_read);  // even for the superuser
  const std::string expected =
      "cannot write " + path + ": the file there is write-protected; give another name, or permit writing it";
  EXPECT_EQ(message_of([&] { Outputs().writes("-o", path, OutputKind::kFilm); }, ErrorCode::kIo), expected);
  EXPECT_EQ(message_of([&] { write_text_file(path, "another"); }, ErrorCode::kIo), expected);
  fs::permissions(path, fs::perms::owner_all);
  Outputs().writes("-o", path, OutputKind::kFilm);
}

TEST(Outputs, DerivedPicturesReplaceOnlyOnesOfOurs) {
  const std::string path = test_file("a.png");
  const auto message = [&] {
    Outputs outputs;
    return message_of([&] { outputs.writes_derived_png("the preview", path, "use --no-preview"); }, ErrorCode::kUsage);
  };
  EXPECT_EQ(message(), "no error");
  write_png(path, Image(2, 2, 3));
  EXPECT_EQ(message(), "no error");
  write_text_file(path, "another picture");
  EXPECT_EQ(message(), "the preview would replace '" + path + "', which covary did not make; use --no-preview");
  fs::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);  // must not be opened
  EXPECT_TRUE(contains(message(), "the preview would replace"));
}

TEST(Outputs, ResultsReplaceOnlyThoseOfTheirCommand) {
  const std::string exr = test_file("a.exr"), png = test_file("a.png"), video = test_file("a.mp4"),
                    tif = test_file("a.tif"), pfm = test_file("a.pfm");
  const Image image(2, 2, 3);
  const ImagePlace place{2, 2, {0, 0, 2, 2}};
  write_image(exr, image, place, {{"covary:command", "covary merge a.exr b.exr -o c.exr"}});
  for (const std::string& path : {png, tif, pfm}) write_image(path, image, place, {});
  write_text_file(video, std::string(1048570, 'x') + kMadeByCovary + "…");  // across two blocks of the search
  EXPECT_TRUE(is_made_by(exr, "merge"));
  EXPECT_FALSE(is_made_by(exr, "mer"));
  for (const std::string& path : {png, tif, video}) EXPECT_TRUE(is_made_by(path, "convert")) << path;
  EXPECT_FALSE(is_made_by(pfm, "convert"));  // the format has no place to say it
  Outputs outputs;
  EXPECT_EQ(
      message_of([&] { outputs.writes_result("-o", exr, OutputKind::kFilm, "denoise", false); }, ErrorCode::kUsage),
      "-o '" + exr +
          "' already exists, and 'covary denoise' did not make it; give another name, or --overwrite "
          "to replace it");
  Outputs().writes_result("-o", exr, OutputKind::kFilm, "denoise", true);
  Outputs().writes_result("-o", exr, OutputKind::kFilm, "merge", false);
  Outputs().writes_result("-o", test_file("new.exr"), OutputKind::kFilm, "denoise", false);
  Outputs().writes_result("-o", "/dev/null", OutputKind::kFilm, "denoise", false);
  write_text_file(video, "a film of holidays");
  EXPECT_FALSE(is_made_by(video, "convert"));
  write_text_file(exr, "damaged");
  EXPECT_FALSE(is_made_by(exr, "merge"));
}

TEST(Outputs, SameFiles) {
  const std::string path = test_file("a.exr"), link = test_file("link.exr"), copy = test_file("copy.exr");
  write_text_file(path, "film");
  write_text_file(copy, "film");
  fs::create_symlink("a.exr", link);
  EXPECT_TRUE(is_same_file(path, path));
  EXPECT_TRUE(is_same_file(path, link));
  EXPECT_FALSE(is_same_file(path, copy));
  EXPECT_FALSE(is_same_file("missing.exr", "missing.exr"));
}

}  // namespace
}  // namespace covary
