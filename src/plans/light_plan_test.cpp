// SPDX-License-Identifier: Apache-2.0
// Plans whose integrator traces light: passes, numbers of light paths, images, files, interruptions.
#include "plans/light_plan.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <filesystem>
#include <random>

#include "combine/combine.h"
#include "combine/registry.h"
#include "denoising/denoising_choice.h"
#include "estimators/mean.h"
#include "film/film_file.h"
#include "film/splat_layer.h"
#include "plans/memory.h"
#include "risk/image_risk.h"
#include "risk/predicted_error.h"
#include "scene/property_source.h"
#include "support/files.h"
#include "support/light_tracer.h"
#include "support/plans.h"

namespace covary {
namespace {

namespace fs = std::filesystem;
using test_support::contains, test_support::corner_text, test_support::LightTracer, test_support::message_of,
    test_support::test_file;

constexpr int kWidth = 24, kHeight = 16;

/// A scene whose integrator combines `path` and a light tracer, half of the light each.
LoadedScene light_scene(LightTracing mode = LightTracing::kAuto, double paths = 1) {
  LoadOptions options;
  options.make_integrator = [&](Parameters& parameters) {
    PathLengthSettings lengths = read_settings<PathLengthSettings>(parameters);
    lengths.max_depth = 3;
    return std::make_shared<LightTracer>(LightTracingSettings{mode, paths}, lengths, 0.5f);
  };
  return load_scene_text(corner_text(kWidth, kHeight, "tent"), "corner", options);
}

Plan plan_of(const char* estimator, std::optional<int> groups = {}) {
  PassChoice choice;
  choice.groups = groups;
  return estimator_plan(make_estimator(estimator), choice);
}

uint64_t light_paths_of(const RenderResult& result) { return light_paths(light_pass(result.passes)->film); }

TEST(LightPlan, APlainRenderHasALightPass) {
  const LoadedScene scene = light_scene();
  const RenderResult result = render(scene, plan_of("none"), request_of(16));
  ASSERT_EQ(result.passes.size(), 2u);
  EXPECT_EQ(result.passes[1].plan.id(), "light");
  EXPECT_EQ(result.samples_per_pixel(), 16);
  EXPECT_EQ(light_paths_of(result), 16u * kWidth * kHeight);
  EXPECT_EQ(result.passes[1].result.n_samples, 16u * kWidth * kHeight);
  EXPECT_TRUE(result.complete);
  const Image image = result.picture();
  const Film &camera = result.passes[0].film, &light = result.passes[1].film;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) EXPECT_EQ(image.rgb(x, y), camera.mean(x, y) + light.mean(x, y));
  EXPECT_EQ(camera.attributes.at(film_key::kSettings), light.attributes.at(film_key::kSettings));
  EXPECT_TRUE(contains(camera.attributes.at(film_key::kSettings), "light_paths_per_spp=384"));

