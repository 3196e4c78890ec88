// SPDX-License-Identifier: Apache-2.0
// Plans executed without a command line: results, phases, stop token, resuming, files.
#include "plans/render.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>

#include "combine/registry.h"
#include "core/random.h"
#include "core/stop.h"
#include "core/stopwatch.h"
#include "film/film_file.h"
#include "film/image_file.h"
#include "plans/budget.h"
#include "plans/estimator_plans.h"
#include "plans/integrator_choice.h"
#include "support/files.h"
#include "support/plans.h"

namespace covary {
namespace {

namespace fs = std::filesystem;
using test_support::TemporaryFolder;

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

TEST(Render, OnePassIsTheFilmOfRenderPass) {
  const LoadedScene scene = load_sized(kRoom);
  const RenderResult result = render(scene, plain_plan(Sampling::kIndependent), request_of(6));
  ASSERT_EQ(result.passes.size(), 1u);
  EXPECT_TRUE(result.complete);
  EXPECT_FALSE(result.interrupted);
  PassSettings settings;
  settings.seed = 5, settings.spp = 6, settings.filter = scene.filter;
  Film film(40, 30, {0, 0, 40, 30}, 1);
  render_pass(*scene.scene, integrator_of(scene), settings, film);
  EXPECT_TRUE(same_bits(result.passes[0].film, film));
  EXPECT_EQ(result.picture().data, film.mean_image().data);
}

TEST(Render, AnEmptyPlanIsAUsageError) { EXPECT_THROW(render(load_sized(kRoom), Plan{}, request_of(6)), Error); }

TEST(Render, ACropOutsideTheFrameAndImpossibleLimitsAreUsageErrors) {
  const LoadedScene scene = load_sized(kRoom);
  RenderRequest request = request_of(6);
  request.crop = CropWindow{30, 0, 11, 10};
  EXPECT_THROW(render(scene, plain_plan(Sampling::kIndependent), request), Error);
  request = request_of(6);
  request.until = 0.1;
  EXPECT_THROW(render(scene, average_plan(), request), Error) << "no predicted error";
  request.until = 0;
  request.seconds = 1;
  EXPECT_THROW(render(scene, samples_plan(make_estimator("polynomials")), request), Error);
}

/// An estimate that is stopped is restarted for an image of the samples so far, unless it had taken long.
TEST(Render, AnEstimateThatTookLongUntilItWasStoppedIsNotMadeAgain) {
  const LoadedScene scene = load_sized(kRoom);
  for (const auto& [milliseconds, expected] : {std::pair(0, 2), std::pair(700, 1)}) {
    std::atomic<bool> stop{false};
    RenderCallbacks callbacks;
    callbacks.stop = &stop;
    int n_estimates = 0;
    const Plan plan = with_image(average_plan(), [&, wait = milliseconds](const auto& average, const auto&) {
      if (++n_estimates == 1) {
        std::this_thread::sleep_for(std::chrono::milliseconds(wait));
        for (stop = true;; std::this_thread::yield()) throw_if_stopped();
      }
      return average();
    });
    const RenderResult result = render(scene, plan, request_of(24), callbacks);
    EXPECT_TRUE(result.interrupted);
    EXPECT_EQ(n_estimates, expected) << milliseconds;
    EXPECT_EQ(result.passes[0].film.mean_count(), 12);
  }
}

/// Scenes that stopped work has loaded live on beside those of other work that is stopped, as in programs that use the
/// library; a render of the last one has the bits of the first.
TEST(Render, StopsAtAnyTimeWhileScenesLive) {
  std::vector<LoadedScene> kept;
  const auto work = [&] {
    kept.push_back(load_sized(kRoom, 64, 48));
    return render(kept.back(), average_plan(), request_of(48)).image.estimate.data;
  };
  const Stopwatch watch;
  const std::vector<float> expected = work();
  const double seconds = watch.seconds();
  for (uint64_t i = 0; i < 20; ++i) {
    const double chance = PathRandom(Sampling::kIndependent, 1, 0, i, 0).get_1d(0, Event::kPixel);
    const Stopwatch since;
    run_stoppable([&] { return since.seconds() > chance * seconds; }, work);
    EXPECT_EQ(render(kept.back(), average_plan(), request_of(48)).image.estimate.data, expected);
  }
  EXPECT_EQ(work(), expected);
}

TEST(Render, StoppedAtManyTilesAndResumedGivesTheSameBits) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(96);
  const RenderResult whole = render(scene, average_plan(), request);
  request.output = folder.file("a.exr");
  request.resume = true;
  int interruptions = 0;
  for (int tiles = 7;; tiles += 31) {
    StopAfter stop(tiles);
    const RenderResult part = render(scene, average_plan(), request, stop.callbacks);
    if (part.complete) {
      EXPECT_TRUE(same_bits(part.passes[0].film, whole.passes[0].film));
      EXPECT_TRUE(same_bits(part.passes[1].film, whole.passes[1].film));
      EXPECT_EQ(part.image.estimate.data, whole.image.estimate.data);
      break;
    }
    EXPECT_TRUE(part.interrupted);
    EXPECT_EQ(part.kept, folder.file("a.passes"));
    EXPECT_TRUE(fs::exists(part.kept + "/crn.exr"));
    ++interruptions;
  }
  EXPECT_GE(interruptions, 2);
  EXPECT_FALSE(fs::exists(folder.file("a.passes")));
  EXPECT_EQ(read_image(request.output).image.data, whole.image.estimate.data);
}

TEST(Render, FilmsInMemoryAloneWhenTheRequestNamesNoFile) {
  const LoadedScene scene = load_sized(kRoom);
  RenderRequest request = request_of(24);
  request.checkpoint_seconds = 1e-9;
  int waves = 0;
  RenderCallbacks callbacks;
  callbacks.wave = [&](std::span<const Pass> passes) {
    ++waves;
    EXPECT_EQ(preview_of(passes).width, 40);
  };
  const RenderResult result = render(scene, average_plan(), request, callbacks);
  EXPECT_EQ(waves, 2);
  EXPECT_TRUE(result.passes[0].path.empty());
}

TEST(Render, ProgressCountsAllSamplesOfTheCall) {
  const LoadedScene scene = load_sized(kRoom);
  std::atomic<uint64_t> last{0};
  RenderCallbacks callbacks;
  callbacks.progress = [&](uint64_t done, uint64_t total) {
    EXPECT_LE(done, total);
    for (uint64_t seen = last; seen < done && !last.compare_exchange_weak(seen, done);) continue;
  };
  render(scene, average_plan(), request_of(24), callbacks);
  EXPECT_EQ(last, 24u * 40 * 30);
}

// Each learns something else, from another seed and crop; training held by the scene's integrator would be shared.
TEST(Render, TwoThreadsMayRenderOneSceneThatLearns) {
  for (const char* name : {"controlled-path", "guided-path", "bdpt"}) {
    LoadOptions options;
    options.width = 40, options.height = 30;
    IntegratorChoice choice;
    choice.name = name;
    options.make_integrator = integrator_maker(choice);
    const LoadedScene scene = load_scene(kRoom, options);
    RenderRequest requests[2] = {request_of(4), request_of(4)};
    requests[0].crop = CropWindow{0, 0, 24, 20};
    requests[1].seed = 9, requests[1].crop = CropWindow{13, 8, 27, 22};
    const auto run = [&](int i) { return render(scene, plain_plan(Sampling::kIndependent), requests[i]); };
    const RenderResult alone[2] = {run(0), run(1)};
    for (int repeat = 0; repeat < 3; ++repeat) {
      RenderResult together[2];
      std::thread other([&] { together[1] = run(1); });
      together[0] = run(0);
      other.join();
      for (int i = 0; i < 2; ++i) {
        EXPECT_TRUE(same_bits(together[i].passes[0].film, alone[i].passes[0].film)) << name << ' ' << i;
        EXPECT_EQ(together[i].integrator->description(), alone[i].integrator->description()) << name << ' ' << i;
      }
    }
    EXPECT_EQ(integrator_of(scene).description(), integrator_of(scene).clone()->description()) << "nothing was learnt";
  }
}

TEST(Render, ReplayGivesTheSampleOfThePassOfThatNumber) {
  const LoadedScene scene = load_sized(kRoom);
  const RenderRequest request = request_of(1);
  Plan plan = plain_plan(Sampling::kIndependent);
  plan.phases[0].passes = [](const PlanState&) {
    PassPlan pass;
    pass.name = "independent";
    pass.number = 3;
    return std::vector{pass};
  };
  const Film film = render(scene, plan, request).passes[0].film;
  EXPECT_EQ(replay(scene, plan, request, {Sampling::kIndependent, 3, 11, 13, 0}).value, film.mean(11, 13));
  EXPECT_NE(replay(scene, plan, request, {Sampling::kIndependent, 0, 11, 13, 0}).value, film.mean(11, 13));
  EXPECT_THROW(replay(scene, plan, request, {Sampling::kIndependent, 3, 40, 13, 0}), Error);
}

/// A CRN pass of 12 samples, then an independent one with more samples the brighter the first image is.
Plan two_phases(int& trainings) {
  Plan plan = average_plan();
  plan.phases.resize(2);
  Phase &first = plan.phases[0], &second = plan.phases[1];
  first.share = second.share = 0.5;
  first.passes = [](const PlanState&) {
    PassPlan pass;
    pass.name = "crn";
    pass.sampling = Sampling::kCrn;
    pass.groups = 4;
    return std::vector{pass};
  };
  first.set_targets = [](const PlanState&, std::span<Pass> passes) { passes[0].settings.spp = 12; };
  second.prepare = [&trainings](PlanState& state) {
    EXPECT_EQ(state.passes.size(), 1u);
    EXPECT_EQ(state.pass("crn").count, 12u);
    ++trainings;
  };
  second.passes = [](const PlanState&) {
    PassPlan pass;
    pass.name = "light";
    pass.number = 1;
    pass.groups = 4;
    pass.settings = "; trained 17";
    return std::vector{pass};
  };
  second.set_targets = [](const PlanState& state, std::span<Pass> passes) {
    const Image image = state.pass("crn").film.mean_image();
    double sum = 0;
    for (float value : image.data) sum += value;
    passes[0].settings.spp = sum > 0 ? 8 : 4;
  };
  return plan;
}

TEST(Phases, ReadWhatEarlierPhasesLeft) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(20);
  request.passes = folder.file("films");
  int trainings = 0;
  const RenderResult result = render(scene, two_phases(trainings), request);
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(trainings, 1);
  ASSERT_EQ(result.passes.size(), 2u);
  EXPECT_EQ(result.passes[1].film.count(3, 3), 8u);
  const auto attributes = read_film_attributes(request.passes + "/light-1.exr");
  EXPECT_TRUE(attributes.at("settings").ends_with("; pass 1; trained 17")) << attributes.at("settings");
}

