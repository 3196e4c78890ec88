// SPDX-License-Identifier: Apache-2.0
// Renders that somebody watches and changes: RenderCallbacks from small_waves on.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "core/parallel.h"
#include "plans/render.h"
#include "support/files.h"
#include "support/plans.h"

namespace covary {
namespace {

using test_support::TemporaryFolder;

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

/// Fewest samples of a film's pixels inside the region, and most outside.
std::pair<uint32_t, uint32_t> counts_in_and_out(const Film& film, const CropWindow& region) {
  uint32_t fewest = UINT32_MAX, most = 0;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) {
      const bool inside = x >= region.x && y >= region.y && x < region.x + region.width && y < region.y + region.height;
      if (inside)
        fewest = std::min(fewest, film.count(x, y));
      else
        most = std::max(most, film.count(x, y));
    }
  return {fewest, most};
}

TEST(Watched, ARegionComesFirstAndTheBitsAreThoseWithoutIt) {
  const LoadedScene scene = load_sized(kRoom);
  const RenderResult plain = render(scene, average_plan(), request_of(96));
  const CropWindow region{10, 5, 12, 8};
  int waves = 0;
  uint32_t fewest = 0, most = UINT32_MAX;
  RenderCallbacks callbacks;
  callbacks.small_waves = true;
  callbacks.region = [&] { return waves >= 3 ? std::optional(region) : std::nullopt; };
  callbacks.wave = [&](std::span<const Pass> passes) {
    if (++waves == 1) {
      EXPECT_EQ(passes[0].film.count(0, 0) + passes[1].film.count(0, 0), 1u) << "a small wave";
    }
    const auto [inside, outside] = counts_in_and_out(passes[0].film, region);
    if (inside == 48) most = std::min(most, outside), fewest = inside;
  };
  const RenderResult watched = render(scene, average_plan(), request_of(96), callbacks);
  EXPECT_EQ(fewest, 48u);
  EXPECT_LE(most, 4u) << "the region is complete when the rest has as good as begun";
  for (int i : {0, 1}) EXPECT_TRUE(same_bits(watched.passes[i].film, plain.passes[i].film));
  EXPECT_EQ(watched.image.estimate.data, plain.image.estimate.data);
}

TEST(Watched, MoreSamplesAreThoseOfAContinuedRender) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(48);
  request.passes = folder.file("films"), request.resume = true;
  render(scene, average_plan(), request);
  request.spp = 96;
  const RenderResult continued = render(scene, average_plan(), request);
  RenderCallbacks callbacks;
  callbacks.goal = [](RenderRequest& asked) { asked.spp = 96; };
  const RenderResult more = render(scene, average_plan(), request_of(48), callbacks);
  EXPECT_TRUE(more.complete);
  for (int i : {0, 1}) EXPECT_TRUE(same_bits(more.passes[i].film, continued.passes[i].film));
  EXPECT_EQ(more.image.estimate.data, continued.image.estimate.data);
}

TEST(Watched, AGoalIsReachedAndEstimatesAreSeen) {
  const LoadedScene scene = load_sized(kRoom);
  std::vector<double> seen;
  RenderCallbacks callbacks;
  callbacks.goal = [](RenderRequest& asked) { asked.until = 0.05, asked.spp = 1 << 20; };
  callbacks.estimated = [&](const EstimatorResult& result, const std::optional<PredictedError>& predicted) {
    EXPECT_EQ(result.std_error.width, 40);
    ASSERT_TRUE(predicted);
    seen.push_back(predicted->relmse);
  };
  const RenderResult result = render(scene, plain_plan(Sampling::kIndependent, 12), request_of(24), callbacks);
  ASSERT_GE(seen.size(), 2u);
  EXPECT_GT(seen.front(), 0.05);
  EXPECT_LE(seen.back(), 0.05);
  EXPECT_EQ(result.until_reached, true);
  EXPECT_GT(result.samples_per_pixel(), 24);
}

TEST(Watched, AStopWaitsForTheWholeImageIfAsked) {
  const LoadedScene scene = load_sized(kRoom);
  std::atomic<bool> stop{false};
  for (const bool whole : {false, true}) {
    std::atomic<bool> whole_image{whole};
    stop = false;
    RenderCallbacks callbacks;
    callbacks.stop = &stop, callbacks.whole_image = &whole_image;
    int waves = 0;
    callbacks.wave = [&](std::span<const Pass>) { stop = ++waves >= 2; };
    const Plan plan = with_image(average_plan(), [](const auto& average, const auto&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(700));
      EstimatorResult result = average();
      parallel_for(1, [](int) {});  // where it would be stopped
      return result;
    });
    const RenderResult result = render(scene, plan, request_of(1024), callbacks);
    EXPECT_TRUE(result.interrupted);
    EXPECT_EQ(result.image.estimate.data.empty(), !whole);
  }
}

}  // namespace
}  // namespace covary