  const RenderResult off = render(light_scene(LightTracing::kOff), plan_of("none"), request_of(16));
  EXPECT_EQ(off.passes.size(), 1u);
  double sum = 0, path = 0;
  for (const float v : image.data) sum += v;
  for (const float v : off.picture().data) path += v;
  EXPECT_NEAR(sum / path, 1, 0.02);
}

TEST(LightPlan, BesideCrnThereIsOneWhereItIsAskedFor) {
  const RenderResult automatic = render(light_scene(), plan_of("iicv"), request_of(24));
  EXPECT_EQ(automatic.passes.size(), 2u);
  EXPECT_TRUE(contains(automatic.passes[0].film.attributes.at(film_key::kSettings), "light_tracing=off"));
  const RenderResult on = render(light_scene(LightTracing::kOn, 0.5), plan_of("iicv", 6), request_of(24));
  ASSERT_EQ(on.passes.size(), 3u);
  EXPECT_EQ(on.passes[2].film.groups(), 6);
  EXPECT_EQ(light_paths_of(on), 24u * kWidth * kHeight / 2);
  // The estimator reads the camera's films; the mean of the light film is added, and so are variances.
  const Film &crn = on.passes[0].film, &independent = on.passes[1].film;
  const EstimatorResult expected =
      finish(make_estimator("iicv").image({rows_of(crn, 0, kHeight), rows_of(independent, 0, kHeight)}, {12, true}));
  const EstimatorResult light = mean_of_groups(rows_of(on.passes[2].film, 0, kHeight));
  for (size_t i = 0; i < expected.estimate.data.size(); ++i) {
    ASSERT_EQ(on.image.estimate.data[i], expected.estimate.data[i] + light.estimate.data[i]);
    ASSERT_FLOAT_EQ(on.image.std_error.data[i], std::hypot(expected.std_error.data[i], light.std_error.data[i]));
  }
  EXPECT_EQ(on.predicted->relmse, predicted_relmse(on.image));
  EXPECT_EQ(render(light_scene(), plain_plan(Sampling::kCrn), request_of(24)).passes.size(), 1u);
}

TEST(LightPlan, TheDefaultDenoisesTheLightPathsToo) {
  const Method method = make_default_estimator(false, {}, {DenoisingChoice::kAuto, "off", {}});
  const RenderResult result =
      render(light_scene(LightTracing::kOn), estimator_plan(method, {.groups = 6}), request_of(24));
  ASSERT_EQ(result.passes.size(), 2u);
  const Film sum = sum_of_films(result.passes[0].film, result.passes[1].film);
  MethodSettings settings{24, true};
  settings.features = features_among(result.aovs);
  const EstimatorResult expected = finish(method.image({{}, rows_of(sum, 0, kHeight)}, settings));
  EXPECT_EQ(result.image.estimate.data, expected.estimate.data);
  EXPECT_EQ(result.image.std_error.data, expected.std_error.data);
}

TEST(LightPlan, LightPathsFollowSamplesPixelsAndBundles) {
  RenderRequest request = request_of(6);
  EXPECT_EQ(light_paths_of(render(light_scene(LightTracing::kAuto, 2), plan_of("none"), request)),
            2u * 6 * kWidth * kHeight);
  request.crop = CropWindow{2, 2, 16, 8};
  const RenderResult crop = render(light_scene(), plan_of("none"), request);
  EXPECT_EQ(light_paths_of(crop), 6u * 16 * 8);
  EXPECT_TRUE(contains(crop.passes[0].film.attributes.at(film_key::kSettings), "light_paths_per_spp=128"));
  request.crop = CropWindow{2, 2, 3, 3};  // fewer paths than a bundle
  EXPECT_EQ(light_paths_of(render(light_scene(), plan_of("none", 3), request)), 3u * kBundlePaths);
  // Rounded to bundles for all groups: 9.75 bundles.
  request = request_of(13), request.crop = CropWindow{0, 0, 12, 16};
  EXPECT_EQ(light_paths_of(render(light_scene(), plan_of("none", 4), request)), 8u * kBundlePaths);
}

TEST(LightPlan, TheImageIsAFilmThatCannotBeContinued) {
  const LoadedScene scene = light_scene();
  RenderRequest request = request_of(24);
  request.output = test_file("image.exr");
  const RenderResult result = render(scene, plan_of("none", 6), request);
  EXPECT_FALSE(fs::exists(test_file("image.passes")));
  Film film = read_film(request.output);
  EXPECT_EQ(film.attributes.at(film_key::kLight), "added");
  EXPECT_EQ(film.attributes.at(film_key::kComplete), "true");
  EXPECT_EQ(film.mean_count(), 24);
  for (int g = 0; g < 6; ++g)
    EXPECT_EQ(film.group_mean(5, 7, g),
              result.passes[0].film.group_mean(5, 7, g) + result.passes[1].film.group_mean(5, 7, g));
  // It is not the film of a pass, either.
  request.passes = test_file("passes");
  request.resume = true;
  fs::create_directory(request.passes);
  fs::copy_file(request.output, fs::path(request.passes) / "independent.exr");
  EXPECT_TRUE(contains(message_of([&] { render(scene, plan_of("none", 6), request); }, ErrorCode::kInput),
                       "was rendered with light_film added, this command asks for"));
}

TEST(LightPlan, AFolderOfPassesHoldsTheLightFilm) {
  const LoadedScene scene = light_scene();
  RenderRequest request = request_of(24);
  request.output = test_file("image.exr"), request.passes = test_file("passes");
  const RenderResult first = render(scene, plan_of("none", 6), request);
  const Film light = read_film(test_file("passes/light.exr"));
  EXPECT_TRUE(same_bits(light, first.passes[1].film));
  EXPECT_EQ(light.attributes.at(film_key::kLightPaths), "256");
  request.resume = true;
  const RenderResult again = render(scene, plan_of("none", 6), request);
  EXPECT_EQ(again.passes[1].result.n_samples, first.passes[1].result.n_samples) << "nothing was added";
  EXPECT_TRUE(same_bits(read_film(test_file("passes/light.exr")), light));
  request.spp = 48;
  EXPECT_EQ(light_paths_of(render(scene, plan_of("none", 6), request)), 48u * kWidth * kHeight);
  // Existing films keep their number of groups.
  request.spp = 60;
  Plan any = plain_plan(Sampling::kIndependent);
  any.phases[0].passes = [](const PlanState&) {
    PassPlan pass;
    pass.name = "independent", pass.groups = 4, pass.min_groups = 2;
    return std::vector{pass};
  };
  EXPECT_EQ(render(scene, any, request).passes[1].film.groups(), 6);
  // A film of camera samples is not a light film.
  fs::copy_file(test_file("passes/independent.exr"), test_file("passes/light.exr"),
                fs::copy_options::overwrite_existing);
  EXPECT_TRUE(contains(message_of([&] { render(scene, plan_of("none", 6), request); }, ErrorCode::kInput),
                       "light_paths_per_sample"));
}

TEST(LightPlan, AnyThreadsAndInterruptionsGiveTheSameBits) {
  const LoadedScene scene = light_scene(LightTracing::kOn);
  const Plan plan = plan_of("iicv", 4);
  const RenderResult whole = render(scene, plan, request_of(40));
  std::mt19937 random(3);
  for (const size_t threads : {1, 2, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    RenderRequest request = request_of(40);
    request.output = test_file("image.exr");
    request.resume = true;
    int interruptions = 0;
    for (bool complete = false; !complete;) {
      std::atomic<bool> stop{false};
      std::atomic<int> left{1 + static_cast<int>(random() % 60)};
      RenderCallbacks callbacks;
      callbacks.stop = &stop;
      callbacks.progress = [&](uint64_t done, uint64_t total) {
        EXPECT_LE(done, total);
        if (--left <= 0) stop = true;
      };
      const RenderResult result = render(scene, plan, request, callbacks);
      complete = !result.interrupted;  // all samples may be complete, but not the image
      interruptions += complete ? 0 : 1;
      if (!complete) continue;
      for (int i = 0; i < 3; ++i) EXPECT_TRUE(same_bits(result.passes[i].film, whole.passes[i].film)) << i;
      EXPECT_EQ(result.image.estimate.data, whole.image.estimate.data);
    }
    EXPECT_GT(interruptions, 0);
  }
}

TEST(LightPlan, APlainRenderIsResumedFromItsTwoFilms) {
  const LoadedScene scene = light_scene();
  RenderRequest request = request_of(32);
  request.output = test_file("image.exr");
  StopAfter stop(20);
  const RenderResult part = render(scene, plan_of("none"), request, stop.callbacks);
  ASSERT_TRUE(part.interrupted);
  EXPECT_EQ(part.kept, test_file("image.passes"));
  EXPECT_EQ(read_film(request.output).attributes.at(film_key::kComplete), "false");
  request.resume = true;
  const RenderResult rest = render(scene, plan_of("none"), request);
  const RenderResult whole = render(scene, plan_of("none"), request_of(32));
  EXPECT_EQ(rest.picture().data, whole.picture().data);
  EXPECT_FALSE(fs::exists(test_file("image.passes")));
}

TEST(LightPlan, UntilAWantedErrorLightPathsKeepStep) {
  const LoadedScene scene = light_scene();
  RenderRequest request;
  request.seed = 5;
  request.until = 0.002;
  const RenderResult result = render(scene, plan_of("none", 8), request);
  EXPECT_TRUE(*result.until_reached);
  EXPECT_GT(result.samples_per_pixel(), 96);
  EXPECT_NEAR(static_cast<double>(light_paths_of(result)), result.samples_per_pixel() * kWidth * kHeight,
              4 * kBundlePaths);
  MethodImage image = mean_of_groups(rows_of(result.passes[0].film, 0, kHeight));
  add_risk_of_mean(rows_of(result.passes[0].film, 0, kHeight), image);
  const GroupedImage light = rows_of(result.passes[1].film, 0, kHeight);
  const EstimatorResult expected = finish(image, &light);
  EXPECT_EQ(result.predicted->relmse, predicted_error(expected, 0, 0)->relmse);
}

TEST(LightPlan, ATimeLimitLeavesBothFilmsWithSamples) {
  const LoadedScene scene = light_scene();
  RenderRequest request;
  request.seconds = 1e-6;
  const RenderResult result = render(scene, plan_of("none", 4), request);
  EXPECT_EQ(result.samples_per_pixel(), 4);
  EXPECT_GE(light_paths_of(result), 4u * kBundlePaths);
  EXPECT_NEAR(static_cast<double>(light_paths_of(result)), 4.0 * kWidth * kHeight, 4 * kBundlePaths)
      << "as many as go with the samples";
  EXPECT_FALSE(result.interrupted);
}

TEST(LightPlan, ReplaysAreThoseOfTheFilms) {
  const LoadedScene scene = light_scene();
  RenderRequest request = request_of(1);
  request.crop = CropWindow{2, 3, 16, 12};
  const Plan plan = plan_of("none");
  const RenderResult result = render(scene, plan, request);
  EXPECT_EQ(replay(scene, plan, request, {Sampling::kIndependent, 0, 7, 9, 0}).value, result.passes[0].film.mean(5, 6));
  const Film& film = result.passes[1].film;
  Film replayed(kWidth, kHeight, *request.crop, 1);
  SplatLayer layer(replayed);
  ASSERT_TRUE(layer.begin_round(1));
  for (uint64_t path = 0; path < kBundlePaths; ++path)
    for (const LightSplat& splat : replay_light(scene, plan, request, path).splats)
      layer.add(splat.path, splat.x, splat.y, splat.value);
  layer.finish_round();
  EXPECT_TRUE(same_bits(film, replayed));
  EXPECT_TRUE(contains(message_of([&] { replay_light(scene, plan_of("iicv"), request, 0); }, ErrorCode::kUsage),
                       "there are no light paths"));
}

TEST(LightPlan, TheLightPassComesWithTheLastPhase) {
  const LoadedScene scene = light_scene(LightTracing::kOn);
  Plan plan = plain_plan(Sampling::kIndependent, 4);
  Phase first = plan.phases[0];
  first.share = 0.5;
  first.passes = [](const PlanState&) {
    PassPlan pass;
    pass.name = "pilot", pass.number = 1;
    return std::vector{pass};
  };
  first.set_targets = [](const PlanState&, std::span<Pass> passes) {
    ASSERT_EQ(passes.size(), 1u);
    passes[0].settings.spp = 8;
  };
  plan.phases[0].share = 0.5;
  plan.phases[0].set_targets = [](const PlanState& state, std::span<Pass> passes) {
    ASSERT_EQ(passes.size(), 1u);
    EXPECT_EQ(state.pass("pilot", 1).count, 8u);
    std::vector<uint32_t> map(size_t{kWidth} * kHeight, 12);
    std::fill(map.begin(), map.begin() + map.size() / 2, 4);
    passes[0].settings.spp = SampleTarget(map);
  };
  plan.phases.insert(plan.phases.begin(), first);
  const RenderResult result = render(scene, plan, request_of(16));
  ASSERT_EQ(result.passes.size(), 3u);
  EXPECT_EQ(result.passes[2].plan.id(), "light");
  EXPECT_EQ(light_paths_of(result), (8u + 8) * kWidth * kHeight);
}

TEST(LightPlan, MemoryCountsTheLightFilm) {
  const LoadedScene scene = light_scene();
  const double n = kWidth * kHeight;
  const RenderMemory with = render_memory(scene, plan_of("none", 4), request_of(16)),
                     without = render_memory(light_scene(LightTracing::kOff), plan_of("none", 4), request_of(16));
  EXPECT_EQ(with.films - without.films, n * (4 * 12 + 4) + 16e6);
  EXPECT_EQ(with.estimate - without.estimate, n * (4 * 12 + 4));
}

}  // namespace
}  // namespace covary