TEST(Phases, AnInterruptedPhaseResumesToTheSameBits) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(20);
  int trainings = 0;
  const RenderResult whole = render(scene, two_phases(trainings), request);
  request.passes = folder.file("films");
  request.resume = true;
  for (int tiles : {3, 20, 1000}) {  // interrupts the first phase, the second, neither
    StopAfter stop(tiles);
    const RenderResult part = render(scene, two_phases(trainings), request, stop.callbacks);
    EXPECT_EQ(part.interrupted, tiles < 1000);
    EXPECT_EQ(part.passes.size(), tiles == 3 ? 1u : 2u);
    if (part.interrupted) continue;
    EXPECT_TRUE(same_bits(part.passes[0].film, whole.passes[0].film));
    EXPECT_TRUE(same_bits(part.passes[1].film, whole.passes[1].film));
  }
}

TEST(Phases, PassesWithoutIdentitiesOfTheirOwnAreRefused) {
  const LoadedScene scene = load_sized(kRoom);
  Plan plan = average_plan();
  plan.phases[0].passes = [](const PlanState&) {
    std::vector<PassPlan> passes(2);
    passes[0].name = "a", passes[1].name = "b";  // the same random numbers
    return passes;
  };
  EXPECT_THROW(render(scene, plan, request_of(8)), Error);
}

