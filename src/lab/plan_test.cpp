// SPDX-License-Identifier: Apache-2.0
// Plans: pixels, command lines, sharing of passes, and overrides of a suite's settings.
#include "lab/plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "core/shell_text.h"
#include "lab/overrides.h"
#include "support/files.h"

namespace covary::lab {
namespace {

using test_support::contains, test_support::message_of;

Suite two_methods() {
  Suite suite;
  suite.name = "test";
  suite.scenes = {{"room", "room.xml"}};
  suite.methods = {{"pt", {"--estimator", "none"}, {}, true}, {"iicv", {}, {}, false}};
  suite.budgets = {{24, 0}, {48, 0}};
  suite.seeds = {1, 2};
  suite.common_options = {"--rfilter", "box"};
  suite.baseline = "pt";
  suite.reference.spp = 64;
  return suite;
}

/// Names of estimators do not change the passes; other options do.
std::vector<std::string> all_but_estimator(const std::vector<std::string>& options) {
  if (!options.empty() && options[0] == "--estimator") return {options.begin() + 2, options.end()};
  return options;
}
const PlanContext kContext{"1.0", all_but_estimator};

SceneInstance instance(SceneEntry entry = {"room", "room.xml"}, int width = 640, int height = 480,
                       int64_t max_pixels = 0) {
  SceneInstance scene{std::move(entry), "room.xml", "hash"};
  place(scene, width, height, max_pixels);
  return scene;
}

TEST(Plan, PlacesFramesAndCrops) {
  SceneEntry entry{"room", "room.xml"};
  EXPECT_EQ(instance(entry).window, (CropWindow{0, 0, 640, 480}));
  entry.crop = "10,20,30,40";
  EXPECT_EQ(instance(entry).window, (CropWindow{10, 20, 30, 40}));
  entry.crop = "100x50";
  EXPECT_EQ(instance(entry).window, (CropWindow{270, 215, 100, 50}));
  entry.resolution = "200x100";
  EXPECT_EQ(instance(entry).window, (CropWindow{50, 25, 100, 50}));
  for (const char* crop : {"100", "1,2,3", "1x2x3", "-1,0,5,5", "200,0,1,1", "0,0,0,5", "300x10", ""}) {
    entry.crop = crop;
    const std::string message = message_of([&] { instance(entry); });
    EXPECT_TRUE(contains(message, *crop ? std::string("scene 'room': crop '") + crop : "no error"));
  }
  entry.resolution = "0x5";
  EXPECT_TRUE(contains(message_of([&] { instance(entry); }), "resolution '0x5': expected WIDTHxHEIGHT"));
}

TEST(Plan, ScalesDownWhatTheSuiteDoesNotSize) {
  EXPECT_EQ(instance({"room", "room.xml"}, 1280, 720, 32400).entry.resolution, "240x135");
  EXPECT_EQ(instance({"room", "room.xml"}, 100, 50, 32400).entry.resolution, "");
  SceneEntry cropped{"room", "room.xml"};
  cropped.crop = "600x400";
  EXPECT_EQ(instance(cropped, 1280, 720, 32400).window, (CropWindow{340, 160, 600, 400}));
}

TEST(Plan, CommandLinesAreWhatAUserTypes) {
  Suite suite = two_methods();
  suite.scenes[0].max_depth = -1;
  suite.scenes[0].defines = {"spp=3"};
  suite.methods[1].options = {"--k", "9"};
  const auto runs = runs_of_scene(suite, 0, instance(suite.scenes[0]), kContext);
  EXPECT_EQ(shell_text(runs[1].options),
            "-D spp=3 --crop 0,0,640,480 --max-depth -1 --rfilter box --k 9 --spp 24 --seed 1");
  suite.budgets = {{0, 2.5}};
  EXPECT_TRUE(contains(shell_text(runs_of_scene(suite, 0, instance(), kContext)[0].options), "--time 2.5 --seed 1"));
}

TEST(Plan, SeedsAreOutermost) {
  const auto runs = runs_of_scene(two_methods(), 0, instance(), kContext);
  ASSERT_EQ(runs.size(), 8u);
  for (size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(runs[i].seed, i / 4 + 1);
    EXPECT_EQ(runs[i].budget, i / 2 % 2);
    EXPECT_EQ(runs[i].method, i % 2);
  }
}

/// Which passes methods with these options use at one budget and seed, numbered in order of appearance.
std::vector<int> sharing(const std::vector<std::vector<std::string>>& options, double seconds = 0) {
  Suite suite = two_methods();
  suite.methods.clear();
  for (const auto& words : options) suite.methods.push_back({std::to_string(suite.methods.size()), words, {}, false});
  suite.seeds = {1};
  suite.budgets = {seconds > 0 ? Budget{0, seconds} : Budget{24, 0}};
  const auto runs = runs_of_scene(suite, 0, instance(), kContext);
  std::vector<std::string> keys;
  std::vector<int> result(options.size());
  for (const Run& run : runs) {
    auto known = std::find(keys.begin(), keys.end(), run.passes_key);
    if (known == keys.end()) known = keys.insert(keys.end(), run.passes_key);
    EXPECT_EQ(known, keys.end() - 1) << "runs that share passes must follow one another";
    result[run.method] = static_cast<int>(known - keys.begin());
  }
  return result;
}

TEST(Plan, RunsShareThePassesTheyHaveInCommon) {
  EXPECT_EQ(sharing({{}, {"--groups", "4"}, {"--estimator", "iduw"}, {"--estimator", "iduw", "--groups", "4"}}),
            (std::vector<int>{0, 1, 0, 1}));
  // The number of samples in a time budget depends on the method.
  EXPECT_EQ(sharing({{}, {"--estimator", "iduw"}}, 10), (std::vector<int>{0, 1}));
}

TEST(Plan, KeysDependOnEverythingThatMatters) {
  const Suite suite = two_methods();
  const auto key = [](const Suite& s, const SceneInstance& scene, const PlanContext& context) {
    return runs_of_scene(s, 0, scene, context)[1].key;
  };
  const std::string base = key(suite, instance(), kContext);
  EXPECT_EQ(key(suite, instance(), kContext), base);
  std::vector<std::string> others;
  SceneInstance scene = instance();
  scene.hash = "another";
  others.push_back(key(suite, scene, kContext));
  scene = instance();
  scene.window.x = 1;
  others.push_back(key(suite, scene, kContext));
  PlanContext context = kContext;
  context.program_version = "1.1";
  others.push_back(key(suite, instance(), context));
  Suite changed = suite;
  changed.methods[1].options = {"--paper"};
  others.push_back(key(changed, instance(), kContext));
  changed = suite;
  changed.methods[1].then = {{"denoise"}};
  others.push_back(key(changed, instance(), kContext));
  changed = suite;
  changed.seeds[0] = 5;
  others.push_back(key(changed, instance(), kContext));
  changed = suite;
  changed.budgets[0].spp = 25;
  others.push_back(key(changed, instance(), kContext));
  others.push_back(base);
  std::sort(others.begin(), others.end());
  EXPECT_EQ(std::unique(others.begin(), others.end()), others.end());
}

TEST(Plan, ReferencesHaveSeedsOfTheirOwn) {
  const auto halves = reference_runs(two_methods(), instance(), kContext);
  ASSERT_EQ(halves.size(), 2u);
  EXPECT_NE(halves[0].key, halves[1].key);
  EXPECT_TRUE(contains(shell_text(halves[1].options), "--estimator none --spp 64 --seed 900000002"));
}

TEST(Plan, HasAPartForEachSeedAndBudgetAndForHalvesOfReferences) {
  Suite suite = two_methods();
  std::set<std::pair<uint64_t, size_t>> cells;
  for (const auto& run : runs_of_scene(suite, 0, instance(), kContext)) cells.emplace(run.seed, run.budget);
  EXPECT_EQ(number_of_parts(suite, suite.scenes[0]), cells.size() + reference_runs(suite, instance(), kContext).size());
  suite.scenes[0].reference = ReferencePlan{0, {"given.exr"}};
  EXPECT_EQ(number_of_parts(suite, suite.scenes[0]), cells.size());
}

TEST(Overrides, TakeThePlaceOfTheSuitesOwn) {
  Suite suite = two_methods();
  suite.show = Budget{48, 0};
  suite.published_ratio["room"]["iicv"]["24"] = 2;
  Overrides overrides;
  overrides.quick.emplace();
  overrides.methods = {"pt"};
  overrides.budgets = {{0, 3}};
  overrides.crop = "8x8";
  overrides.reference_files = {"a.exr"};
  apply(overrides, suite);
  EXPECT_EQ(suite.methods.size(), 1u);
  EXPECT_EQ(suite.budgets[0].label(), "3 s");
  EXPECT_FALSE(suite.show);
  EXPECT_EQ(suite.scenes[0].crop, "8x8");
  EXPECT_EQ(suite.reference.files.size(), 1u);
  EXPECT_TRUE(validate(suite).empty());
  overrides.methods = {"iicvv"};
  suite = two_methods();
  EXPECT_TRUE(contains(message_of([&] { apply(overrides, suite); }), "has no method 'iicvv'; did you mean 'iicv'"));
}

TEST(Overrides, QuickMakesSmaller) {
  Suite suite = two_methods();
  suite.seeds = {1, 2, 3, 4, 5};
  suite.budgets = {{48, 0}, {1536, 0}};
  suite.reference.spp = 8192;
  Overrides overrides;
  overrides.quick.emplace();
  apply(overrides, suite);
  EXPECT_EQ(suite.seeds.size(), 3u);
  EXPECT_EQ(suite.budgets, (std::vector<Budget>{{48, 0}}));
  EXPECT_EQ(suite.reference.spp, 1024u);
}

TEST(Overrides, QuickKeepsTheMiddleOfCrops) {
  const auto quick = [](const std::string& crop, const std::string& given = "") {
    Suite suite = two_methods();
    suite.scenes[0].crop = crop;
    Overrides overrides;
    overrides.quick.emplace();
    overrides.crop = given;
    apply(overrides, suite);
    return suite.scenes[0].crop;
  };
  EXPECT_EQ(quick("214,299,240,135"), "261,325,146,82");
  EXPECT_EQ(quick("227,606,135,240"), "253,653,82,146");
  EXPECT_EQ(quick("480x270"), "146x82");
  EXPECT_EQ(quick("10,10,100,100"), "10,10,100,100");
  EXPECT_EQ(quick(""), "");
  EXPECT_EQ(quick("nonsense"), "nonsense") << "reported where the scene is placed";
  EXPECT_EQ(quick("214,299,240,135", "300x200"), "300x200") << "what the command line asks for";
}

}  // namespace
}  // namespace covary::lab
