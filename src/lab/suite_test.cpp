// SPDX-License-Identifier: Apache-2.0
// Suite files: what is read, and that every mistake is reported with its line, all at once.
#include "lab/suite.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "support/files.h"

namespace covary::lab {
namespace {

using test_support::contains, test_support::message_of;

const char* const kSuite = R"({
  "name": "small",
  "title": "A small one",
  "scene_root": "scenes",
  "scenes": [
    {"name": "room", "file": "room.xml", "resolution": "96x64", "max_depth": -1, "defines": ["spp=4"],
     "credit": "ours", "layer": "N", "insets": [{"x": 1, "y": 2, "w": 3, "h": 4}]},
    {"name": "wall", "file": "wall.xml", "crop": "8x8", "reference": {"files": ["a.exr", "b.exr"]}}
  ],
  "methods": [
    {"name": "pt", "options": ["--estimator", "none"], "unbiased": true},
    {"name": "clean", "options": [], "then": [["denoise", "--fast"]]}
  ],
  "budgets": [{"spp": 24}, {"seconds": 0.5}],
  "seeds": 3,
  "common_options": ["--rfilter", "box"],
  "baseline": "pt",
  "show": {"spp": 24},
  "reference": {"spp": 64},
  "published": {"source": "somewhere", "relmse": {"room": {"pt": {"24": 0.5}}}}
})";

TEST(Suite, OwnScenesThatAreNotThere) {
  const test_support::TemporaryFolder folder;
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  const std::string message = message_of([] { own_scenes_folder("/nowhere/at/all/covary"); });
  std::filesystem::current_path(before);
  EXPECT_TRUE(contains(message, "run the command where the folder 'scenes' of its source tree is")) << message;
}

TEST(Suite, ReadsEverything) {
  const Suite suite = parse_suite(kSuite, "small.json");
  EXPECT_EQ(suite.scenes.size(), 2u);
  EXPECT_EQ(suite.scenes[0].max_depth, -1);
  EXPECT_EQ(suite.scenes[0].layer, "N");
  EXPECT_EQ(suite.scenes[0].insets[0], (CropWindow{1, 2, 3, 4}));
  EXPECT_EQ(suite.reference_of(suite.scenes[0]).spp, 64u);
  EXPECT_EQ(suite.reference_of(suite.scenes[1]).files, (std::vector<std::string>{"a.exr", "b.exr"}));
  EXPECT_EQ(suite.methods[1].then, (std::vector<std::vector<std::string>>{{"denoise", "--fast"}}));
  EXPECT_TRUE(suite.methods[0].unbiased);
  EXPECT_EQ(suite.budgets[0].label(), "24 spp");
  EXPECT_EQ(suite.budgets[1].label(), "0.5 s");
  EXPECT_EQ(suite.seeds, (std::vector<uint64_t>{1, 2, 3}));
  EXPECT_EQ(suite.published_relmse.at("room").at("pt").at("24"), 0.5);
  EXPECT_TRUE(validate(suite).empty());
}

TEST(Suite, WrittenAndReadAgainIsTheSame) {
  const nlohmann::ordered_json json = to_json(parse_suite(kSuite, "small.json"));
  EXPECT_EQ(to_json(parse_suite(json.dump(2), "again.json")), json);
}

TEST(Suite, BuiltInSuitesAreRight) {
  EXPECT_GE(builtin_suites().size(), 10u);
  for (const auto& [name, text] : builtin_suites()) {
    Suite suite = parse_suite(std::string(text), name);
    EXPECT_EQ(suite.name, name);
    if (suite.scenes.empty()) suite.scenes.push_back({"scene", "scene.xml"});  // a template
    EXPECT_EQ(validate(suite), std::vector<std::string>{}) << name;
    for (const SceneEntry& scene : suite.scenes)
      EXPECT_TRUE(name == "compare" || !scene.credit.empty()) << name << ", " << scene.name;
  }
}

TEST(Suite, MethodsMayBeOptional) {
  const Suite suite = parse_suite(R"({"name": "x", "methods": [{"name": "a"}, {"name": "b", "optional": true}]})", "x");
  EXPECT_FALSE(suite.methods[0].optional);
  EXPECT_TRUE(suite.methods[1].optional);
  EXPECT_EQ(to_json(suite)["methods"][1]["optional"], true);
  EXPECT_TRUE(
      contains(message_of([] { parse_suite(R"({"name": "x", "methods": [{"name": "a", "optional": 1}]})", "x"); }),
               "methods[0].optional: expected true or false, found 1"));
}

TEST(Suite, ReportsAllMistakesWithTheirLines) {
  const std::string message = message_of([] {
    parse_suite(R"({
  "name": "x",
  "scenes": [{"name": "room", "flie": "room.xml"}],
  "methods": [
    {"name": "a", "options": "--k 5"},
    {"name": "b", "then": ["denoise"]}
  ],
  "budgets": [{"spp": 24, "seconds": 3}, {"spp": 0}],
  "seeds": "ten",
  "referenec": {"spp": 4}
})",
                "bad.json");
  });
  for (const char* part :
       {"bad.json:3: scenes[0]: lacks 'file'", "bad.json:3: scenes[0].flie: unknown key; did you mean 'file'",
        "bad.json:5: methods[0].options: expected a list of texts, found \"--k 5\"",
        "bad.json:6: methods[1].then: expected a list of commands",
        "bad.json:8: budgets[0]: expected either 'spp' or 'seconds'",
        "bad.json:8: budgets[1].spp: expected a whole number from 1 to 1073741824, found 0",
        "bad.json:9: seeds: expected a number of seeds or a list of at most 100000 seeds, found \"ten\"",
        "bad.json:10: referenec: unknown key; did you mean 'reference'"})
    EXPECT_TRUE(contains(message, part));
}

