// SPDX-License-Identifier: Apache-2.0
// Where renders to a target error end.
#include <gtest/gtest.h>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"
#include "plans/estimator_plans.h"
#include "plans/render.h"
#include "support/files.h"
#include "support/plans.h"

namespace covary {
namespace {

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

Plan denoised_plan() {
  return estimator_plan(
      with_denoising(make_estimator("none"), {.mode = DenoiseMode::kAuto, .use_oidn = false, .oidn = {}}));
}

TEST(Until, EndsAfterFewSamplesIfTheIntervalIsBelowTheGoal) {
  const LoadedScene scene = load_sized(kRoom, 80, 60);
  const RenderResult few = render(scene, denoised_plan(), request_of(24));
  ASSERT_TRUE(few.predicted && few.predicted->bounds);
  RenderRequest request = request_of(1000);
  request.until = 1.01 * few.predicted->bounds->high;
  const RenderResult sure = render(scene, denoised_plan(), request);
  EXPECT_EQ(sure.samples_per_pixel(), 24);
  EXPECT_EQ(sure.until_reached, true);
  EXPECT_EQ(sure.image.estimate.data, few.image.estimate.data);
  request.until = 1.01 * few.predicted->relmse;
  const RenderResult unsure = render(scene, denoised_plan(), request);
  EXPECT_GT(unsure.samples_per_pixel(), 24) << "the prediction may be below the goal by chance";
  EXPECT_EQ(unsure.until_reached, true);
  request.spp = 24;
  EXPECT_EQ(render(scene, denoised_plan(), request).until_reached, true) << "there are no more samples to be sure";
}

TEST(Until, GoesOnIfFewSamplesGiveNoInterval) {
  const LoadedScene scene = load_sized(kRoom, 16, 12);
  ASSERT_FALSE(render(scene, denoised_plan(), request_of(24)).predicted->bounds);
  RenderRequest request = request_of(1000);
  request.until = 1e9;
  EXPECT_GT(render(scene, denoised_plan(), request).samples_per_pixel(), 24);
}

}  // namespace
}  // namespace covary
