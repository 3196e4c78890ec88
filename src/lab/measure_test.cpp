// SPDX-License-Identifier: Apache-2.0
// Cells of images with errors known by hand, and quantities derived from several cells.
#include "lab/measure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "film/exr.h"
#include "lab/scene_images.h"
#include "support/files.h"

namespace covary::lab {
namespace {

using test_support::contains, test_support::message_of, test_support::test_file;

constexpr int kWidth = 16, kHeight = 12;
constexpr double kWeight = 1 / (1 + 0.01);  // of relMSE where the reference is 1

Image constant(float value) {
  Image image(kWidth, kHeight, 3);
  std::fill(image.data.begin(), image.data.end(), value);
  return image;
}

/// Writes an image into the test's folder, optionally with standard errors.
std::string write(const std::string& name, Image image, std::optional<float> std_error = {},
                  const ImagePlace& place = {kWidth, kHeight, {0, 0, kWidth, kHeight}},
                  const std::map<std::string, std::string>& attributes = {}) {
  std::string path = test_file(name);
  std::vector<ExrPlane> planes;
  add_image_planes("", image, planes);
  Image errors = constant(std_error.value_or(0));
  if (std_error) add_image_planes("StdError", errors, planes);
  write_exr(path, place, attributes, planes);
  return path;
}

SceneInstance scene() {
  SceneInstance result{{"room", "room.xml"}, "room.xml", "hash"};
  result.frame_width = kWidth, result.frame_height = kHeight;
  result.window = {0, 0, kWidth, kHeight};
  return result;
}

RunResult run_of(uint64_t seed, const std::string& image, double render_seconds, double estimate_seconds) {
  RunResult run{seed};
  run.record.image = image;
  run.record.render_seconds = render_seconds, run.record.estimate_seconds = estimate_seconds;
  run.record.load_seconds = 100;
  run.record.samples_per_pixel = 24;
  run.record.peak_memory_bytes = 1000.0 * static_cast<double>(seed);
  return run;
}

class Measure : public testing::Test {
 protected:
  /// Two runs with values 1.2 and 1.1 where the references are 1: errors 0.04 and 0.01 before weighting.
  Cell two_runs() {
    Cell cell;
    cell.runs = {run_of(1, write("one.exr", constant(1.2f), 0.3f), 2, 1),
                 run_of(2, write("two.exr", constant(1.1f), 0.1f), 4, 1)};
    return cell;
  }
  void measure_cell(Cell& cell, const Budget& budget = {24, 0}) {
    measure(cell, scene(), {{constant(1)}, {}}, false, budget, cache_, keys_, "reference");
  }
  Cache cache_{test_file("cache")};
  std::vector<std::string> keys_ = {"first run", "second run"};
};

TEST_F(Measure, ErrorsAndTimesAreThoseOfTheRuns) {
  Cell cell = two_runs();
  measure_cell(cell);
  EXPECT_NEAR(cell.runs[0].mse, 0.04, 1e-6);
  EXPECT_NEAR(cell.runs[1].relmse, 0.01 * kWeight, 1e-6);
  EXPECT_NEAR(cell.split.relative.error.value, 0.025 * kWeight, 1e-6);
  // The mean over seeds is 1.15. Variance: sum of squares around it, over n - 1.
  EXPECT_NEAR(cell.split.absolute.variance.value, 2 * 0.05 * 0.05, 1e-6);
  EXPECT_NEAR(cell.split.absolute.squared_bias.value, 0.2 * 0.1, 1e-6);
  EXPECT_NEAR(cell.runs[1].relmse_trimmed, 0.01 * kWeight, 1e-6);
  EXPECT_NEAR(cell.relmse_trimmed.value, 0.025 * kWeight, 1e-6);
  EXPECT_NEAR(cell.mae.value, 0.15, 1e-6);
  EXPECT_NEAR(cell.mae_of_mean, 0.15, 1e-6);
  EXPECT_EQ(cell.above5.value, 1);
  EXPECT_NEAR(cell.runs[0].mean_ratio, 1.2, 1e-6);
  EXPECT_DOUBLE_EQ(cell.load_seconds.value, 100);
  EXPECT_DOUBLE_EQ(cell.method_seconds.value, 4) << "without load";
  EXPECT_NEAR(cell.efficiency.value, 1 / (0.025 * kWeight * 4), 1e-3);
  EXPECT_DOUBLE_EQ(cell.peak_memory_bytes, 2000) << "the largest";
  EXPECT_DOUBLE_EQ(cell.samples_per_pixel, 24);
  EXPECT_TRUE(std::isnan(cell.time_ratio)) << "a budget in samples takes as long as it takes";
}

TEST_F(Measure, TimeBudgetsAreComparedWithTheTimeTaken) {
  Cell cell = two_runs();
  measure_cell(cell, {0, 3.2});
  EXPECT_DOUBLE_EQ(cell.time_ratio, 4 / 3.2);
}

TEST_F(Measure, PredictedErrorsComeFromTheLayerOfStandardErrors) {
  Cell cell = two_runs();
  measure_cell(cell);
  EXPECT_NEAR(cell.runs[0].predicted_relmse, 0.09 * kWeight, 1e-6);
  EXPECT_NEAR(cell.predicted_over_true.value, (0.09 + 0.01) / (0.04 + 0.01), 1e-5);
  EXPECT_EQ(cell.coverage.value, 1) << "0.2 and 0.1 are less than 1.96 times 0.3 and 0.1";
  Cell plain;
  plain.runs = {run_of(1, write("plain.exr", constant(1.2f)), 1, 0)};
  keys_ = {"plain run"};
  measure_cell(plain);
  EXPECT_TRUE(std::isnan(plain.runs[0].predicted_relmse));
  EXPECT_TRUE(std::isnan(plain.predicted_over_true.value));
  EXPECT_TRUE(std::isnan(plain.coverage.value));
  EXPECT_TRUE(std::isnan(plain.mae_of_mean)) << "one run has no mean image of its own";
}

TEST_F(Measure, BoundsAreThoseOfTheImagesAndCounted) {
  const auto write_with = [&](const std::string& name, float value, const std::string& bounds) {
    return write(name, constant(value), 0.1f, {kWidth, kHeight, {0, 0, kWidth, kHeight}},
                 {{"covary:predicted_relmse_80", bounds}});
  };
  Cell cell;
  cell.runs = {
      run_of(1, write_with("in.exr", 1.2f, "0.03 0.05"), 1, 0),
      run_of(2, write_with("out.exr", 1.2f, "0.01 0.02"), 1, 0), run_of(3, write("no.exr", constant(1.2f), 0.1f), 1, 0),
      run_of(4, write_with("damaged.exr", 1.2f, "0.01"), 1, 0), run_of(5, write("none.exr", constant(1.2f)), 1, 0)};
  keys_ = {"1", "2", "3", "4", "5"};
  for (int again = 0; again < 2; ++again) {  // the second time from the cache
    measure_cell(cell);
    EXPECT_EQ(cell.runs[0].predicted_low, 0.03);
    EXPECT_EQ(cell.runs[1].predicted_high, 0.02);
    EXPECT_TRUE(std::isnan(cell.runs[3].predicted_low));
    EXPECT_EQ(cell.bounded, 0.5) << "two of four that have standard errors";
    EXPECT_EQ(cell.bounds_hold, 0.5) << "relMSE 0.04, about";
  }
}

TEST_F(Measure, IntervalsCountTheNoiseOfReferences) {
  keys_ = {"run"};
  const auto coverage = [&](const std::vector<Image>& references, const std::string& key) {
    Cell cell;
    cell.runs = {run_of(1, write("narrow.exr", constant(1.2f), 0.05f), 1, 0)};
    measure(cell, scene(), {references, {}}, false, {24, 0}, cache_, keys_, key);
    return cell.coverage.value;
  };
  EXPECT_EQ(coverage({constant(1), constant(1)}, "exact"), 0) << "0.2 is four standard errors";
  EXPECT_EQ(coverage({constant(0.9f), constant(1.1f)}, "noisy"), 1) << "0.2 is less than 1.96 times 0.11";
  Image half = constant(1);
  std::fill(half.data.begin(), half.data.begin() + static_cast<std::ptrdiff_t>(half.data.size() / 4), 1.15f);
  EXPECT_EQ(coverage({half, half}, "half"), 0.25);
}

TEST_F(Measure, ReadsTheLayerThatTheSceneNames) {
  SceneInstance errors = scene();
  errors.entry.layer = "StdError";
  Cell cell = two_runs();
  measure(cell, errors, {{constant(1)}, {}}, false, {24, 0}, cache_, keys_, "reference");
  EXPECT_NEAR(cell.runs[0].mse, 0.49, 1e-6);
  EXPECT_TRUE(std::isnan(cell.runs[0].predicted_relmse));
  measure_cell(cell);
  EXPECT_NEAR(cell.runs[0].mae, 0.2, 1e-6) << "not that of the other layer";
}

/// Errors that take longer to compute than to read are cached, one file per run and reference.
TEST_F(Measure, KeepsErrorsOfImages) {
  Cell cell = two_runs();
  measure_cell(cell);
  Cell again = cell;
  again.runs[0].record.image = write("one.exr", constant(3));
  measure_cell(again);
  EXPECT_EQ(again.runs[0].mae, cell.runs[0].mae) << "from the cache";
  EXPECT_NEAR(again.runs[0].mse, 4, 1e-5) << "from the image";
  measure(again, scene(), {{constant(1)}, {}}, false, {24, 0}, cache_, keys_, "another reference");
  EXPECT_NEAR(again.runs[0].mae, 2, 1e-5);
}

TEST_F(Measure, PixelsThatAreNotFiniteAreLeftOutAndCounted) {
  Image bad = constant(1.2f);
  bad.pixel(3, 4)[1] = std::numeric_limits<float>::quiet_NaN();
  bad.pixel(5, 4)[0] = std::numeric_limits<float>::infinity();
  Cell cell;
  cell.runs = {run_of(1, write("bad.exr", bad), 1, 0)};
  keys_ = {"bad run"};
  measure_cell(cell);
  EXPECT_EQ(cell.split.n_non_finite, 2u);
  EXPECT_NEAR(cell.runs[0].mse, 0.04, 1e-6);
}

TEST_F(Measure, ReadsTheWindowFromLargerImagesAndRefusesOthers) {
  Image whole = constant(0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) whole.pixel(x, y)[0] = static_cast<float>(100 * y + x);
  SceneInstance part = scene();
  part.window = {5, 3, 4, 2};
  const std::string path = write("whole.exr", whole);
  const Image window = read_window(path, part);
  EXPECT_EQ(window.width, 4);
  EXPECT_EQ(window.pixel(3, 1)[0], 408);
  part.frame_width = 32;
  EXPECT_TRUE(contains(message_of([&] { read_window(path, part); }, ErrorCode::kInput),
                       "has a frame of 16 x 12 pixels, the scene one of 32 x 12"));
  part = scene();
  const std::string moved = write("moved.exr", whole, {}, {32, 24, {8, 8, kWidth, kHeight}});
  part.frame_width = 32, part.frame_height = 24;
  EXPECT_TRUE(contains(message_of([&] { read_window(moved, part); }, ErrorCode::kInput), "does not cover"));
}

/// One scene, pt and iicv, budgets of 24 and 96 samples; relMSE by seed.
Results two_methods(const std::vector<double>& pt, const std::vector<double>& iicv) {
  Results results;
  Suite& suite = results.suite;
  suite.scenes = {{"room", "room.xml"}};
  suite.methods = {{"pt", {}, {}, true}, {"iicv", {}, {}, false}};
  suite.budgets = {{24, 0}, {96, 0}};
  suite.seeds = {1, 2, 3};
  suite.baseline = "pt";
  results.scenes = {{scene(), {}}};
  for (size_t m = 0; m < 2; ++m)
    for (size_t b = 0; b < 2; ++b) {
      const std::vector<double>& errors = m == 0 ? pt : iicv;
      if (errors.empty()) continue;
      Cell cell{0, m, b};
      cell.samples_per_pixel = suite.budgets[b].spp;
      for (size_t s = 0; s < errors.size(); ++s) {
        RunResult run = run_of(s + 1, "", m == 0 ? 1 : 2, m == 0 ? 0 : 1);
        run.relmse = errors[s] / (b == 0 ? 1 : 4);
        cell.runs.push_back(run);
      }
      cell.split.relative.error = mean_estimate(errors);
      results.cells.push_back(cell);
    }
  return results;
}

TEST(CompareCells, RatiosAreAgainstTheBaselineWithTheSameBudget) {
  Results results = two_methods({0.3, 0.36, 0.3}, {0.1, 0.12, 0.1});
  results.suite.published_relmse["room"]["iicv"]["24"] = 0.2;
  results.suite.published_ratio["room"]["iicv"]["96"] = 5;
  compare_cells(results);
  const Cell &first = *results.find(0, 1, 0), &second = *results.find(0, 1, 1);
  EXPECT_NEAR(first.equal_sample.value, 3, 1e-9);
  EXPECT_NEAR(first.equal_time.value, 1, 1e-9) << "three times the error, a third of the time";
  EXPECT_EQ(first.published_relmse, 0.2);
  EXPECT_TRUE(std::isnan(first.published_ratio));
  EXPECT_EQ(second.published_ratio, 5);
  EXPECT_EQ(results.find(0, 0, 0)->equal_sample.value, 1);
  ASSERT_EQ(results.slopes.size(), 2u);
  EXPECT_NEAR(results.slopes[1].exponent.value, -1, 1e-9) << "four times the samples, a quarter of the error";
  ASSERT_EQ(results.summaries.size(), 4u);
  EXPECT_EQ(results.summaries[1].n_scenes, 1u);
  EXPECT_EQ(results.summaries[1].equal_sample.low, first.equal_sample.low) << "of one scene, the mean is the cell";
  EXPECT_EQ(results.summaries[1].equal_time.high, first.equal_time.high);
}

/// One of both methods got fewer processors than it asked for.
TEST(CompareCells, WarnWhereClockAndProcessorDisagree) {
  const auto compared = [](double processor) {
    Results results = two_methods({0.3, 0.36, 0.3}, {0.1, 0.12, 0.1});
    for (Cell& cell : results.cells) {
      const bool is_base = cell.method == 0;
      for (RunResult& run : cell.runs) run.record.processor_seconds = is_base ? 2 : processor;
      cell.method_seconds.value = is_base ? 1 : 3;
      cell.processor_seconds.value = is_base ? 2 : processor;
    }
    compare_cells(results);
    return results;
  };
  EXPECT_TRUE(compared(6).warnings.empty()) << "three times as long by both";
  EXPECT_TRUE(compared(5).warnings.empty()) << "by less than a factor of 1.3";
  EXPECT_TRUE(compared(0).warnings.empty()) << "processor time is unknown";
  EXPECT_EQ(compared(9).warnings.size(), 2u) << "the baseline was disturbed";
  const Results busy = compared(3);
  ASSERT_EQ(busy.warnings.size(), 2u) << "for each budget";
  EXPECT_EQ(busy.warnings[0],
            "room, iicv, 24 spp: by the clock it took 3 times the time of pt, but 1.5 times its processor time: the "
            "machine was busy with other work, or one of both uses fewer threads; at equal processor time the ratio of "
            "errors is 2, at equal time 1");
  EXPECT_NEAR(busy.find(0, 1, 0)->equal_processor_time.value, 2, 1e-9);
  EXPECT_NEAR(busy.find(0, 1, 0)->equal_time.value, 1, 1e-9);
}

/// 48 samples against the baseline's 32: a third of the error is a half at equal samples.
TEST(CompareCells, OtherNumbersOfSamplesAreNormalised) {
  Results results = two_methods({0.3, 0.36, 0.3}, {0.1, 0.12, 0.1});
  for (Cell& cell : results.cells) {
    cell.samples_per_pixel = cell.method == 0 ? 32 : 48;
    for (RunResult& run : cell.runs) run.record.samples_per_pixel = cell.samples_per_pixel;
  }
  compare_cells(results);
  const Cell& cell = *results.find(0, 1, 0);
  EXPECT_NEAR(cell.equal_sample.value, 2, 1e-9);
  EXPECT_TRUE(cell.equal_sample_normalised);
  EXPECT_FALSE(results.find(0, 0, 0)->equal_sample_normalised);
  EXPECT_TRUE(results.summaries[1].equal_sample_normalised);
  EXPECT_EQ(results.summaries[1].samples_per_pixel, 48);
  ASSERT_EQ(results.warnings.size(), 2u) << "for each budget";
  EXPECT_TRUE(contains(results.warnings[0], "iicv took 48 samples per pixel and pt another number at 24 spp"));

  Results close = two_methods({0.3, 0.36, 0.3}, {0.1, 0.12, 0.1});
  close.cells[2].samples_per_pixel = 24.2;
  compare_cells(close);
  EXPECT_NEAR(close.find(0, 1, 0)->equal_sample.value, 3, 1e-9) << "the same within 1 %";
  EXPECT_FALSE(close.find(0, 1, 0)->equal_sample_normalised);
}

/// A failed run removes its seed from both sides; if no seed is left, there is no ratio.
TEST(CompareCells, MissingRunsLeaveGaps) {
  Results fewer = two_methods({0.3, 0.6, 0.3}, {0.1, 0.1});
  compare_cells(fewer);
  EXPECT_NEAR(fewer.find(0, 1, 0)->equal_sample.value, 4.5, 1e-9) << "seeds 1 and 2";
  Results without = two_methods({}, {0.1, 0.1, 0.1});
  compare_cells(without);
  EXPECT_TRUE(std::isnan(without.find(0, 1, 0)->equal_sample.value));
  for (const Summary& summary : without.summaries) EXPECT_EQ(summary.method, 1u);
}

/// Three scenes; if one method's error is negative in a scene, no row includes that scene, and the method's row says
/// so.
TEST(CompareCells, RowsAverageTheSameScenes) {
  const Results one = two_methods({0.3, 0.36, 0.3}, {0.1, 0.12, 0.1});
  Results results = one;
  for (size_t s : {1u, 2u}) {
    results.suite.scenes.push_back(results.suite.scenes[0]);
    results.suite.scenes[s].name = s == 1 ? "door" : "house";
    results.scenes.push_back(results.scenes[0]);
    for (Cell cell : one.cells) {
      cell.scene = s;
      // Door: the baseline's error times ten, and a negative error of the method at the first budget.
      for (RunResult& run : cell.runs)
        if (s == 1) run.relmse *= cell.method == 0 ? 10 : (cell.budget == 0 ? -1 : 1);
      std::vector<double> errors;
      for (const RunResult& run : cell.runs) errors.push_back(run.relmse);
      cell.split.relative.error = mean_estimate(errors);
      results.cells.push_back(cell);
    }
  }
  compare_cells(results);
  ASSERT_EQ(results.summaries.size(), 4u);
  const Summary &pt = results.summaries[0], &iicv = results.summaries[1];
  EXPECT_EQ(pt.n_scenes, 2u) << "as many as iicv has";
  EXPECT_EQ(iicv.n_scenes, 2u);
  EXPECT_NEAR(pt.relmse, 0.32, 1e-9) << "without the door";
  EXPECT_NEAR(iicv.equal_sample.value, 3, 1e-9);
  EXPECT_TRUE(pt.unusable.empty());
  EXPECT_EQ(iicv.unusable, std::vector<size_t>{1});
  EXPECT_EQ(results.summaries[2].n_scenes, 3u) << "at the other budget all are usable";
  ASSERT_EQ(results.warnings.size(), 1u);
  EXPECT_TRUE(contains(results.warnings[0], "no summary at 24 spp counts door, where iicv has no positive error"));

  // A method that is usable in no scene has a row that says so, and excludes no scene from the others.
  Results broken = one;
  for (Cell& cell : broken.cells)
    if (cell.method == 1)
      for (RunResult& run : cell.runs) run.relmse = -0.1;
  compare_cells(broken);
  EXPECT_EQ(broken.summaries[0].n_scenes, 1u);
  EXPECT_EQ(broken.summaries[1].n_scenes, 0u);
  EXPECT_EQ(broken.summaries[1].unusable, std::vector<size_t>{0});
}

TEST(CompareCells, BudgetsInSecondsCompareTheErrorsThemselves) {
  Results results = two_methods({0.3, 0.36, 0.3}, {0.1, 0.12, 0.1});
  results.suite.budgets = {{0, 5}, {0, 10}};
  compare_cells(results);
  EXPECT_NEAR(results.find(0, 1, 0)->equal_time.value, 3, 1e-9);
  EXPECT_TRUE(std::isnan(results.find(0, 1, 0)->equal_sample.value));
  EXPECT_TRUE(results.slopes.empty()) << "slopes are over samples";
}

}  // namespace
}  // namespace covary::lab