TEST(Suite, CommonOptionsHaveNoEstimator) {
  Suite suite = parse_suite(kSuite, "suite.json");
  for (const char* option : {"--estimator", "--estimator=none"}) {
    suite.common_options = {option, "--rfilter", "box"};
    EXPECT_EQ(validate(suite),
              std::vector<std::string>{"common_options: '--estimator' belongs to methods; references are plain means"});
  }
}

TEST(Suite, ReportsWhatIsNotJson) {
  EXPECT_TRUE(contains(message_of([] { parse_suite("{\n  \"name\": \"x\",\n  oops\n}", "bad.json"); }), "bad.json:3:"));
  EXPECT_TRUE(contains(message_of([] { parse_suite("{\"name\": 1,\n\"name\": 2}", "bad.json"); }),
                       "bad.json:2: the key 'name' appears twice"));
  EXPECT_TRUE(contains(message_of([] { parse_suite("[]", "bad.json"); }), "bad.json:1: expected an object"));
}

TEST(Suite, ReportsNumbersThatDoNotFit) {
  const std::string message = message_of([] {
    parse_suite(R"({
  "name": "x", "scenes": [{"name": "r", "file": "r.xml", "max_depth": 18446744073709551615}],
  "methods": [{"name": "a"}],
  "budgets": [{"spp": 4294967297}],
  "seeds": 4000000000,
  "reference": {"spp": 99999999999999999999}
})",
                "bad.json");
  });
  for (const char* part :
       {"bad.json:2: scenes[0].max_depth: expected a whole number from -1 to 2147483647, found 18446744073709551615",
        "bad.json:4: budgets[0].spp: expected a whole number from 1 to 1073741824, found 4294967297",
        "bad.json:5: seeds: expected 1 to 100000 seeds, found 4000000000",
        "bad.json:6: reference.spp: expected a whole number from 1 to 1073741824, found 1e+20"})
    EXPECT_TRUE(contains(message, part));
}

TEST(Suite, ReportsDeepNesting) {
  EXPECT_EQ(message_of([] { parse_suite("{\n\"a\":" + std::string(200000, '['), "bad.json"); }),
            "bad.json:2: arrays and objects nest deeper than 64");
}

TEST(Suite, ShortensLongValuesInMessages) {
  const std::string message =
      message_of([] { parse_suite("{\"name\": [\"" + std::string(10000, 'x') + "\"]}", "bad.json"); });
  EXPECT_TRUE(contains(message, "bad.json:1: name: expected a text, found [\"xxxx"));
  EXPECT_LT(message.size(), 1000u);
}

TEST(Suite, ValidatesAsAWhole) {
  Suite suite = parse_suite(kSuite, "small.json");
  suite.seeds = {1, 1, kReferenceSeeds[1]};
  suite.baseline = "ptt";
  suite.methods[1].options = {"--seed", "3", "--spp=9"};
  suite.show = Budget{25, 0};
  suite.reference = {};
  suite.published_ratio["room"]["iicvv"]["24"] = 2;
  std::string all;
  for (const std::string& problem : validate(suite)) all += problem + "\n";
  for (const char* part : {"the seed 1 appears twice", "the seed 900000002 is reserved for references",
                           "no method is named 'ptt'; did you mean 'pt'", "method 'clean': '--seed' is chosen by",
                           "method 'clean': '--spp' is chosen by", "show: 25 spp is not one of the budgets",
                           "scene 'room' has no reference", "published: no method is named 'iicvv'"})
    EXPECT_TRUE(contains(all, part));
}

/// Built-in suites find their scenes in the source tree, and next to the program if it is installed.
TEST(Suite, KnowsWhereItsScenesLie) {
  namespace fs = std::filesystem;
  const fs::path tree = test_support::test_folder();
  for (const char* made : {"bin", "share/covary/scenes"}) fs::create_directories(tree / made);
  std::ofstream(tree / "share/covary/scenes/installed.xml") << "<scene/>";
  Suite suite = parse_suite(kSuite, "small.json");
  Suite of_scene;
  of_scene.scenes.emplace_back().file = "/somewhere/own.pbrt";
  EXPECT_EQ(scenes_folder(of_scene, "own.pbrt", "/nowhere/covary"), std::filesystem::current_path().string());
  const auto found = [&](const std::string& word) { return scenes_folder(suite, word, tree / "bin/covary"); };
  suite.scenes[0].file = "installed.xml";
  EXPECT_EQ(found("elsewhere/small.json"), fs::current_path() / "elsewhere/scenes");
  EXPECT_EQ(found("any.xml"), fs::current_path());
  EXPECT_EQ(found("small"), tree / "share/covary/scenes");
  suite.scenes[0].file = "missing.xml";
  EXPECT_TRUE(contains(message_of([&] { found("small"); }),
                       "the suite 'small' needs --scenes DIR, the folder that holds missing.xml"));
}

}  // namespace
}  // namespace covary::lab
