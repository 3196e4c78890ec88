// SPDX-License-Identifier: Apache-2.0
// Contents of the report: tables with gaps, published values, failures, unusual texts.
#include "lab/report_document.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include "lab/report_tables.h"
#include "support/files.h"

namespace covary::lab {
namespace {

using Json = nlohmann::ordered_json;
using test_support::contains, test_support::test_file;

const std::string kOdd = "a \"quoted\" <b>name</b> </script> ü\nsecond line";

Cell cell_of(size_t scene, size_t method, size_t budget, double relmse) {
  Cell cell{scene, method, budget};
  cell.split.relative.error = {relmse, 0.1 * relmse, 0.8 * relmse, 1.2 * relmse};
  cell.samples_per_pixel = 24;
  return cell;
}

/// Two scenes, two methods, one budget; the second scene's second method is missing.
Results three_cells() {
  Results results;
  Suite& suite = results.suite;
  suite.title = "title", suite.name = "test";
  suite.scenes = {{"room", "room.xml"}, {"veil", "veil.xml"}};
  suite.methods = {{"pt", {}, {}, true}, {"iicv", {}, {}, false}};
  suite.budgets = {{24, 0}};
  suite.seeds = {1};
  suite.baseline = "pt";
  results.cells = {cell_of(0, 0, 0, 0.4), cell_of(0, 1, 0, 0.1), cell_of(1, 0, 0, 0.2)};
  return results;
}

std::vector<std::string> keys(const Json& table) {
  std::vector<std::string> result;
  for (const Json& column : table["columns"]) result.push_back(column["key"]);
  return result;
}

std::vector<std::string> section_ids(const Json& document) {
  std::vector<std::string> result;
  for (const Json& section : document["sections"]) result.push_back(section["id"]);
  return result;
}

TEST(ReportTables, ErrorsHaveARowPerSceneAndAColumnPerMethod) {
  const Json table = error_table(three_cells(), 0);
  EXPECT_EQ(keys(table), (std::vector<std::string>{"scene", "m0", "m1"}));
  ASSERT_EQ(table["rows"].size(), 2u);
  EXPECT_EQ(table["rows"][0]["m1"], (Json{{"value", 0.1}, {"low", 0.8 * 0.1}, {"high", 1.2 * 0.1}}));
  EXPECT_FALSE(table["rows"][1].contains("m1")) << "a run that failed leaves a gap";
  EXPECT_TRUE(error_table(three_cells(), 0)["caption"] == "relMSE, 24 spp");
  EXPECT_TRUE(error_table(Results{.suite = three_cells().suite}, 0).is_null()) << "nothing to show";
}

TEST(ReportTables, PublishedValuesHaveATableOfTheirOwn) {
  Results results = three_cells();
  EXPECT_TRUE(published_table(results, 0).is_null());
  results.cells[1].published_relmse = 0.08;
  const Json table = published_table(results, 0);
  EXPECT_EQ(keys(table), (std::vector<std::string>{"scene", "method", "ours", "published", "ratio"}));
  ASSERT_EQ(table["rows"].size(), 1u) << "only what was published";
  const Json& row = table["rows"][0];
  EXPECT_EQ(row["scene"], "room");
  EXPECT_EQ(row["method"], "iicv");
  EXPECT_EQ(row["ours"]["value"], 0.1);
  EXPECT_EQ(row["published"], 0.08);
  EXPECT_DOUBLE_EQ(row["ratio"].get<double>(), 0.1 / 0.08);
  EXPECT_EQ(keys(error_table(results, 0)).size(), 3u) << "the table of errors stays as narrow as it is";
}

TEST(ReportTables, NumbersThatAreNotFiniteAreMissing) {
  Results results = three_cells();
  results.cells[0].split.relative.error = {};
  results.cells[1].split.relative.error = {0.1, kNone, kNone, kNone};
  results.cells[2].split.relative.error.value = std::numeric_limits<double>::infinity();
  const Json errors = error_table(results, 0);
  EXPECT_TRUE(errors["rows"][0]["m0"].is_null());
  EXPECT_EQ(errors["rows"][0]["m1"], (Json{{"value", 0.1}})) << "one seed has no interval";
  EXPECT_TRUE(errors["rows"][1]["m0"].is_null());
  for (const Json& table : {quality_table(results, 0), time_table(results, 0), ratio_table(results, 0)})
    EXPECT_EQ(table.dump().find("nan"), std::string::npos);
  EXPECT_TRUE(quality_table(results, 0)["rows"][0]["share"].is_null());
}

TEST(ReportTables, ColumnsAppearWhereTheyHaveSomethingToSay) {
  Results results = three_cells();
  const auto has = [](const Json& table, const std::string& key) {
    const std::vector<std::string> all = keys(table);
    return std::find(all.begin(), all.end(), key) != all.end();
  };
  EXPECT_FALSE(has(ratio_table(results, 0), "published"));
  EXPECT_TRUE(has(ratio_table(results, 0), "sample"));
  EXPECT_FALSE(has(time_table(results, 0), "then"));
  EXPECT_FALSE(has(time_table(results, 0), "ratio"));
  results.cells[1].published_ratio = 4;
  results.cells[1].then_seconds = {2, kNone, kNone, kNone};
  results.suite.budgets = {{0, 10}};
  EXPECT_TRUE(has(ratio_table(results, 0), "published"));
  EXPECT_FALSE(has(ratio_table(results, 0), "sample")) << "a budget in seconds has no equal number of samples";
  EXPECT_TRUE(has(time_table(results, 0), "then"));
  EXPECT_TRUE(has(time_table(results, 0), "ratio"));
}

TEST(ReportTables, ShowTheSamplesThatWereTaken) {
  Results results = three_cells();
  results.suite.budgets = {{24, 0}};
  results.summaries = {{.method = 1, .budget = 0, .samples_per_pixel = 36}};
  EXPECT_EQ(error_table(results, 0)["columns"][1]["title"], "pt");
  EXPECT_EQ(error_table(results, 0)["columns"][2]["title"], "iicv (36 spp)");
  EXPECT_EQ(summary_table(results, 0)["rows"][0]["spp"], 36);
  EXPECT_FALSE(contains(ratio_table(results, 0)["caption"], "different numbers of samples"));
  results.cells[1].equal_sample_normalised = true, results.cells[1].samples_per_pixel = 36;
  EXPECT_TRUE(contains(ratio_table(results, 0)["caption"], "different numbers of samples"));
  EXPECT_EQ(ratio_table(results, 0)["rows"][1]["spp"], 36);
  results.summaries[0].samples_per_pixel = std::numeric_limits<double>::quiet_NaN();  // no scene has a usable value
  EXPECT_EQ(error_table(results, 0)["columns"][2]["title"], "iicv");
}

TEST(ReportTables, PlotsShowPositiveErrorsAndSayWhatTheyShow) {
  Results results = three_cells();
  results.suite.budgets = {{24, 0}, {48, 0}};
  results.cells.push_back(cell_of(0, 0, 1, 0.2));
  results.cells.push_back(cell_of(0, 1, 1, -0.001));
  results.cells[0].split.relative.error.low = -1;
  const Json plot = convergence_plot(results, 0);
  ASSERT_EQ(plot["series"].size(), 2u);
  EXPECT_EQ(plot["series"][0]["y"], (Json{0.4, 0.2}));
  EXPECT_GT(plot["series"][0]["low"][0], 0) << "a logarithmic axis has no zero";
  EXPECT_EQ(plot["series"][1]["y"], (Json{0.1})) << "a negative error has no place on it";
  EXPECT_TRUE(contains(plot["alt"], "pt: 0.4 to 0.2"));
  EXPECT_TRUE(convergence_plot(Results{.suite = results.suite}, 0).is_null());
}

TEST(ReportTables, FrontHasMethodsOfAllScenes) {
  Results results = three_cells();
  EXPECT_TRUE(front_plot(results, 0).is_null()) << "one seed tells no bias";
  results.cells.push_back(cell_of(1, 1, 0, 0.1));
  const double gains[] = {1, 4, 1, 1}, biases[] = {0, 0.02, 0, 0.03};
  for (size_t i = 0; i < 4; ++i) {
    Cell& cell = results.cells[i];
    cell.equal_sample = {gains[i], 0, gains[i], gains[i]};
    cell.split.relative.squared_bias = {biases[i], 0.01, biases[i] - 0.01, biases[i] + 0.01};
  }
  const Json plot = front_plot(results, 0);
  ASSERT_EQ(plot["series"].size(), 2u);
  const Json& iicv = plot["series"][1];
  EXPECT_DOUBLE_EQ(iicv["x"][0], 0.5) << "geometric mean of 1/4 and 1";
  EXPECT_DOUBLE_EQ(iicv["y"][0], 0.25) << "mean of 20 % and 30 %";
  EXPECT_NEAR(iicv["high"][0].get<double>() - iicv["y"][0].get<double>(), std::sqrt(2) * 0.1 / 2, 1e-12);
  EXPECT_TRUE(contains(plot["alt"], "iicv: 0.5, 25 %"));
  results.cells.pop_back();
  EXPECT_EQ(front_plot(results, 0)["series"].size(), 1u) << "a method that lacks a scene";
}

TEST(ReportDocument, SectionsWithoutBlocksAreLeftOut) {
  EXPECT_EQ(section_ids(report_document(three_cells())),
            (std::vector<std::string>{"errors", "gains", "bias", "time", "setup"}));
  Results results = three_cells();
  results.suite.published_source = "somewhere";
  results.cells[0].published_relmse = 1;
  results.warnings = {"take care"};
  const Json document = report_document(results);
  EXPECT_EQ(section_ids(document),
            (std::vector<std::string>{"summary", "errors", "published", "gains", "bias", "time", "setup"}));
  EXPECT_EQ(document["sections"][2]["text"], (Json{"Published: somewhere."}));
  EXPECT_EQ(document["sections"][0]["blocks"][0]["items"], (Json{"take care"}));
}

TEST(ReportDocument, FailuresComeFirstWithCommandAndMessage) {
  Results results = three_cells();
  results.failures = {{"veil", "iicv", "24 spp", "covary render veil.xml", "first line\nsecond", 139, 2},
                      {"room", "", "", "", "no references", 0, 0}};
  const Json block = report_document(results)["sections"][0]["blocks"][0];
  EXPECT_EQ(block["kind"], "error");
  EXPECT_EQ(block["items"][0],
            "veil, iicv, 24 spp: first line\nsecond (exit code 139); 2 further runs were not tried\n"
            "covary render veil.xml");
  EXPECT_EQ(block["items"][1], "room: no references");
}

/// Names, messages and titles are the user's: the page shows them verbatim and stays intact.
TEST(ReportDocument, OddTextsReachThePageUnchanged) {
  Results results = three_cells();
  Suite& suite = results.suite;
  suite.title = suite.description = suite.scenes[0].name = suite.methods[1].name = suite.scenes[0].credit = kOdd;
  suite.methods[1].options = {"--estimator", kOdd};
  results.scenes = {{SceneInstance{suite.scenes[0]}, {}}, {SceneInstance{suite.scenes[1]}, {}}};
  results.failures = {{kOdd, kOdd, kOdd, kOdd, kOdd, 1, 0}};
  results.warnings = {kOdd, "not UTF-8: \xff"};
  const Json document = report_document(results);
  EXPECT_EQ(document["title"], kOdd);
  const std::string path = test_file("report.html");
  write_report(path, document, {});
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  const std::string page = text.str();
  EXPECT_EQ(page.find("<b>name"), std::string::npos);
  EXPECT_EQ(page.find("name</b> </script>"), std::string::npos);
  EXPECT_TRUE(contains(page, "ü\\nsecond line"));
  EXPECT_TRUE(contains(page, "\\\"quoted\\\""));
}

TEST(ReportTables, ARowSaysInWhichScenesItHasNoUsableValue) {
  Results results = three_cells();
  const auto has_column = [&] {
    const std::vector<std::string> all = keys(summary_table(results, 0));
    return std::find(all.begin(), all.end(), "unusable") != all.end();
  };
  results.summaries = {{.method = 0, .budget = 0, .n_scenes = 1}, {.method = 1, .budget = 0, .n_scenes = 1}};
  EXPECT_FALSE(has_column());
  results.summaries[1].unusable = {0};
  EXPECT_TRUE(has_column());
  EXPECT_EQ(summary_table(results, 0)["rows"][0]["unusable"], "");
  EXPECT_EQ(summary_table(results, 0)["rows"][1]["unusable"], results.suite.scenes[0].name);
}

TEST(ReportDocument, TheBestMethodHasTheLargestRatioAtTheBudget) {
  Results results = three_cells();
  results.suite.methods.push_back({"crn", {}, {}, true});
  results.suite.budgets = {{24, 0}, {0, 10}};
  EXPECT_EQ(best_method(results, 0), "");
  const auto summary = [](size_t method, size_t budget, double sample, double time) {
    Summary s{method, budget, 2};
    s.equal_sample.value = sample, s.equal_time.value = time;
    return s;
  };
  results.summaries = {summary(0, 0, 9, 9), summary(1, 0, 4, 2), summary(2, 0, 3, 3), summary(1, 1, kNone, 2),
                       summary(2, 1, kNone, 3)};
  EXPECT_EQ(best_method(results, 0), "iicv") << "at equal samples; the baseline is not compared with itself";
  EXPECT_EQ(best_method(results, 1), "crn") << "a budget in seconds has ratios at equal time only";
}

TEST(ReportDocument, SaysWhichMethodHasTheLeastError) {
  Results results = three_cells();
  results.suite.methods = {{"pt"}, {"iicv"}, {"crn"}, {"some"}};
  results.suite.budgets = {{24, 0}, {0, 10}};
  results.cells.clear();
  const auto summary = [](size_t method, size_t budget, size_t scenes, Estimate sample, Estimate time) {
    Summary s{method, budget, scenes};
    s.equal_sample = sample, s.equal_time = time;
    return s;
  };
  const Estimate one{1, kNone, 1, 1};
  results.summaries = {summary(0, 0, 2, one, one),
                       summary(1, 0, 2, {4, kNone, 3.5, 4.5}, {0.5, kNone, 0.4, 0.6}),
                       summary(2, 0, 2, {3, kNone, 2, 3.75}, {0.8, kNone, 0.7, 0.9}),
                       summary(3, 0, 1, {9, kNone, 8, 10}, {9, kNone, 8, 10}),
                       summary(0, 1, 2, {}, one),
                       summary(1, 1, 2, {}, {2})};
  EXPECT_EQ(
      verdicts(results, 0),
      (std::vector<std::string>{
          "At equal samples (24 spp) 'iicv' has the lowest error: 4 times lower than 'pt' (3.5 to 4.5). Not clearly "
          "worse: 'crn'.",
          "At equal time (10 s) 'iicv' has the lowest error: 2 times lower than 'pt' (no interval is known from one "
          "seed)."}))
      << "a method that lacks a scene does not count";
  EXPECT_EQ(
      verdicts(results, 1),
      (std::vector<std::string>{
          "At equal samples (24 spp) 'iicv' has the lowest error: 4 times lower than 'pt' (3.5 to 4.5). Not clearly "
          "worse: 'crn'.",
          "At equal time (10 s) 'iicv' has the lowest error: 2 times lower than 'pt' (no interval is known from one "
          "seed)."}));
  const Budget seconds = results.suite.budgets.back();
  results.suite.budgets.pop_back();
  EXPECT_EQ(verdicts(results, 0)[1],
            "At equal time (measured with 24 spp) no method has less error than 'pt'; next is 'crn', with 1.2 times as "
            "much.");
  results.suite.budgets.push_back(seconds);
  results.summaries = {summary(0, 0, 2, one, {}), summary(1, 0, 2, {1.01, kNone, kNone, kNone}, {})};
  EXPECT_EQ(verdicts(results, 0),
            std::vector<std::string>{"At equal samples (24 spp) no method has clearly less error than 'pt': that of "
                                     "'iicv' is 1 times lower (no interval is known from one seed), which these seeds "
                                     "and scenes do not tell from 1."});
  results.summaries = {summary(0, 0, 2, one, one), summary(1, 0, 2, {19, kNone, 0.73, 500}, {})};
  EXPECT_EQ(verdicts(results, 0),
            std::vector<std::string>{"At equal samples (24 spp) no method has clearly less error than 'pt': that of "
                                     "'iicv' is 19 times lower (0.73 to 500), which these seeds and scenes do not tell "
                                     "from 1."});
  results.summaries = {summary(0, 0, 2, one, one), summary(1, 0, 2, {6331, kNone, 152, 4924207}, {})};
  EXPECT_EQ(verdicts(results, 0),
            std::vector<std::string>{"At equal samples (24 spp) 'iicv' has the lowest error: 6300 times lower than "
                                     "'pt' (150 to 4900000)."});
}

TEST(ReportDocument, JudgesFlipByWhatCanBeSeenAndTold) {
  Results results = three_cells();
  results.cells.clear();
  results.summaries.clear();
  const auto verdict_of = [&](double pt, double iicv, double noise) {
    results.summaries.clear(), results.cells.clear();
    for (const auto& [method, flip] : {std::pair{size_t{0}, pt}, {size_t{1}, iicv}}) {
      Summary s;
      s.method = method, s.n_scenes = results.suite.scenes.size(), s.flip = flip;
      results.summaries.push_back(s);
      Cell cell;
      cell.method = method, cell.flip = {flip, noise, flip - 2 * noise, flip + 2 * noise};
      results.cells.push_back(cell);
    }
    const std::vector<std::string> all = verdicts(results, 0);
    return all.empty() ? "" : all.back();
  };
  const std::string unclear =
      "To the eye, as FLIP measures it with 24 spp, no method is clearly nearer to the reference than 'pt' ";
  EXPECT_EQ(verdict_of(0.0717, 0.0716, 1e-5), unclear + "(0.072; 'iicv' 0.072).") << "nobody sees that";
  EXPECT_EQ(verdict_of(0.08, 0.07, 0.02), unclear + "(0.08; 'iicv' 0.07).") << "noise";
  EXPECT_EQ(verdict_of(0.08, 0.07, 0.001),
            "To the eye, as FLIP measures it with 24 spp, 'iicv' is nearest to the reference: 0.07, 'pt' 0.08.");
}

TEST(ReportDocument, ShowsTheBudgetOfTheSuite) {
  Suite suite = three_cells().suite;
  suite.budgets = {{24, 0}, {48, 0}, {96, 0}};
  EXPECT_EQ(shown_budget(suite), 2u);
  suite.show = Budget{48, 0};
  EXPECT_EQ(shown_budget(suite), 1u);
  suite.show = Budget{7, 0};
  EXPECT_EQ(shown_budget(suite), 2u);
}

}  // namespace
}  // namespace covary::lab