/// Samples and groups of each pass.
std::vector<std::pair<uint32_t, int>> taken(const Plan& plan, const RenderRequest& request) {
  static const LoadedScene scene = load_sized(kRoom, 3, 2);
  std::vector<std::pair<uint32_t, int>> result;
  for (const Pass& pass : render(scene, plan, request).passes)
    result.emplace_back(pass.film.count(2, 1), pass.film.groups());
  return result;
}

TEST(Budget, IsTakenToTheSample) {
  using Taken = std::vector<std::pair<uint32_t, int>>;
  Method method;
  PassChoice choice;
  method.name = "average", method.min_groups = 3;
  PassPair passes;
  passes.image = [](const GroupedImage&, const GroupedImage&, const MethodSettings&) {
    return EstimatorResult{.estimate = Image(3, 2, 3)};
  };
  method.passes = passes;
  const auto pair = [&](uint32_t spp) { return taken(pair_plan(method, choice), request_of(spp)); };
  EXPECT_EQ(pair(192), (Taken{{96, 12}, {96, 12}}));
  EXPECT_EQ(pair(96), (Taken{{48, 12}, {48, 12}}));
  EXPECT_EQ(pair(32), (Taken{{16, 8}, {16, 8}}));
  EXPECT_EQ(pair(25), (Taken{{13, 12}, {12, 12}}));
  EXPECT_EQ(pair(9), (Taken{{5, 4}, {4, 4}}));
  EXPECT_EQ(pair(7), (Taken{{4, 4}, {4, 4}})) << "as few as every method can use";
  method.min_groups = 4;
  for (uint32_t spp : {6u, 7u, 8u, 9u, 13u, 25u}) {
    const Taken more = pair(spp);
    method.min_groups = 3;
    EXPECT_EQ(pair(spp), more) << "methods that share films agree";
    method.min_groups = 4;
  }
  method.min_groups = 3, choice.groups = 3;
  EXPECT_EQ(pair(7), (Taken{{4, 3}, {3, 3}}));
  choice.split = {0.25, 0.75};
  EXPECT_EQ(pair(33), (Taken{{8, 3}, {25, 3}}));
  EXPECT_EQ(taken(plain_plan(Sampling::kIndependent), request_of(7)), (Taken{{7, 1}}));
  EXPECT_EQ(taken(plain_plan(Sampling::kCrn), request_of(32)), (Taken{{32, 8}}));
  EXPECT_EQ(taken(plain_plan(Sampling::kCrn), request_of(17)), (Taken{{17, 12}}));
  EXPECT_EQ(taken(plain_plan(Sampling::kIndependent, 12), request_of(32)), (Taken{{32, 12}}));
  EXPECT_EQ(taken(plain_plan(Sampling::kIndependent, 12), request_of(7)), (Taken{{12, 12}}));
}

