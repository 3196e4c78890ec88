// SPDX-License-Identifier: Apache-2.0
// Papers as data: what the built-in ones name exists, parts are chosen, missing scenes are told and replaced.
#include "papers/paper.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "papers/paper_report.h"
#include "support/files.h"

namespace covary::lab {
namespace {

namespace fs = std::filesystem;
using test_support::contains, test_support::message_of, test_support::TemporaryFolder;

Paper builtin_paper(const std::string& name) { return parse_paper(std::string(builtin_papers().at(name)), name); }

/// A folder with empty files of these names.
void touch(const fs::path& folder, const std::vector<std::string>& files) {
  for (const std::string& file : files) {
    fs::create_directories((folder / file).parent_path());
    std::ofstream(folder / file) << "\n";
  }
}

std::vector<std::string> names_of(const std::vector<SceneEntry>& scenes) {
  std::vector<std::string> names;
  for (const SceneEntry& scene : scenes) names.push_back(scene.name);
  return names;
}

TEST(Paper, AllPartsOfTheBuiltInOnesCanBeRun) {
  ASSERT_EQ(builtin_papers().size(), 3u);
  for (const auto& [name, text] : builtin_papers())
    for (const bool quick : {false, true}) {
      Overrides overrides;
      if (quick) overrides.quick.emplace();
      const Paper paper = builtin_paper(name);
      for (const PreparedPart& part : prepare_parts(paper, {}, "", "scenes", overrides)) {
        EXPECT_TRUE(validate(part.suite).empty()) << name << ", " << part.part.names[0];
        EXPECT_FALSE(part.part.published.empty()) << name << ", " << part.part.names[0];
        if (quick) {
          EXPECT_LE(part.suite.seeds.size(), 2u);
          EXPECT_LE(part.suite.budgets.back().seconds, 3);
        }
      }
    }
}

TEST(Paper, MissingScenesAreLeftOutAndAllOfThemReplaced) {
  const TemporaryFolder folder;
  touch(folder.path(), {"kitchen/scene_v3.xml", "house/scene_v3.xml"});
  touch(folder.path() / "own", {"room.xml"});
  const Paper paper = builtin_paper("iicv");
  const auto parts =
      prepare_parts(paper, {"fig8", "fig12"}, folder.path().string(), (folder.path() / "own").string(), {});
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(names_of(parts[0].suite.scenes), (std::vector<std::string>{"house", "kitchen"}));
  EXPECT_EQ(parts[0].missing.size(), 8u);
  EXPECT_FALSE(parts[0].own_scenes);
  EXPECT_FALSE(parts[0].suite.published_ratio.empty());
  EXPECT_EQ(parts[1].part.names, (std::vector<std::string>{"fig2", "fig12"}));
  EXPECT_TRUE(parts[1].own_scenes);
  EXPECT_EQ(names_of(parts[1].suite.scenes), (std::vector<std::string>{"room", "materials", "veil"}));
  EXPECT_EQ(parts[1].suite.scenes[0].file, (folder.path() / "own" / "room.xml").string());
}

TEST(Paper, ScenesInPlaceOfOthersHaveAllLayersAndNothingPublished) {
  const auto parts = prepare_parts(builtin_paper("controlled-mixtures"), {"fig7", "table1"}, "", "nowhere", {});
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_TRUE(parts[0].suite.published_ratio.empty());
  EXPECT_TRUE(parts[0].suite.published_source.empty());
  ASSERT_EQ(parts[1].suite.scenes.size(), 3u * 4);
  EXPECT_EQ(parts[1].suite.scenes[1].name, "room, Edges03");
  EXPECT_EQ(parts[1].suite.scenes[1].layer, "Edges03");
}

TEST(Paper, ScenesAndMethodsAreChosenWherePartsHaveThem) {
  const TemporaryFolder folder;
  touch(folder.path(), {"kitchen/scene_v3.xml", "house/scene_v3.xml", "teapot/scene_v3.xml"});
  const Paper paper = builtin_paper("iicv");
  const std::string scenes = folder.path().string();
  Overrides overrides;
  overrides.scenes = {"teapot"};
  overrides.methods = {"polynomials"};
  const auto parts = prepare_parts(paper, {}, scenes, "nowhere", overrides);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].part.names[0], "fig10");
  EXPECT_EQ(names_of(parts[0].suite.scenes), (std::vector<std::string>{"teapot"}));
  EXPECT_EQ(parts[0].suite.methods.size(), 2u) << "with the baseline";
  overrides.methods = {"polynomial"};
  EXPECT_EQ(message_of([&] { prepare_parts(paper, {}, scenes, "nowhere", overrides); }, ErrorCode::kUsage),
            "no part of the paper has a method 'polynomial'");
  overrides = {};
  overrides.scenes = {"staircase"};
  EXPECT_TRUE(contains(message_of([&] { prepare_parts(paper, {}, scenes, "nowhere", overrides); }),
                       "no part of the paper has a scene that is at hand"));
  EXPECT_TRUE(contains(message_of([&] { prepare_parts(paper, {"tabel1"}, scenes, "nowhere", {}); }),
                       "--only: 'iicv' has no part 'tabel1'; did you mean 'table1'"));
}

