// SPDX-License-Identifier: Apache-2.0
// Images that are denoised by bands of rows have the bits of those denoised at once.
#include "denoising/rows_denoising.h"

#include <gtest/gtest.h>

#include <limits>

#include "combine/registry.h"
#include "denoising/denoise.h"
#include "denoising/mixed_denoising.h"
#include "estimators/test_images.h"

namespace covary::rows_denoising_test {
namespace {

constexpr int kWidth = 30;

struct Scene {
  int height;
  test::Grouped crn, independent;
  Image albedo, normal, position;
  FeatureDifferences differences;  // none unless set

  Scene(int rows, int groups)
      : height(rows),
        crn(test::crn_image(kWidth, height, groups, 1)),
        independent(test::independent_image(kWidth, height, groups, 1)),
        albedo(kWidth, height, 3),
        normal(kWidth, height, 3),
        position(kWidth, height, 3) {
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) {
          albedo.pixel(x, y)[c] = (x + y / 7) % 9 < 4 ? 0.2f : 0.7f;
          normal.pixel(x, y)[c] = c == (y / 25) % 3;
          position.pixel(x, y)[c] = static_cast<float>(c == 0 ? x : y);
        }
    for (const int y : {0, 100, 200})  // left out
      independent.pixel(9, y)[4] = std::numeric_limits<float>::quiet_NaN();
  }