TEST(Budget, OnTheWayToAnErrorGroupsAreEqualUpToTheLimit) {
  RenderRequest request = request_of(150);
  request.until = 1e-9;
  const auto all = taken(plain_plan(Sampling::kIndependent), request);
  EXPECT_EQ(all[0], (std::pair<uint32_t, int>{150, 12})) << "the limit itself";
  request.until = 1e9;
  request.spp = 95;
  EXPECT_EQ(taken(plain_plan(Sampling::kIndependent), request)[0], (std::pair<uint32_t, int>{95, 12}));
}

/// A larger number of samples would have resulted in another number of groups, if requested at once.
TEST(Budget, AContinuedFilmKeepsItsGroups) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(96);
  request.passes = folder.file("films");
  request.resume = true;
  EXPECT_EQ(render(scene, average_plan(), request).passes[0].film.groups(), 12);
  request.spp = 100;
  const RenderResult more = render(scene, average_plan(), request);
  EXPECT_EQ(more.passes[0].film.groups(), 12);
  EXPECT_EQ(more.passes[0].film.count(7, 7), 50u);
  EXPECT_EQ(more.passes[1].film.count(7, 7), 50u);
}

TEST(Budget, FollowsThePredictedError) {
  EXPECT_EQ(next_budget(96, 0.02, 0.01, 1000, 4), 196u) << "1.02 times what 1 / samples says";
  EXPECT_EQ(next_budget(96, 1, 0.01, 1000, 4), 384u) << "at most four times";
  EXPECT_EQ(next_budget(96, 0.0101, 0.01, 1000, 4), 102u) << "at least 6 % more";
  EXPECT_EQ(next_budget(96, 1, 0.01, 300, 4), 300u);
  EXPECT_EQ(next_budget(96, 1, 0.01, 1000, 2), 192u);
}

}  // namespace
}  // namespace covary
