// SPDX-License-Identifier: Apache-2.0
// What an interrupted render leaves, and the phase in which there is nothing to see yet: auxiliary images.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>

#include "film/film_file.h"
#include "film/image_file.h"
#include "integrators/aov.h"
#include "plans/estimator_plans.h"
#include "plans/render.h"
#include "support/files.h"
#include "support/plans.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of;

namespace fs = std::filesystem;
using test_support::TemporaryFolder;

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

TEST(Interrupted, AnImageOfAllSamplesSoFar) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(96);
  request.output = folder.file("a.exr");
  request.preview = true;
  StopAfter old_enough(40);  // 12 tiles are one wave of one pass
  RenderResult result = render(scene, average_plan(), request, old_enough.callbacks);
  ASSERT_TRUE(result.interrupted);
  EXPECT_EQ(attribute_of(request.output, "complete"), "false");
  EXPECT_EQ(attribute_of(request.output, "estimator"), "average");
  EXPECT_EQ(read_image(request.output).image.data, result.image.estimate.data);
  EXPECT_TRUE(fs::exists(folder.file("a.png")));
  EXPECT_TRUE(fs::exists(folder.file("a.passes/crn.exr")));
}

TEST(Interrupted, TheMeanWhereFilmsAreTooYoungForTheEstimator) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(96);
  request.output = folder.file("a.exr");
  StopAfter young(3);  // of 12 tiles of the first wave
  const RenderResult result = render(scene, average_plan(), request, young.callbacks);
  ASSERT_TRUE(result.interrupted);
  EXPECT_TRUE(result.image.estimate.data.empty());
  EXPECT_EQ(attribute_of(request.output, "estimator"), "none");
  const Image image = read_image(request.output).image;
  const Film& film = result.passes[0].film;
  int seen = 0;
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) {
      seen += film.count(x, y) > 0;
      ASSERT_EQ(image.rgb(x, y), film.mean(x, y)) << "the second pass has no samples, and takes no part";
    }
  EXPECT_GT(seen, 0);
}

TEST(Interrupted, NothingIsWrittenBeforeTheFirstSample) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(96);
  request.output = folder.file("a.exr");
  request.aovs = true;
  StopAfter at_once(0);
  at_once.stop = true;
  const RenderResult result = render(scene, average_plan(), request, at_once.callbacks);
  EXPECT_TRUE(result.interrupted);
  EXPECT_EQ(result.kept, "");
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(Interrupted, AFilmThatIsTheOutputSaysThatItIsNotComplete) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(96);
  request.output = folder.file("a.exr");
  request.aovs = true;
  StopAfter stop(30 + 20);  // rows of the auxiliary images, and tiles
  const RenderResult result = render(scene, plain_plan(Sampling::kIndependent), request, stop.callbacks);
  ASSERT_TRUE(result.interrupted);
  EXPECT_EQ(result.kept, request.output);
  EXPECT_EQ(read_film_attributes(request.output).at("complete"), "false");
  EXPECT_EQ(read_film(request.output).aovs.size(), kAuxiliaryFeatures.size());
  const Film film = read_film(request.output);
  const auto [fewest, most] = std::ranges::minmax(film.counts());
  ASSERT_LT(fewest, most);
  RenderRequest fewer = request;
  fewer.resume = true, fewer.spp = most - 1;
  EXPECT_TRUE(contains(
      message_of([&] { render(scene, plain_plan(Sampling::kIndependent), fewer); }, ErrorCode::kInput),
      fmt::format("was interrupted with {} to {} samples per pixel, this command asks for {}", fewest, most, most - 1)))
      << "it would be called complete with unequal numbers";
  EXPECT_EQ(read_film_attributes(request.output).at("complete"), "false");
  request.resume = true;
  EXPECT_TRUE(render(scene, plain_plan(Sampling::kIndependent), request).complete);
  EXPECT_EQ(read_film_attributes(request.output).at("complete"), "true");
}

