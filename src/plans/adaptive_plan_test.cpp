// SPDX-License-Identifier: Apache-2.0
// Plans whose first pass determines the sample counts of the last: budgets, interruptions, limits, bias.
#include "plans/adaptive_plan.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <filesystem>

#include "combine/registry.h"
#include "core/random.h"
#include "denoising/mixed_denoising.h"
#include "film/film_file.h"
#include "film/merge.h"
#include "plans/denoised_passes.h"
#include "plans/memory.h"
#include "statistics/p_values.h"
#include "support/files.h"
#include "support/plans.h"

namespace covary {
namespace {

namespace fs = std::filesystem;
using test_support::contains, test_support::message_of, test_support::TemporaryFolder;

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

Plan plan_of(const std::string& estimator, const OptionValues& options = {}) {
  return estimator_plan(make_estimator(estimator, options));
}

Plan plain_adaptive(OptionValues options = {}) {
  options["adaptive"] = "";
  return plan_of("none", options);
}

/// A denoised mean that uses only filters.
Method denoised() {
  return with_denoising(make_estimator("none", {{"adaptive", ""}}),
                        {.mode = DenoiseMode::kAuto, .use_oidn = false, .oidn = {}});
}

TEST(AdaptivePlan, TheFirstPassAndTheBudget) {
  const LoadedScene scene = load_sized(kRoom);
  for (const OptionValues& options : {OptionValues{}, OptionValues{{"paper", ""}}}) {
    const RenderResult result = render(scene, plan_of("dependent-tests", options), request_of(64));
    ASSERT_EQ(result.passes.size(), 2u);
    EXPECT_TRUE(result.complete);
    EXPECT_EQ(result.passes[0].film.mean_count(), 32);
    EXPECT_EQ(result.passes[0].settings.sampling, Sampling::kCrn);
    EXPECT_NEAR(result.passes[1].film.mean_count(), 32, 0.32);
    EXPECT_NEAR(result.samples_per_pixel(), 64, 0.32);
    EXPECT_TRUE(result.passes[1].film.keeps_sample_variance());
    EXPECT_EQ(result.picture().data, result.image.estimate.data);
  }
  const RenderResult result = render(scene, plan_of("dependent-tests", {{"dependent-spp", "10"}}), request_of(40));
  EXPECT_EQ(result.passes[0].film.mean_count(), 10);
  EXPECT_NEAR(result.passes[1].film.mean_count(), 30, 0.3);
}

TEST(AdaptivePlan, OptionsOfTheEstimatorReachIt) {
  const LoadedScene scene = load_sized(kRoom);
  const OptionValues options = {{"paper", ""}, {"max-region", "3"}};
  const RenderResult result = render(scene, plan_of("dependent-tests", options), request_of(48));
  const Film &crn = result.passes[0].film, &independent = result.passes[1].film;
  const Method estimator = make_estimator("dependent-tests", options);
  EXPECT_EQ(result.image.estimate.data,
            estimator.image({rows_of(crn, 0, 30), rows_of(independent, 0, 30)}, {}).estimate.data);
  for (const uint32_t n : independent.counts()) EXPECT_EQ(n, class_of(n)) << "classes";
}

/// Half of the samples belong to the CRN pass, and the estimator gets the groups that it reads.
TEST(AdaptivePlan, ControlVariatesOfUnequalNumbers) {
  const LoadedScene scene = load_sized(kRoom);
  const RenderResult result = render(scene, plan_of("iicv", {{"adaptive", ""}}), request_of(192));
  ASSERT_EQ(result.passes.size(), 2u);
  const Film &crn = result.passes[0].film, &independent = result.passes[1].film;
  EXPECT_EQ(crn.groups(), 12);
  EXPECT_EQ(crn.mean_count(), 96);
  EXPECT_EQ(result.passes[0].settings.sampling, Sampling::kCrn);
  EXPECT_NEAR(independent.mean_count(), 96, 0.96);
  const auto [least, most] = std::minmax_element(independent.counts().begin(), independent.counts().end());
  EXPECT_GT(*most, *least);
  for (const uint32_t n : independent.counts()) EXPECT_TRUE(n >= 12 && n % 12 == 0);
  EXPECT_EQ(result.image.estimate.data,
            make_estimator("iicv").image({rows_of(crn, 0, 30), rows_of(independent, 0, 30)}, {96, true}).estimate.data);
  ASSERT_TRUE(result.predicted);
  EXPECT_GT(result.predicted->relmse, 0);
}

TEST(AdaptivePlan, ARelativeErrorTakesThePlaceOfTheBudget) {
  const LoadedScene scene = load_sized(kRoom, 20, 15);
  RenderRequest request = request_of(1);
  request.spp.reset();
  const auto plan_until = [](float error, const OptionValues& options = {}) {
    Method estimator = make_estimator("dependent-tests", options);
    estimator.adaptive->counts.relative_error = error;
    return adaptive_plan(estimator);
  };
  const RenderResult coarse = render(scene, plan_until(0.8f), request);
  const RenderResult fine = render(scene, plan_until(0.4f), request);
  EXPECT_EQ(coarse.passes[0].film.mean_count(), 50);
  EXPECT_NEAR(fine.passes[1].film.mean_count() / coarse.passes[1].film.mean_count(), 4, 0.2);
  request.spp = 60;
  const RenderResult limited = render(scene, plan_until(0.01f), request);
  EXPECT_NEAR(limited.samples_per_pixel(), 60, 0.6);
  request.spp.reset();
  const RenderResult most = render(scene, plan_until(0.01f, {{"max-spp", "9"}}), request);
  EXPECT_LE(most.passes[1].film.mean_count(), 9);
  EXPECT_FALSE(coarse.passes[1].misses_error);
  EXPECT_FALSE(fine.passes[1].misses_error);
  EXPECT_TRUE(limited.passes[1].misses_error);
  EXPECT_TRUE(most.passes[1].misses_error);
}

TEST(AdaptivePlan, TooSmallABudgetIsAnError) {
  const LoadedScene scene = load_sized(kRoom);
  const auto message = [&](uint32_t spp, const OptionValues& options) {
    return message_of([&] { render(scene, plan_of("dependent-tests", options), request_of(spp)); }, ErrorCode::kUsage);
  };
  EXPECT_TRUE(contains(message(40, {{"dependent-spp", "40"}}),
                       "40 samples per pixel are too few for dependent-tests: "
                       "its first pass takes 40 (`dependent-spp`), and at "
                       "least 1 must be left"));
  EXPECT_TRUE(contains(message(1, {}), "too few"));
  const auto of_iicv = [&](const char* first, std::optional<int> groups) {
    const Method iicv = make_estimator("iicv", {{"adaptive", ""}, {"dependent-spp", first}});
    return message_of([&] { render(scene, adaptive_plan(iicv, groups), request_of(48)); }, ErrorCode::kUsage);
  };
  EXPECT_EQ(of_iicv("24", 2), "2 groups are too few: iicv needs at least 3");
  EXPECT_EQ(of_iicv("2", {}), "dependent-spp is 2, expected at least 12, one sample for each group (`groups`)");
  EXPECT_EQ(message(2, {}), "no error");
}

/// One sample in the first pass gives no estimate of noise: all pixels get the same number.
TEST(AdaptivePlan, OneSampleOfTheFirstPass) {
  const LoadedScene scene = load_sized(kRoom, 16, 12);
  const RenderResult result = render(scene, plan_of("dependent-tests", {{"dependent-spp", "1"}}), request_of(9));
  for (const uint32_t n : result.passes[1].film.counts()) EXPECT_EQ(n, 8u);
  const RenderResult paper =
      render(scene, plan_of("dependent-tests", {{"dependent-spp", "1"}, {"paper", ""}}), request_of(9));
  for (const uint32_t n : paper.passes[1].film.counts()) EXPECT_EQ(n, 0u);
  EXPECT_EQ(paper.image.estimate.data, paper.passes[0].film.mean_image().data) << "without noise C_d is the image";
}

TEST(AdaptivePlan, SameBitsForAnyNumberOfThreads) {
  const LoadedScene scene = load_sized(kRoom);
  std::vector<float> first;
  for (const int threads : {1, 2, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const RenderResult result = render(scene, plan_of("dependent-tests"), request_of(24));
    if (first.empty()) first = result.image.estimate.data;
    EXPECT_EQ(result.image.estimate.data, first);
  }
}

TEST(AdaptivePlan, StoppedAtManyTilesAndResumedGivesTheSameBits) {
  const LoadedScene scene = load_sized(kRoom);
  for (const Plan& plan :
       {plan_of("dependent-tests"), plain_adaptive(), plan_of("iicv", {{"adaptive", ""}}), adaptive_plan(denoised())}) {
    const TemporaryFolder folder;
    RenderRequest request = request_of(48);
    const RenderResult whole = render(scene, plan, request);
    request.output = folder.file("a.exr");
    request.resume = true;
    int first_phase = 0, last_phase = 0;
    for (int tiles = 5;; tiles += 11) {
      StopAfter stop(tiles);
      const RenderResult part = render(scene, plan, request, stop.callbacks);
      ++(part.passes.size() == 1 ? first_phase : last_phase);
      EXPECT_TRUE(fs::exists(request.output));
      if (!part.complete) continue;
      for (const int i : {0, 1}) {
        EXPECT_TRUE(same_bits(part.passes[i].film, whole.passes[i].film));
        EXPECT_EQ(part.passes[i].film.variance_in_groups(), whole.passes[i].film.variance_in_groups());
      }
      EXPECT_EQ(part.image.estimate.data, whole.image.estimate.data);
      break;
    }
    EXPECT_GT(first_phase, 0);
    EXPECT_GT(last_phase, 1);
    EXPECT_FALSE(fs::exists(folder.file("a.passes"))) << "not needed any more";
  }
}

TEST(AdaptivePlan, KeptFilmsServeOtherFilters) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(32);
  request.passes = folder.file("passes");
  const RenderResult first = render(scene, plan_of("dependent-tests"), request);
  request.resume = true;
  const RenderResult other = render(scene, plan_of("dependent-tests", {{"window", "5"}}), request);
  EXPECT_TRUE(same_bits(first.passes[1].film, other.passes[1].film));
  EXPECT_NE(first.image.estimate.data, other.image.estimate.data);
  EXPECT_EQ(other.image.estimate.data,
            render(scene, plan_of("dependent-tests", {{"window", "5"}}), request_of(32)).image.estimate.data);
  // A film without variances cannot be continued.
  Film plain(40, 30, {0, 0, 40, 30}, 1);
  plain.attributes = read_film(request.passes + "/crn.exr").attributes;
  write_film(request.passes + "/crn.exr", plain);
  EXPECT_TRUE(contains(message_of([&] { render(scene, plan_of("dependent-tests"), request); }),
                       "variances of samples not kept"));
}

TEST(AdaptivePlan, FilmsOfTwoSeedsMerge) {
  const LoadedScene scene = load_sized(kRoom);
  RenderRequest request = request_of(24);
  std::vector<Film> crn, independent;
  for (const uint64_t seed : {1, 2}) {
    request.seed = seed;
    RenderResult result = render(scene, plan_of("dependent-tests"), request);
    crn.push_back(std::move(result.passes[0].film));
    independent.push_back(std::move(result.passes[1].film));
  }
  const std::vector<std::string> names = {"a", "b"};
  const Film g = merge_films(crn, names), h = merge_films(independent, names);
  EXPECT_EQ(h.count(7, 9), independent[0].count(7, 9) + independent[1].count(7, 9));
  const EstimatorResult result = make_estimator("dependent-tests").image({rows_of(g, 0, 30), rows_of(h, 0, 30)}, {});
  for (const float value : result.estimate.data) EXPECT_TRUE(std::isfinite(value));
}

/// Passes of a crop equal the same pixels of the whole frame, except where counts depend on other pixels.
TEST(AdaptivePlan, CropsHaveTheFramesFirstPass) {
  const LoadedScene scene = load_sized(kRoom);
  RenderRequest request = request_of(24);
  Method uniform = make_estimator("dependent-tests");
  uniform.adaptive->counts.allocation = Allocation::kUniform;
  const RenderResult frame = render(scene, adaptive_plan(uniform), request);
  request.crop = CropWindow{8, 5, 20, 15};
  const RenderResult crop = render(scene, adaptive_plan(uniform), request);
  for (const int pass : {0, 1})
    for (int y = 0; y < 15; ++y)
      for (int x = 0; x < 20; ++x)
        EXPECT_EQ(crop.passes[pass].film.mean(x, y), frame.passes[pass].film.mean(x + 8, y + 5));
}

TEST(AdaptivePlan, ALimitOfTimeEndsWithAnImage) {
  const LoadedScene scene = load_sized(kRoom);
  RenderRequest request = request_of(1);
  request.spp.reset();
  for (const double seconds : {0.001, 0.4}) {
    request.seconds = seconds;
    for (const Plan& plan : {plan_of("dependent-tests"), plain_adaptive(), adaptive_plan(denoised())}) {
      const RenderResult result = render(scene, plan, request);
      EXPECT_FALSE(result.interrupted);
      ASSERT_EQ(result.passes.size(), 2u);
      EXPECT_GE(result.passes[0].film.mean_count(), 1);
      EXPECT_GE(result.passes[1].film.mean_count(), 1);
      EXPECT_FALSE(result.image.estimate.data.empty());
    }
  }
}

TEST(AdaptivePlan, PlansMemoryForBothPasses) {
  const LoadedScene scene = load_sized(kRoom);
  const RenderMemory memory = render_memory(scene, plan_of("dependent-tests"), request_of(10));
  EXPECT_EQ(memory.films, 40 * 30 * 2 * (2 * 12 + 4));
}

/// A third of the samples decide where the others go; the image is made of all.
TEST(DenoisedPlan, TopsUpWhereTheFilteredImageIsWrong) {
  const LoadedScene scene = load_sized(kRoom);
  const RenderResult result = render(scene, adaptive_plan(denoised()), request_of(72));
  ASSERT_EQ(result.passes.size(), 2u);
  const Film &first = result.passes[0].film, &last = result.passes[1].film;
  EXPECT_EQ(result.passes[0].plan.id(), "first-1");
  EXPECT_NE(result.passes[0].settings.pass, result.passes[1].settings.pass) << "random numbers of its own";
  EXPECT_EQ(first.groups(), 12);
  for (const uint32_t n : first.counts()) EXPECT_EQ(n, 24u);
  EXPECT_NEAR(last.mean_count(), 48, 0.48);
  const auto [least, most] = std::minmax_element(last.counts().begin(), last.counts().end());
  EXPECT_GE(*least, 11u) << "half of the mean, those of the first pass among them";
  EXPECT_GT(*most, *least + 12);
  const Film both = joined(first, last);
  EXPECT_EQ(both.count(7, 9), 24 + last.count(7, 9));
  const Spectrum sum = 24.0f * first.mean(7, 9) + static_cast<float>(last.count(7, 9)) * last.mean(7, 9);
  EXPECT_NEAR(both.mean(7, 9).r * static_cast<float>(both.count(7, 9)), sum.r, 1e-4 * sum.r);
  ASSERT_TRUE(result.predicted);
  EXPECT_GT(result.predicted->relmse, 0);
}

/// Radiance 100 in one sample out of a hundred.
class FoundByChance : public Integrator {
 public:
  std::shared_ptr<Integrator> clone() const override { return std::make_shared<FoundByChance>(); }
  void trace(const Scene&, std::span<CameraSample> samples, PathContext&) const override {
    for (CameraSample& sample : samples)
      sample.radiance = Spectrum(sample.random.get_1d(1, Event::kLobe) < 0.01f ? 100.0f : 0.01f);
  }
  std::string description() const override { return "found by chance"; }
};

TEST(DenoisedPlan, SpreadsSamplesEvenlyWhereLightIsFoundByChance) {
  LoadedScene scene = load_sized(kRoom);
  scene.integrator = std::make_shared<FoundByChance>();
  const RenderResult result = render(scene, adaptive_plan(denoised()), request_of(72));
  for (const uint32_t n : result.passes[1].film.counts()) EXPECT_EQ(n, 48u);
}

TEST(DenoisedPlan, SameBitsForAnyNumberOfThreads) {
  const LoadedScene scene = load_sized(kRoom);
  std::vector<float> first;
  for (const int threads : {1, 2, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const RenderResult result = render(scene, adaptive_plan(denoised()), request_of(24));
    if (first.empty()) first = result.image.estimate.data;
    EXPECT_EQ(result.image.estimate.data, first);
  }
}

TEST(DenoisedPlan, AddsSamplesUntilAnErrorIsReached) {
  const LoadedScene scene = load_sized(kRoom);
  RenderRequest request = request_of(1000);
  request.until = 0.6 * render(scene, adaptive_plan(denoised()), request_of(96)).predicted->relmse;
  const RenderResult result = render(scene, adaptive_plan(denoised()), request);
  EXPECT_TRUE(result.until_reached.value());
  EXPECT_GT(result.samples_per_pixel(), 110);
}

TEST(UnbiasedPlan, IsTheMeanOfItsLastPass) {
  const LoadedScene scene = load_sized(kRoom);
  const RenderResult result = render(scene, plain_adaptive(), request_of(40));
  ASSERT_EQ(result.passes.size(), 2u);
  EXPECT_EQ(result.passes[0].plan.id(), "pilot-1");
  EXPECT_EQ(result.passes[0].settings.sampling, Sampling::kIndependent);
  EXPECT_NE(result.passes[0].settings.pass, result.passes[1].settings.pass) << "random numbers of its own";
  EXPECT_EQ(result.image.estimate.data, result.passes[1].film.mean_image().data);
  EXPECT_NEAR(result.samples_per_pixel(), 40, 0.4);
  for (const uint32_t n : result.passes[1].film.counts()) EXPECT_GE(n, 1u);
  ASSERT_TRUE(result.predicted);
  EXPECT_GT(result.predicted->relmse, 0);
}

TEST(UnbiasedPlan, AddsSamplesUntilAnErrorIsReached) {
  const LoadedScene scene = load_sized(kRoom);
  RenderRequest request = request_of(1000);
  const double first = render(scene, plain_adaptive(), request_of(96)).predicted->relmse;
  request.until = first / 2;
  const RenderResult result = render(scene, plain_adaptive(), request);
  EXPECT_TRUE(result.until_reached.value());
  EXPECT_GT(result.samples_per_pixel(), 110);
}

/// Pixels whose samples are 0 or, rarely, large; the expected value is 1 everywhere. For one seed, the mean over the
/// pixels of the published combination and of the unbiased plan, minus that value.
struct RareLight {
  double published, unbiased;
};
RareLight rare_light(uint64_t seed) {
  constexpr int kPixels = 400, kFirst = 20;
  constexpr float kProbability = 0.05f;
  const auto value = [&](uint32_t pass, int pixel, uint32_t sample) {
    const PathRandom random(Sampling::kIndependent, seed, pass, static_cast<uint64_t>(pixel), sample);
    return random.get_1d(0, Event::kLens) < kProbability ? 1 / kProbability : 0.5f * random.get_1d(1, Event::kLens);
  };
  const double expected = 1 + (1 - kProbability) * 0.25;
  Film first(kPixels, 1, {0, 0, kPixels, 1}, 1), pilot = first;
  first.keep_sample_variance(), pilot.keep_sample_variance();
  for (int p = 0; p < kPixels; ++p)
    for (uint32_t s = 0; s < kFirst; ++s) {
      first.add(p, 0, Spectrum(value(0, p, s)));
      pilot.add(p, 0, Spectrum(value(1, p, s)));
    }
  const auto mean_after = [&](const Film& film, const CountOptions& options, bool averaged_in) {
    const std::vector<uint32_t> counts = sample_counts(rows_of(film, 0, 1), 20, options);
    double mean = 0;
    for (int p = 0; p < kPixels; ++p) {
      double sum = averaged_in ? kFirst * film.mean(p, 0).r : 0;
      for (uint32_t s = 0; s < counts[p]; ++s) sum += value(2, p, s);
      mean += sum / (counts[p] + (averaged_in ? kFirst : 0)) / kPixels;
    }
    return mean - expected;
  };
  return {mean_after(first, make_estimator("dependent-tests", {{"paper", ""}}).adaptive->counts, true),
          mean_after(pilot, make_estimator("none", {{"adaptive", ""}}).adaptive->counts, false)};
}

TEST(UnbiasedPlan, PassesTheTestThatThePublishedCombinationFails) {
  std::vector<double> published, unbiased;
  for (uint64_t seed = 0; seed < 64; ++seed) {
    const RareLight errors = rare_light(seed);
    published.push_back(errors.published);
    unbiased.push_back(errors.unbiased);
  }
  const statistics::TestResult fair = statistics::t_test(unbiased, 0), biased = statistics::t_test(published, 0);
  EXPECT_TRUE(fair.accepted) << fair.message;
  EXPECT_LT(biased.p_value, 1e-12) << biased.message;
  // A bias of this size would be detected in the unbiased plan with probability 0.99; the other's is larger.
  statistics::Moments of_unbiased, of_published;
  for (const double e : unbiased) of_unbiased.add(e);
  for (const double e : published) of_published.add(e);
  const double seen =
      statistics::smallest_detectable(std::sqrt(of_unbiased.sample_variance()), 64, statistics::test_alpha(), 0.99);
  EXPECT_GT(std::abs(of_published.mean()), seen);
}

}  // namespace
}  // namespace covary