TEST(Paper, QuickTakesAllScenesThatAreNamed) {
  const TemporaryFolder folder;
  Overrides overrides;
  overrides.quick.emplace();
  std::vector<std::string> files;
  const Paper paper = builtin_paper("iicv");
  const std::vector<PreparedPart> without = prepare_parts(paper, {"table1"}, "", "nowhere", {});
  for (const SceneEntry& scene : without[0].missing) files.push_back(scene.file);
  ASSERT_EQ(files.size(), 10u);
  touch(folder.path(), files);
  const auto scenes = [&] {
    return names_of(prepare_parts(paper, {"table1"}, folder.path().string(), "nowhere", overrides)[0].suite.scenes);
  };
  EXPECT_EQ(scenes().size(), 4u);
  overrides.scenes = {"teapot"};  // not among these
  EXPECT_EQ(scenes(), overrides.scenes);
  overrides.scenes = {"bathroom2", "house", "kitchen", "staircase", "teapot"};
  EXPECT_EQ(scenes(), overrides.scenes);
}

TEST(Paper, MistakesAreToldAllAtOnce) {
  const std::string text = R"({"name": "a", "title": "A", "own_scenes": "quick", "parts": [
    {"names": ["x"], "title": "X", "suite": "nothing", "quick": {"seed": 1}},
    {"names": ["x"], "title": "Y", "suite": "quick"}]})";
  const std::string message = message_of([&] { parse_paper(text, "a.json"); }, ErrorCode::kInput);
  EXPECT_TRUE(contains(message, "no suite is named 'nothing'")) << message;
  EXPECT_TRUE(contains(message, "seed")) << message;
  EXPECT_TRUE(contains(message, "two parts have the name 'x'")) << message;
}

Results results_of(const std::string& title) {
  Results results;
  results.suite.name = "tiny";
  results.suite.title = title;
  return results;
}

TEST(PaperReport, JoinsPartsWithNamesOfTheirOwn) {
  Paper paper;
  paper.name = "a", paper.title = "A paper";
  PreparedPart part;
  part.part.names = {"fig1", "fig2"}, part.part.title = "Fig. 1", part.part.published = {"a gain of 2"};
  part.missing = {{"kitchen"}};
  PaperReport report(paper);
  for (const char* name : {"fig1", "table1"}) {
    part.part.names[0] = name;
    nlohmann::ordered_json scene{{"name", "room"}, {"images", {{{"name", "pt"}, {"image", "s0"}, {"flip", "s0flip"}}}}};
    nlohmann::ordered_json document{{"meta", {{"Version", "1"}, {"Suite", "tiny"}}},
                                    {"sections",
                                     {{{"id", "images"},
                                       {"heading", "Images"},
                                       {"blocks", {{{"type", "comparer"}, {"id", "images"}, {"scenes", {scene}}}}}}}}};
    document["meta"] = nlohmann::ordered_json::array({{"Version", "1"}, {"Suite", "tiny"}});
    report.add(part, results_of(name), document, {{"s0", Image(2, 2, 3)}, {"s0flip", Image(2, 2, 1)}});
  }
  const TemporaryFolder folder;
  const std::string page = (folder.path() / "report.html").string();
  EXPECT_NO_THROW(write_report(page, report.document(), report.pictures())) << "all ids are known and differ";
  const auto document = report.document();
  ASSERT_EQ(document["sections"].size(), 5u);
  EXPECT_EQ(document["sections"][1]["id"], "fig1");
  EXPECT_EQ(document["sections"][1]["text"][0], "Published: a gain of 2");
  EXPECT_EQ(document["sections"][1]["blocks"][0]["items"][0], "Missing scenes: kitchen.");
  EXPECT_EQ(document["sections"][4]["heading"], "table1: Images");
  EXPECT_EQ(document["meta"].size(), 1u) << "what is the same for all";
  EXPECT_EQ(report.data()["parts"][1]["names"][0], "table1");
}

}  // namespace
}  // namespace covary::lab