/// Stops a render when a phase begins.
struct StopBefore {
  explicit StopBefore(RenderStage stage) {
    callbacks.stop = &stop;
    callbacks.stage = [this, stage](RenderStage begun) { stop = stop || begun == stage; };
  }
  std::atomic<bool> stop{false};
  RenderCallbacks callbacks;
};

TEST(Interrupted, APictureOfTheFirstSamplesDuringAuxiliaryImages) {
  const LoadedScene scene = load_sized(kRoom);
  const Film one = render(scene, plain_plan(Sampling::kIndependent, 4), request_of(4)).passes[0].film;
  for (const bool is_film : {true, false}) {
    const Plan plan = is_film ? plain_plan(Sampling::kIndependent, 4) : average_plan();
    const TemporaryFolder folder;
    RenderRequest request = request_of(24);
    request.aovs = true;
    const RenderResult whole = render(scene, plan, request);
    request.output = folder.file("a.exr");
    StopBefore auxiliary(RenderStage::kAuxiliary);
    const RenderResult part = render(scene, plan, request, auxiliary.callbacks);
    EXPECT_TRUE(part.interrupted);
    EXPECT_EQ(part.samples_per_pixel(), 1);
    EXPECT_EQ(part.kept, is_film ? request.output : folder.file("a.passes"));
    const Image image = read_image(request.output).image;
    EXPECT_EQ(image.data, part.passes[0].film.mean_image().data);
    for (int i = 0; is_film && i < 3; ++i) EXPECT_EQ(image.pixel(20, 15)[i], one.group_mean(20, 15, 0)[i]);
    request.resume = true;
    const RenderResult resumed = render(scene, plan, request);
    ASSERT_EQ(resumed.passes.size(), whole.passes.size());
    for (size_t i = 0; i < whole.passes.size(); ++i)
      EXPECT_TRUE(same_bits(resumed.passes[i].film, whole.passes[i].film));
    EXPECT_EQ(resumed.aovs.at("Albedo").data, whole.aovs.at("Albedo").data);
  }
}

TEST(AuxiliaryImages, AreTimedAsRenderingAndEndWithTheRender) {
  const LoadedScene scene = load_sized(kRoom);
  RenderRequest request = request_of(12);
  request.aovs = true;
  RenderResult result = render(scene, average_plan(), request);
  EXPECT_GT(result.seconds.auxiliary, 0);
  EXPECT_GE(result.render_seconds(), result.seconds.auxiliary + result.passes[0].result.seconds);
  EXPECT_EQ(result.aovs.size(), kAuxiliaryFeatures.size());
  EXPECT_TRUE(result.passes[1].film.aovs.empty());
  request.seconds = 1e-6;
  request.spp.reset();
  const RenderResult timed = render(scene, plain_plan(Sampling::kIndependent), request);
  EXPECT_GE(timed.seconds.limited, timed.seconds.auxiliary);
  EXPECT_EQ(timed.passes[0].film.mean_count(), 1)
      << "no time was left after the auxiliary images and the first samples";
}

TEST(AuxiliaryImages, LeaveASampleForEachGroupWhenTheTimeIsOver) {
  const LoadedScene scene = load_sized(kRoom);
  RenderRequest request = request_of(24);
  request.aovs = true;
  request.seconds = 1e-6, request.until = 1e-9;
  const RenderResult result = render(scene, plain_plan(Sampling::kIndependent, 12), request);
  EXPECT_EQ(result.passes[0].film.mean_count(), 12);
  EXPECT_TRUE(result.predicted);
}

TEST(AuxiliaryImages, EndAtOnceWhenStopped) {
  const LoadedScene scene = load_sized(kRoom);
  PassSettings settings;
  settings.filter = scene.filter;
  Film film(40, 30, {0, 0, 40, 30}, 1);
  std::atomic<bool> stop{true};
  render_aovs(*scene.scene, settings, 4, film, &stop);
  EXPECT_TRUE(film.aovs.empty());
  stop = false;
  render_aovs(*scene.scene, settings, 4, film, &stop);
  EXPECT_EQ(film.aovs.size(), kAuxiliaryFeatures.size());
}

}  // namespace
}  // namespace covary
