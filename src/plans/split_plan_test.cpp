// SPDX-License-Identifier: Apache-2.0
// Plans that determine whether common random numbers pay off: the trial, its decision, and the samples after it.
#include "plans/split_plan.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"
#include "estimators/mean.h"
#include "plans/denoised_passes.h"
#include "plans/render_settings.h"
#include "support/files.h"
#include "support/plans.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of, test_support::TemporaryFolder;

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

/// The mean of the independent image, with this claimed error; `pair`: one brighter.
Estimator said_to_err(double relmse, bool pair) {
  Estimator estimator;
  estimator.passes = pair ? EstimatorPasses::kPair : EstimatorPasses::kIndependent;
  estimator.name = estimator.text = pair ? "pair" : "none";
  estimator.fewest_groups = pair ? 6 : 1;
  estimator.predicts_error = true;
  estimator.apply = [=](const GroupedImage& crn, const GroupedImage& independent, const PairSettings&) {
    EXPECT_EQ(crn.groups, pair ? independent.groups : 0);
    EstimatorResult result = mean_of_groups(independent);
    for (float& value : result.estimate.data) value += pair ? 1.0f : 0.0f;
    result.risks = MeasuredRisks{relmse, 0, {}};
    return result;
  };
  return estimator;
}

Plan plan_with(double mean, double pair) { return split_plan(said_to_err(mean, false), said_to_err(pair, true)); }

double samples(const RenderResult& result, size_t pass) { return result.passes[pass].film.mean_count(); }

TEST(SplitPlan, NothingIsTriedWithFewSamples) {
  const LoadedScene scene = load_sized(kRoom, 16, 12);
  for (const uint32_t spp : {1u, 7u, 64u}) {
    const RenderResult result = render(scene, plan_with(1, 0), request_of(spp));
    ASSERT_EQ(result.passes.size(), 2u);
    EXPECT_TRUE(result.complete);
    EXPECT_EQ(result.samples_per_pixel(), spp);
    for (const Pass& pass : result.passes) EXPECT_EQ(pass.settings.sampling, Sampling::kIndependent);
    const RenderResult plain = render(scene, estimator_plan(said_to_err(1, false)), request_of(spp));
    EXPECT_EQ(result.image.estimate.data, plain.image.estimate.data) << "the same samples";
    EXPECT_TRUE(contains(result.image.note, "independent samples only")) << result.image.note;
  }
}

/// The trial has an eighth of the samples, a quarter of it with common random numbers; with three quarters of the
/// samples the error is 4/3 of that of all, so a pair with 0.8 of it loses.
TEST(SplitPlan, ATrialDecides) {
  const LoadedScene scene = load_sized(kRoom, 16, 12);
  const uint32_t spp = 256;
  for (const bool wins : {true, false}) {
    const RenderResult result = render(scene, plan_with(1, wins ? 0.7 : 0.8), request_of(spp));
    ASSERT_EQ(result.passes.size(), 4u);
    EXPECT_TRUE(result.complete);
    EXPECT_EQ(result.samples_per_pixel(), spp);
    EXPECT_EQ(samples(result, 0), 24);
    EXPECT_EQ(samples(result, 1), 8);
    EXPECT_EQ(samples(result, 3), wins ? 56 : 0);
    const SplitTrial& trial = *result.passes[2].trial;
    EXPECT_EQ(trial.crn_wins, wins);
    EXPECT_EQ(trial.samples, 32);
    EXPECT_DOUBLE_EQ(trial.independent, 0.75);
    EXPECT_TRUE(contains(result.image.note, wins ? "for a fourth" : "independent samples only")) << result.image.note;
    const Film independent = joined(result.passes[0].film, result.passes[2].film);
    const Spectrum mean = independent.mean(5, 6);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(result.image.estimate.pixel(5, 6)[c], mean[c] + (wins ? 1 : 0), 1e-5);
  }
}

RenderResult by_settings(const LoadedScene& scene, OptionValues values, RenderCallbacks callbacks = {}) {
  values.insert({{"spp", "256"}, {"seed", "3"}, {"oidn", "off"}, {"split", "auto"}});
  const RenderSettings settings = settings_from<RenderSettings>(values);
  return render(scene, render_plan(settings, {}), request_of(settings, scene), callbacks);
}

TEST(SplitPlan, BitsDependNeitherOnThreadsNorOnInterruptions) {
  const LoadedScene scene = load_sized(kRoom, 24, 18);
  const RenderResult whole = by_settings(scene, {});
  ASSERT_EQ(whole.passes.size(), 4u);
  const TemporaryFolder folder;
  const std::string passes = (folder.path() / "passes").string();
  bool interrupted = true;
  for (int tiles = 1; interrupted; tiles *= 4) {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    StopAfter stop(tiles);
    const RenderResult part = by_settings(scene, {{"passes", passes}, {"resume", ""}}, stop.callbacks);
    interrupted = part.interrupted;
    if (interrupted) continue;
    EXPECT_EQ(part.image.estimate.data, whole.image.estimate.data);
    EXPECT_EQ(part.image.note, whole.image.note);
    for (size_t i = 0; i < 4; ++i) EXPECT_TRUE(same_bits(part.passes[i].film, whole.passes[i].film)) << i;
  }
}

TEST(SplitPlan, OnlyOfADenoisedMean) {
  for (const OptionValues& values : {OptionValues{{"denoise", "none"}}, {{"estimator", "iicv"}}}) {
    OptionValues all = values;
    all["split"] = "auto";
    EXPECT_TRUE(contains(message_of([&] { render_plan(settings_from<RenderSettings>(all), {}); }, ErrorCode::kUsage),
                         "`split` auto is for the mean"));
  }
}

}  // namespace
}  // namespace covary
