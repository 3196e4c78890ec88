// SPDX-License-Identifier: Apache-2.0
// Layouts of several renderers, imitated here with the same channel names.
#include "combine/grouped_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "film/film_file.h"
#include "support/files.h"

namespace covary::grouped_file_test {
namespace {

constexpr int kWidth = 7, kHeight = 5;

float value(int image, int x, int y, int c) { return static_cast<float>(1000 * image + 100 * y + 10 * x + c); }

class GroupedFileTest : public ::testing::Test {
 protected:
  /// Writes a file whose layer i holds value(first + i, …).
  std::string write(const std::string& name, const std::vector<std::string>& layers, int first = 0,
                    const std::map<std::string, std::string>& attributes = {}, int width = kWidth) {
    std::vector<std::vector<float>> images;
    std::vector<ExrPlane> planes;
    for (size_t i = 0; i < layers.size(); ++i) {
      std::vector<float>& image = images.emplace_back();
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < width; ++x)
          for (int c = 0; c < 3; ++c) image.push_back(value(first + static_cast<int>(i), x, y, c));
    }
    for (size_t i = 0; i < layers.size(); ++i)
      for (size_t c = 0; c < 3; ++c)
        planes.push_back({fmt::format("{}{}{}", layers[i], layers[i].empty() ? "" : ".", "RGB"[c]),
                          ExrPlane::Type::kFloat, images[i].data() + c, 3 * sizeof(float)});
    std::string path = folder_.file(name);
    write_exr(path, {width, kHeight, {0, 0, width, kHeight}}, attributes, planes);
    return path;
  }

  void expect_groups(const GroupedFile& file, const std::vector<int>& images) {
    ASSERT_EQ(file.groups(), static_cast<int>(images.size()));
    for (const auto& [first, n] : {std::pair{0, kHeight}, {0, 2}, {2, 1}, {3, 2}}) {
      GroupedFile::Rows rows;
      file.read_rows(first, n, rows);
      const std::vector<float>& data = rows.data;
      ASSERT_EQ(data.size(), static_cast<size_t>(kWidth) * n * images.size() * 3);
      EXPECT_EQ(file.view(rows, n).counts, nullptr);
      size_t i = 0;
      for (int y = first; y < first + n; ++y)
        for (int x = 0; x < kWidth; ++x)
          for (int image : images)
            for (int c = 0; c < 3; ++c) ASSERT_EQ(data[i++], value(image, x, y, c)) << x << " " << y;
    }
  }

  std::string message(const std::vector<std::string>& paths, const std::string& layer = "",
                      const std::string& option = "--layer") {
    try {
      GroupedFile file(paths, layer, option);
      return "no error";
    } catch (const Error& e) {
      std::string text = e.what();
      for (size_t at; (at = text.find(folder_.file(""))) != std::string::npos;) text.erase(at, folder_.file("").size());
      return text;
    }
  }