  MethodSettings settings(bool with_features) const {
    MethodSettings settings;
    settings.std_error = true;
    if (with_features) settings.features = {&albedo, &normal, nullptr, nullptr, &position};
    if (with_features && !differences.values[0].empty()) settings.features.differences = &differences;
    return settings;
  }
  /// Gives each half features of its own.
  void set_halves() {
    for (size_t i = 0; i < albedo.data.size(); ++i)
      differences.values[feature::kAlbedo].push_back(upper_half(static_cast<float>(i % 7) * 0.05f));
  }
};

void expect_equal(const MethodImage& rows, const MethodImage& whole, const std::string& what) {
  EXPECT_EQ(rows.estimate.data, whole.estimate.data) << what;
  EXPECT_EQ(rows.std_error.data, whole.std_error.data) << what;
  EXPECT_EQ(rows.bias.data, whole.bias.data) << what;
  EXPECT_EQ(rows.nonfinite_pixels, whole.nonfinite_pixels) << what;
  EXPECT_EQ(rows.note, whole.note) << what;
  EXPECT_EQ(rows.risk_kind, whole.risk_kind) << what;
  ASSERT_EQ(rows.risk_rows.size(), whole.risk_rows.size()) << what;
  for (size_t y = 0; y < whole.risk_rows.size(); ++y)
    EXPECT_EQ(rows.risk_rows[y].error, whole.risk_rows[y].error) << what << " row " << y;
  ASSERT_EQ(rows.risks.has_value(), whole.risks.has_value()) << what;
  if (!whole.risks) return;
  EXPECT_EQ(rows.risks->held_out, whole.risks->held_out) << what;
  EXPECT_EQ(rows.risks->bias_share, whole.risks->bias_share) << what;
  ASSERT_EQ(rows.risks->images.size(), whole.risks->images.size()) << what;
  for (size_t i = 0; i < whole.risks->images.size(); ++i) {
    EXPECT_EQ(rows.risks->images[i].name, whole.risks->images[i].name) << what;
    EXPECT_EQ(rows.risks->images[i].relmse, whole.risks->images[i].relmse) << what;
  }
}

/// `spare`: rows of a band beside those around it.
void check(const Method& estimator, const Scene& scene, bool with_features, int spare, const std::string& what) {
  const bool is_pair = estimator.pair();
  const GroupedImage crn = is_pair ? scene.crn.view() : GroupedImage(), independent = scene.independent.view();
  const MethodSettings settings = scene.settings(with_features);
  ASSERT_TRUE(estimator.image_in_rows) << what;
  ASSERT_GT(scene.height, 2 * estimator.halo + spare) << what << ": there is more than one band";
  int most = 0;
  const auto rows = [&](int first, int n) {
    most = std::max(most, n);
    return Samples{is_pair ? rows_of(crn, first, n) : GroupedImage(), rows_of(independent, first, n)};
  };
  const int at_once = 2 * estimator.halo + spare;
  expect_equal(estimator.image_in_rows({kWidth, scene.height, at_once, rows}, settings),
               estimator.image({crn, independent}, settings), what);
  EXPECT_LE(most, at_once) << what;
}

Method denoiser(const char* name, DenoiseMode mode, bool with_network = false) {
  MixedDenoisingOptions options;
  options.mode = mode;
  options.use_oidn = with_network;
  return with_denoising(make_estimator(name), options);
}

TEST(RowsDenoising, OfAMeanHaveTheBitsOfTheWhole) {
  const Scene scene(451, 4);
  const Method estimator = denoiser("none", DenoiseMode::kAuto);
  for (const int spare : {48, 60, 90}) {
    check(estimator, scene, false, spare, "without features");
    check(estimator, scene, true, spare, "with features");
  }
}

TEST(RowsDenoising, WithFeaturesOfEachHalfHaveTheBitsOfTheWhole) {
  Scene scene(451, 4);
  const MethodImage before =
      denoiser("none", DenoiseMode::kAuto).image({{}, scene.independent.view()}, scene.settings(true));
  scene.set_halves();
  EXPECT_NE(
      denoiser("none", DenoiseMode::kAuto).image({{}, scene.independent.view()}, scene.settings(true)).std_error.data,
      before.std_error.data);
  check(denoiser("none", DenoiseMode::kAuto), scene, true, 60, "a mean");
  Scene of_pair(601, 6);
  of_pair.set_halves();
  check(denoiser("iicv", DenoiseMode::kAuto), of_pair, true, 60, "a pair");
}

TEST(RowsDenoising, OfAMeanOfUnequalSamplesHaveTheBitsOfTheWhole) {
  Scene scene(421, 4);
  const auto set_counts = [&](uint32_t least) {
    scene.independent.counts.clear();
    for (int i = 0; i < kWidth * scene.height; ++i)
      scene.independent.counts.push_back(least + static_cast<uint32_t>(i / kWidth) / 4);
  };
  set_counts(60);  // 64 and more on average: all filters
  check(denoiser("none", DenoiseMode::kAuto), scene, true, 60, "of many samples");
  set_counts(4);
  check(denoiser("none", DenoiseMode::kBias), scene, true, 60, "of some samples");
  scene.independent.counts[kWidth * 250] = 3;
  check(denoiser("none", DenoiseMode::kAuto), scene, true, 60, "of too few samples in a single pixel");
}

TEST(RowsDenoising, OfAPairHaveTheBitsOfTheWhole) {
  const Scene scene(601, 6);
  for (const DenoiseMode mode : {DenoiseMode::kAuto, DenoiseMode::kBalanced})
    check(denoiser("iicv", mode), scene, true, 60, denoise_mode_names()[static_cast<size_t>(mode)]);
  check(denoiser("iicv", DenoiseMode::kAuto), Scene(601, 4), true, 60, "of too few groups");
}

/// The network sees the whole picture, so that its images have no seams, and bands of the mixture take their rows.
TEST(RowsDenoising, WithTheNetworkHaveTheBitsOfTheWhole) {
  if (find_denoiser().empty()) {  // cli.Denoise does the same with a stand-in that sees the whole picture, too
    EXPECT_NE(missing_network({"auto"}).find("pip install pyoidn"), std::string::npos);
    return;
  }
  const Scene scene(451, 4);
  const Method of_mean = denoiser("none", DenoiseMode::kAuto, true);
  check(of_mean, scene, true, 48, "a mean with features");
  check(of_mean, scene, false, 60, "a mean without features");
  check(denoiser("iicv", DenoiseMode::kAuto, true), Scene(601, 6), true, 60, "a pair");
}

}  // namespace
}  // namespace covary::rows_denoising_test
