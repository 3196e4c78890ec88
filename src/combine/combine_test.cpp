// SPDX-License-Identifier: Apache-2.0
#include "combine/combine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <string>

#include "combine/light_film.h"
#include "combine/registry.h"
#include "combine/result_file.h"
#include "core/error.h"
#include "denoising/mixed_denoising.h"
#include "denoising/network_memory.h"
#include "estimators/mean.h"
#include "estimators/test_images.h"
#include "risk/error_interval.h"
#include "risk/predicted_error.h"
#include "support/files.h"

namespace covary::combine_test {
namespace {

using test_support::contains, test_support::message_of;

constexpr int kWidth = 40, kHeight = 50, kGroups = 12;

ImageOrigin origin(const std::string& name) { return {name, {kWidth, kHeight, {0, 0, kWidth, kHeight}}}; }

struct Images {
  test::Grouped crn = test::crn_image(kWidth, kHeight, kGroups, 1);
  test::Grouped independent = test::independent_image(kWidth, kHeight, kGroups, 1);

  CombineRequest request() const {
    CombineRequest request;
    request.crn = source_of(crn.view(), origin("a.exr"));
    request.independent = source_of(independent.view(), origin("b.exr"));
    request.estimator = make_estimator("iicv");
    request.settings.std_error = true;
    return request;
  }
};

TEST(Combine, PredictsTheErrorOfTheMeanInBands) {
  const Images images;
  const GroupedSource source = images.request().independent;
  const double whole = predicted_relmse(mean_of_groups(images.independent.view()));
  EXPECT_GT(whole, 0);
  for (const int rows : {7, kHeight, 2 * kHeight}) EXPECT_NEAR(predicted_relmse_of_mean(source, rows), whole, 1e-12);
}

TEST(Combine, PlacesImagesInMemoryInTheWholeFrame) {
  const test::Grouped image = test::independent_image(kWidth, kHeight, kGroups, 1);
  const ImagePlace place = source_of(image.view(), {.name = "mine"}).origin.place;
  EXPECT_TRUE(place == (ImagePlace{kWidth, kHeight, {0, 0, kWidth, kHeight}}));
  const ImageOrigin turned{.name = "mine", .place = {kHeight, kWidth, {0, 0, kHeight, kWidth}}};
  EXPECT_EQ(message_of([&] { source_of(image.view(), turned); }, ErrorCode::kUsage),
            "mine: 40 x 50 pixels, but its place has 50 x 40");
}

TEST(Combine, WritesResultsInTheirPlaceAsExr) {
  EstimatorResult result;
  result.estimate = Image(kWidth, kHeight, 3);
  std::map<std::string, Image> none;
  const ImagePlace turned{kHeight, kWidth, {0, 0, kHeight, kWidth}}, place = origin("").place;
  EXPECT_EQ(message_of([&] { write_result("x.exr", turned, {}, result, none); }, ErrorCode::kUsage),
            "'x.exr': the place has 50 x 40 pixels, the image 40 x 50");
  EXPECT_TRUE(contains(message_of([&] { write_result("x.png", place, {}, result, none); }, ErrorCode::kUsage),
                       "results are EXR files"));
}

TEST(Combine, NamesAnEmptyImage) {
  EXPECT_EQ(message_of([] { source_of(GroupedImage{}, {.name = "mine"}); }, ErrorCode::kUsage),
            "mine: the image is empty: 0 x 0 pixels, 0 groups, no data");
}

TEST(Combine, NeedsAnEstimator) {
  EXPECT_TRUE(contains(message_of([] { combine({}); }, ErrorCode::kUsage), "no `estimator`"));
}

TEST(Combine, IsEstimateErrorAndPrediction) {
  const Images images;
  const CombineRequest request = images.request();
  const CombinedImage combined = combine(request);
  const MethodImage image = request.estimator.image({images.crn.view(), images.independent.view()}, request.settings);
  const EstimatorResult expected = with_error(image);
  EXPECT_NE(expected.std_error.data, image.std_error.data);
  EXPECT_EQ(combined.image.estimate.data, expected.estimate.data);
  EXPECT_EQ(combined.image.std_error.data, expected.std_error.data);
  EXPECT_EQ(combined.predicted->relmse, predicted_relmse(expected));
  EXPECT_TRUE(combined.image.interval);
}

TEST(Combine, BandsHaveTheBitsOfTheWhole) {
  Images images;
  images.crn.pixel(7, 30)[5] = std::numeric_limits<float>::quiet_NaN();  // counted once, though bands overlap
  CombineRequest request = images.request();
  request.force = true;
  const CombinedImage whole = combine(request);
  EXPECT_EQ(rows_in_memory(request), kHeight);
  request.memory = memory_of_rows(request, 20) + 1;
  ASSERT_EQ(rows_in_memory(request), 20);
  int n_reads = 0;
  request.crn->rows = [&n_reads, rows = request.crn->rows](int first, int n) { return ++n_reads, rows(first, n); };
  const CombinedImage bands = combine(request);
  EXPECT_GT(n_reads, 4);
  EXPECT_EQ(bands.image.estimate.data, whole.image.estimate.data);
  EXPECT_EQ(bands.image.std_error.data, whole.image.std_error.data);
  EXPECT_EQ(whole.image.nonfinite_pixels, 1);
  EXPECT_EQ(bands.image.nonfinite_pixels, 1);
}

TEST(Combine, PlansWhatTheNetworkTakesBeforeThereAreBands) {
  const Images images;
  CombineRequest request = images.request();
  request.crn.reset();
  MixedDenoisingOptions options;
  options.use_oidn = false;
  request.estimator = with_denoising(make_estimator("none"), options);
  request.independent.width = 400, request.independent.height = 1000;
  limit_memory(request, 150);
  const double without = planned_memory(request);
  EXPECT_LT(without, 200e6);
  request.estimator.network = "Open Image Denoise";
  EXPECT_GT(planned_memory(request), network_library_memory() + network_tile_memory(400.0 * 1000));
  EXPECT_TRUE(contains(message_of([&] { combine(request); }, ErrorCode::kUsage), "need at least 297.6 MB"));
  EXPECT_TRUE(contains(message_of([&] { combine(request); }, ErrorCode::kUsage), "157.3 MB are allowed"));
  request.max_memory = request.memory = 320e6;  // with room for the library
  EXPECT_LE(planned_memory(request), 320e6);
}

TEST(Combine, LightIsAddedAfterCalibration) {
  const Images images;
  CombineRequest request = images.request();
  request.estimator = make_estimator("iicv");
  const CombinedImage without = combine(request);
  const test::Grouped light = test::constant_image(kWidth, kHeight, 2, 0.25f);
  ImageOrigin of_light = origin("light.exr");
  of_light.is_light_film = true;
  request.light = source_of(light.view(), of_light);
  const CombinedImage with = combine(request);
  for (size_t i = 0; i < without.image.estimate.data.size(); ++i)
    ASSERT_EQ(with.image.estimate.data[i], without.image.estimate.data[i] + 0.25f);
  EXPECT_EQ(with.image.std_error.data, without.image.std_error.data);
  request.light->origin.is_light_film = false;
  EXPECT_TRUE(contains(message_of([&] { combine(request); }, ErrorCode::kInput), "light.exr"));
}

TEST(Combine, AnIndependentImageAloneIsDenoised) {
  const Images images;
  CombineRequest request = images.request();
  request.crn.reset();
  MixedDenoisingOptions options;
  options.mode = DenoiseMode::kError;
  options.use_oidn = false;
  request.estimator = with_denoising(make_estimator("none"), options);
  const CombinedImage combined = combine(request);
  const MethodImage image = request.estimator.image({{}, images.independent.view()}, request.settings);
  EXPECT_FALSE(image.interval);
  const EstimatorResult expected = finish(image);
  EXPECT_EQ(combined.image.estimate.data, expected.estimate.data);
  EXPECT_EQ(combined.predicted->relmse, predicted_relmse(expected));
  EXPECT_TRUE(combined.image.interval) << "the error of a mean that was denoised has bounds";
  EXPECT_GT(combined.inputs.report.independent_mean, 0);
  // Groups that are copies of one render are detected.
  test::Grouped twice = images.independent;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) std::copy_n(twice.pixel(x, y), 3, twice.pixel(x, y) + 3);
  request.independent = source_of(twice.view(), origin("b.exr"));
  EXPECT_TRUE(
      contains(message_of([&] { combine(request); }, ErrorCode::kInput), "render 1 and render 2 are identical"));
}

TEST(Combine, ErrorsOfTheInputsAreThrownUnlessForced) {
  Images images;
  images.independent = images.crn;  // the same samples twice
  CombineRequest request = images.request();
  size_t n_findings = 0;
  request.checked = [&](const InputFindings& inputs) { n_findings = inputs.findings.size(); };
  EXPECT_TRUE(contains(message_of([&] { combine(request); }, ErrorCode::kInput), "the inputs do not fit: "));
  EXPECT_GT(n_findings, 0u);
  request.force = true;
  EXPECT_EQ(combine(request).inputs.findings.size(), n_findings);
}

}  // namespace
}  // namespace covary::combine_test