  test_support::TemporaryFolder folder_;
};

TEST_F(GroupedFileTest, ReadsLayersInTheOrderOfTheirNumbers) {
  std::vector<std::string> layers = {""};
  for (int g = 0; g < 12; ++g) layers.push_back(fmt::format("group{}", g));  // group10 sorts before group2 in the file
  expect_groups(GroupedFile({write("film.exr", layers)}), {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
}

TEST_F(GroupedFileTest, ReadsOneFilePerGroup) {
  const std::vector<std::string> paths = {write("a.exr", {""}, 4), write("b.exr", {""}, 2), write("c.exr", {""}, 3)};
  expect_groups(GroupedFile(paths), {4, 2, 3});
}

TEST_F(GroupedFileTest, ReadsPassesOfOtherRenderers) {
  // Blender: multilayer; the picture is the pass "Combined".
  const std::vector<std::string> blender = {"ViewLayer.Combined", "ViewLayer.DiffCol", "ViewLayer.Emit"};
  expect_groups(GroupedFile({write("blender0.exr", blender, 0), write("blender1.exr", blender, 5)}), {0, 5});
  expect_groups(GroupedFile({write("blender0.exr", blender)}, "ViewLayer.Emit"), {2});
  // RenderMan.
  expect_groups(GroupedFile({write("renderman.exr", {"albedo", "Ci"})}), {1});
  // pbrt-v4 (GBufferFilm) and Mitsuba 3 (AOV integrator): R G B beside named images.
  expect_groups(GroupedFile({write("pbrt.exr", {"", "Albedo"}, 0)}), {0});
  expect_groups(GroupedFile({write("mitsuba.exr", {"", "nn"}, 0)}, "nn"), {1});
}

TEST_F(GroupedFileTest, TakesOnlyGroupsForGroups) {
  expect_groups(GroupedFile({write("only.exr", {"pass1", "pass2"})}), {0, 1});
  expect_groups(GroupedFile({write("lights.exr", {"", "light1", "light2"})}), {0});
  expect_groups(GroupedFile({write("lights.exr", {"", "light1", "light2"})}, "light"), {1, 2});
  expect_groups(GroupedFile({write("lights.exr", {"", "light1", "light2"})}, "light2"), {2});
  expect_groups(GroupedFile({write("mattes.exr", {"beauty", "uCryptoObject00", "uCryptoObject01"})}), {0});
  EXPECT_EQ(
      message({write("two.exr", {"uCryptoObject00", "uCryptoObject01"})}),
      "two.exr: no picture, only mattes (Cryptomatte); give the file that holds the picture, or choose a layer by "
      "--layer (layers: uCryptoObject00, uCryptoObject01; channels: uCryptoObject00.B uCryptoObject00.G "
      "uCryptoObject00.R uCryptoObject01.B uCryptoObject01.G uCryptoObject01.R)");
}

TEST_F(GroupedFileTest, ReadsAttributesOfFilms) {
  const std::map<std::string, std::string> attributes = {
      {"covary:samples", "24"}, {"covary:sampling", "crn"}, {"covary:scene_hash", "12ab"}};
  const GroupedFile one({write("film.exr", {"", "group00", "group01"}, 0, attributes)});
  EXPECT_EQ(one.samples(), 24);
  EXPECT_EQ(one.sampling(), "crn");
  EXPECT_EQ(one.scene_hash(), "12ab");
  EXPECT_FALSE(one.has_half());
  const GroupedFile two({write("a.exr", {""}, 0, attributes), write("b.exr", {""}, 0, attributes)});
  EXPECT_EQ(two.samples(), 48);
  EXPECT_EQ(GroupedFile({write("c.exr", {""})}).samples(), 0);
}

TEST_F(GroupedFileTest, ReadsTheCountsOfAFilm) {
  Film film(kWidth, kHeight, {0, 0, kWidth, kHeight}, 2);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int s = 0; s < 3 + (y == 2 ? x : 0); ++s) film.add(x, y, Spectrum(static_cast<float>(s)));
  const std::string path = folder_.file("counted.exr");
  write_film(path, film);
  const GroupedFile file({path});
  GroupedFile::Rows rows;
  file.read_rows(1, 3, rows);
  const GroupedImage image = file.view(rows, 3);
  ASSERT_NE(image.counts, nullptr);
  EXPECT_EQ(image.count(5, 0), 3u);
  EXPECT_EQ(image.count(5, 1), 8u);
  EXPECT_NEAR(image.mean_count, film.mean_count(), 1e-9) << "of the whole film, not of these rows";
}

TEST_F(GroupedFileTest, SaysWhatIsWrong) {
  const std::string two = write("two.exr", {"ambient", "depth"}), plain = write("plain.exr", {""});
  const std::string have = "(layers: ambient, depth; channels: ambient.B ambient.G ambient.R depth.B depth.G depth.R)";
  EXPECT_EQ(message({two}), "two.exr: no channels R G B; choose a layer by --layer " + have);
  EXPECT_EQ(message({two}, "", "--crn-layer"), "two.exr: no channels R G B; choose a layer by --crn-layer " + have);
  EXPECT_EQ(message({two}, "ambiant"), "two.exr: no layer 'ambiant'; did you mean 'ambient'? " + have);
  EXPECT_EQ(
      message({plain, write("groups.exr", {"", "group0", "group1"})}),
      "groups.exr: holds 2 groups of samples; give it alone, or files of one image each, or --layer for the image");
  EXPECT_EQ(message({plain, write("wide.exr", {""}, 0, {}, 9)}),
            "wide.exr: 9 x 5 pixels at (0, 0) of a frame of 9 x 5; plain.exr has 7 x 5 at (0, 0) of 7 x 5; render both "
            "with the same size and crop, without automatic cropping");
  EXPECT_EQ(
      message({write("a.exr", {""}, 0, {{"covary:samples", "8"}}), write("b.exr", {""}, 0, {{"covary:samples", "6"}})}),
      "b.exr: has 6 samples per pixel, a.exr 8; render all with the same number (in covary --spp)");
  const auto frame = [this](const char* name, const char* scene) {
    return write(name, {""}, 0, {{"covary:scene_hash", scene}});
  };
  EXPECT_EQ(message({frame("f9_008.exr", "1"), frame("f9_012.exr", "2")}),
            "f9_012.exr: scene_hash is '2', in f9_008.exr '1': other scenes, frames or cameras; if these are frames of "
            "a sequence, give 'f9_###.exr'");
  EXPECT_EQ(message({frame("a1.exr", "1"), frame("b2.exr", "2")}),
            "b2.exr: scene_hash is '2', in a1.exr '1': other scenes, frames or cameras");
  for (const char* samples : {"many", "12 or so", "-4", "nan", "1e30"})
    EXPECT_EQ(
        message({write("odd.exr", {""}, 0, {{"covary:samples", samples}})}),
        fmt::format("odd.exr: attribute covary:samples is '{}'; expected a number of samples per pixel", samples));
  std::vector<float> depth(kWidth * kHeight);
  const ExrPlane plane{"Z", ExrPlane::Type::kFloat, depth.data(), sizeof(float)};
  const std::string z = folder_.file("z.exr");
  write_exr(z, {kWidth, kHeight, {0, 0, kWidth, kHeight}}, {}, {&plane, 1});
  EXPECT_EQ(message({z}), "z.exr: no channels R G B; choose a channel by --layer, such as 'Z' (channels: Z)");
}

}  // namespace
}  // namespace covary::grouped_file_test
