// SPDX-License-Identifier: Apache-2.0
// Files that do not belong together are detected by their attributes.
#include "metrics/provenance.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "imageio/output_file.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::test_file;

ImageFacts facts(const std::string& path, const std::map<std::string, std::string>& changes = {}) {
  ImageFacts result{path, path, {"openexr", "zip", {}, {{"B", "float"}, {"G", "float"}, {"R", "float"}}, {}}};
  result.info.attributes = {{"covary:seed", "1"},
                            {"covary:scene_hash", "abc"},
                            {"covary:sampling", "independent"},
                            {"covary:settings", "path max_depth=5; filter box radius=0.5"}};
  for (const auto& [key, value] : changes) result.info.attributes["covary:" + key] = value;
  return result;
}

/// All warnings for an image that differs from the reference (seed 9) in these attributes.
std::string warnings(const std::map<std::string, std::string>& changes) {
  return fmt::format("{}",
                     fmt::join(comparison_warnings(facts("a.exr", changes), facts("r.exr", {{"seed", "9"}})), "|"));
}

TEST(Provenance, NothingToSay) {
  EXPECT_EQ(warnings({}), "");
  EXPECT_EQ(warnings({{"settings", "path max_depth=5; filter box radius=0.5; polynomials dimensions=4 samples=9"}}),
            "");
  EXPECT_TRUE(comparison_warnings({"a.exr", "a.exr", {}}, facts("r.exr")).empty());
}

TEST(Provenance, SeedsInCommon) {
  EXPECT_EQ(warnings({{"seed", "9"}}),
            "a.exr and r.exr have seed 9 in common and so share samples, which makes errors between them wrong");
  EXPECT_TRUE(contains(warnings({{"seed", "3,9,10"}}), "have seed 9 in common"));
  EXPECT_EQ(warnings({{"seed", "99,19"}}), "");
  EXPECT_EQ(warnings({{"seed", "9"}, {"sampling", "crn"}}), "");
  EXPECT_TRUE(contains(warnings({{"seed", "9"}, {"sampling", ""}}), "have seed 9 in common"));  // of both passes
  const std::string sobol = " max_depth=5; filter box radius=0.5; sampler sobol";
  EXPECT_EQ(warnings({{"seed", "9"}, {"settings", "path" + sobol}}), "");
  EXPECT_TRUE(contains(warnings({{"seed", "9"}, {"settings", "bdpt light_tracing=on" + sobol}}),
                       "have seed 9 in common"));  // of light paths
}

TEST(Provenance, OtherScenesAndSettings) {
  EXPECT_TRUE(contains(warnings({{"scene_hash", "def"}}), "show different scenes, or versions of one"));
  EXPECT_EQ(warnings({{"settings", "path max_depth=6; filter box radius=0.5"}}),
            "a.exr and r.exr were rendered with different settings: 'path max_depth=6' and 'path max_depth=5'");
  EXPECT_EQ(warnings({{"settings", "path max_depth=5; filter tent radius=1"}}),
            "a.exr and r.exr were rendered with different pixel filters: 'tent radius=1' and 'box radius=0.5'");
  EXPECT_EQ(warnings({{"exposure", "-1"}}), "a.exr and r.exr have different exposures in stops: '-1' and '0'");
}

TEST(Provenance, Precision) {
  ImageFacts rounded{"a.png", "a.png", {"png", "", {}, {{"R", "uint8"}, {"G", "uint8"}, {"B", "uint8"}}, {}}};
  for (const auto& [a, b] : {std::pair{rounded, facts("r.exr")}, {facts("r.exr"), rounded}}) {
    const auto found = comparison_warnings(a, b);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_TRUE(contains(found[0], "differ in precision: a.png holds uint8 values, rounded and cut off at white"));
  }
  EXPECT_TRUE(comparison_warnings(rounded, rounded).empty());
  // Sample counts in a film are integers, but its colours are not.
  ImageFacts film = facts("a.exr");
  film.info.channels.push_back({"samples", "uint"});
  EXPECT_TRUE(comparison_warnings(film, facts("r.exr", {{"seed", "9"}})).empty());
}

TEST(Provenance, OneFileAsBoth) {
  const std::string path = test_file("a.exr"), link = test_file("link.exr");
  write_text_file(path, "image");
  std::filesystem::create_symlink("a.exr", link);
  EXPECT_EQ(comparison_warnings(facts(path), facts(link)),
            (std::vector<std::string>{path + " and " + link + " are the same file"}));
}

TEST(Provenance, ImagesOfFilmsAreNoFilms) {
  const std::vector<std::map<std::string, std::string>> one = {{{"covary:film", "1"},
                                                                {"covary:groups", "2"},
                                                                {"covary:checksums", ""},
                                                                {"covary:seed", "1"},
                                                                {"covary:samples", "4"},
                                                                {"covary:predicted_relmse", "0.1"},
                                                                {"covary:denoiser", "x"},
                                                                {"covary:frame", "y"},
                                                                {"owner", "somebody"}}};
  EXPECT_EQ(inherited_attributes(one),
            (std::map<std::string, std::string>{{"covary:seed", "1"}, {"covary:samples", "4"}}));
}

TEST(Provenance, ImagesOfSeveralFilesInheritWhatAllSay) {
  const std::vector<std::map<std::string, std::string>> files = {
      {{"covary:seed", "10,2"}, {"covary:settings", "path"}, {"covary:samples", "4"}, {"covary:scene_hash", "a"}},
      {{"covary:seed", "9"}, {"covary:settings", "path"}, {"covary:samples", "8"}}};
  EXPECT_EQ(inherited_attributes(files),
            (std::map<std::string, std::string>{{"covary:seed", "2,9,10"}, {"covary:settings", "path"}}));
}

}  // namespace
}  // namespace covary
