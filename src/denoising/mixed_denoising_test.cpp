// SPDX-License-Identifier: Apache-2.0
// --denoise as a whole, on synthetic images; planted candidates; unusual pictures.
#include "denoising/mixed_denoising.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "combine/registry.h"
#include "core/error.h"
#include "estimators/mean.h"
#include "estimators/test_images.h"
#include "filters/residual_correction.h"
#include "risk/image_risk.h"
#include "risk/relative_weight.h"
#include "support/files.h"

namespace covary::mixed_denoising_test {
namespace {

using test_support::message_of;

constexpr int kWidth = 72, kHeight = 56;

struct Inputs {
  test::Grouped crn, independent;
  explicit Inputs(uint64_t seed, int width = kWidth, int height = kHeight, int groups = 12, float outliers = 0.01f)
      : crn(test::noisy_image(width, height, groups, seed, 0.2f, outliers)),
        independent(test::noisy_image(width, height, groups, seed + 1000, 1.0f, outliers)) {}
  /// Multiplies all values of both images.
  void scale(float factor) {
    for (test::Grouped* image : {&crn, &independent})
      for (float& value : image->data) value *= factor;
  }
};

Method denoiser(DenoiseMode mode) {
  MixedDenoisingOptions options;
  options.mode = mode;
  options.use_oidn = false;
  return with_denoising(make_estimator("iicv"), options);
}

MethodImage denoised(const Inputs& in, DenoiseMode mode, const Features& features = {}) {
  MethodSettings settings;
  settings.std_error = true;
  settings.features = features;
  return denoiser(mode).image({in.crn.view(), in.independent.view()}, settings);
}

Image iicv_of(const Inputs& in) {
  return make_estimator("iicv").image({in.crn.view(), in.independent.view()}, {}).estimate;
}

/// Mean of the samples relative to test::expected(): outliers add 5 times that to 1 % of them.
constexpr float kOutliers = 1.05f;

Image truth(float scale = 1) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] = scale * static_cast<float>(test::expected(x, y, c)) * kOutliers;
  return image;
}

double square_error(const Image& image, float scale = 1) {
  const Image exact = truth(scale);
  double sum = 0;
  for (size_t i = 0; i < exact.data.size(); ++i) sum += std::pow((image.data[i] - exact.data[i]) / scale, 2);
  return sum / static_cast<double>(exact.data.size());
}

TEST(MixedDenoising, HasLessErrorThanItsEstimator) {
  const Inputs in(1);
  const double before = square_error(iicv_of(in));
  EXPECT_LT(square_error(denoised(in, DenoiseMode::kBias).estimate), before);
  EXPECT_LT(square_error(denoised(in, DenoiseMode::kBalanced).estimate), 0.9 * before);
  EXPECT_LT(square_error(denoised(in, DenoiseMode::kError).estimate), 0.8 * before);
}

TEST(MixedDenoising, IsTheEstimatorWithoutAMode) {
  const Inputs in(1);
  const Method none = with_denoising(make_estimator("iicv"), {DenoiseMode::kNone});
  EXPECT_EQ(none.image({in.crn.view(), in.independent.view()}, {}).estimate.data, iicv_of(in).data);
  EXPECT_EQ(none.text, make_estimator("iicv").text);
}

Method mean_denoiser(DenoiseMode mode) {
  MixedDenoisingOptions options;
  options.mode = mode;
  options.use_oidn = false;
  return with_denoising(make_estimator("none"), options);
}

MethodImage denoised_mean(const test::Grouped& image, DenoiseMode mode, const Features& features = {}) {
  MethodSettings settings;
  settings.std_error = true;
  settings.features = features;
  return mean_denoiser(mode).image({{}, image.view()}, settings);
}

double mean_square(const Image& image) {
  double sum = 0;
  for (float value : image.data) sum += static_cast<double>(value) * value;
  return sum / static_cast<double>(image.data.size());
}

// Both halves chose the weights, so their images depend on each other's samples and the predicted error is too small
// where noise is strong; the fit of error_interval.h accounts for that.
TEST(MixedDenoising, OfASinglePassTellsItsErrorByItsSamples) {
  const MethodImage result = denoised_mean(Inputs(1).independent, DenoiseMode::kAuto);
  EXPECT_EQ(result.risk_kind, ErrorKind::kFilters);
  const RiskRow sums = sum_of(result.risk_rows);
  EXPECT_EQ(sums.values, 3.0 * kWidth * kHeight);
  EXPECT_EQ(sums.groups, 12);
  EXPECT_LT(sums.variance, 0.2 * sums.noise) << "it has less noise than the mean";
  EXPECT_LT(std::abs(sums.error), 0.5 * sums.noise);
  const MethodImage of_pair = denoised(Inputs(1), DenoiseMode::kError);
  EXPECT_EQ(of_pair.risk_kind, ErrorKind::kPairFilters);
  EXPECT_EQ(of_pair.risk_rows.size(), static_cast<size_t>(kHeight));
}

TEST(MixedDenoising, TellsHowMuchNoiseIsBehindGlass) {
  Image pane(kWidth, kHeight, 3), behind(kWidth, kHeight, 3);
  std::fill(pane.data.begin(), pane.data.end(), 1.0f);
  std::fill(behind.data.begin(), behind.data.end(), 0.5f);
  const Inputs in(1);
  for (const MethodImage& result : {denoised_mean(in.independent, DenoiseMode::kAuto, {&pane, nullptr, &behind}),
                                    denoised(in, DenoiseMode::kError, {&pane, nullptr, &behind})}) {
    const RiskRow sums = sum_of(result.risk_rows);
    EXPECT_EQ(sums.specular_noise, sums.noise);
  }
  EXPECT_EQ(sum_of(denoised_mean(in.independent, DenoiseMode::kAuto).risk_rows).specular_noise, 0);
}

TEST(MixedDenoising, OfASinglePassWeighsTheCandidatesOfAllFilters) {
  const Inputs in(1);
  Image albedo(kWidth, kHeight, 3);
  std::fill(albedo.data.begin(), albedo.data.end(), 0.5f);
  MethodSettings settings;
  settings.features.albedo = &albedo;
  const std::map<std::string, Image> stages =
      mean_denoiser(DenoiseMode::kAuto).stages({{}, in.independent.view()}, settings);
  for (const char* name : {"regression", "sharp", "smooth", "demodulated", "weighed"})
    EXPECT_TRUE(stages.contains(std::string("candidate-") + name)) << name;
  double weight = 0;
  for (const float w : stages.at("weight-weighed").data) weight += w;
  EXPECT_GT(weight, 0.01 * kWidth * kHeight);
}

TEST(MixedDenoising, OfASinglePassHasLessErrorThanItsMean) {
  const Inputs in(1);
  const Method estimator = mean_denoiser(DenoiseMode::kError);
  EXPECT_TRUE(estimator.one_pass());
  EXPECT_FALSE(estimator.is_mean());
  EXPECT_EQ(estimator.text, "mixture --denoise error --oidn off");
  const double before = square_error(mean_of_groups(in.independent.view()).estimate);
  EXPECT_LT(square_error(denoised_mean(in.independent, DenoiseMode::kBias).estimate), 0.75 * before);
  EXPECT_LT(square_error(denoised_mean(in.independent, DenoiseMode::kBalanced).estimate), 0.35 * before);
  const EstimatorResult result = denoised_mean(in.independent, DenoiseMode::kError);
  EXPECT_LT(square_error(result.estimate), 0.3 * before);
  EXPECT_NEAR(mean_square(result.std_error) / square_error(result.estimate), 1, 0.5);
  EXPECT_EQ(result.note, "");
}

TEST(MixedDenoising, TellsItsBiasAndTheErrorsOfItsParts) {
  const Inputs in(1);
  const test::Grouped& image = in.independent;
  MethodSettings settings;
  settings.std_error = true;
  const Method estimator = mean_denoiser(DenoiseMode::kAuto);
  const EstimatorResult result = estimator.image({{}, image.view()}, settings);
  ASSERT_TRUE(result.risks);
  ASSERT_GE(result.risks->images.size(), 3u);
  EXPECT_EQ(result.risks->images[0].name, "mean");
  EXPECT_EQ(result.risks->images[1].name, "sharp");
  EXPECT_GE(result.risks->bias_share, 0);
  EXPECT_LT(result.risks->bias_share, 1);
  std::map<std::string, Image> stages = estimator.stages({{}, image.view()}, settings);
  stages["candidate-mean"] = mean_of_groups(image.view()).estimate;
  const Image exact = truth();
  for (const auto& [name, relmse] : result.risks->images) {
    const Image& part = stages.at("candidate-" + name);
    double error = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c)
          error += std::pow(part.pixel(x, y)[c] - exact.pixel(x, y)[c], 2) * relative_weight(exact.pixel(x, y));
    // With so few pixels, halves say little about the bias of the whole image.
    const double ratio = relmse / (error / (3 * kWidth * kHeight)), most = name == "mean" ? 1.2 : 3;
    EXPECT_LT(std::max(ratio, 1 / ratio), most) << name;
  }
  EXPECT_EQ(denoised(in, DenoiseMode::kAuto).risks->images[0].name, "iicv");
  settings.std_error = false;
  EXPECT_FALSE(estimator.image({{}, image.view()}, settings).risks);
}

TEST(MixedDenoising, OfASinglePassTakesTwoGroupsOfManySamples) {
  const Inputs in(2, kWidth, kHeight, 2);
  const EstimatorResult result = denoised_mean(in.independent, DenoiseMode::kError);
  EXPECT_LT(square_error(result.estimate), 0.6 * square_error(mean_of_groups(in.independent.view()).estimate));
  for (float error : result.std_error.data) ASSERT_TRUE(std::isfinite(error));
  EXPECT_GT(mean_square(result.std_error), 0.5 * square_error(result.estimate));
  EXPECT_LT(mean_square(result.std_error), 10 * square_error(result.estimate));
}

TEST(MixedDenoising, OfASinglePassSaysWhenSamplesAreTooFewToJudge) {
  for (const uint32_t samples : {1u, 3u, 4u}) {
    const Inputs in(3, kWidth, kHeight, static_cast<int>(samples));
    const std::vector<uint32_t> counts(static_cast<size_t>(kWidth) * kHeight, samples);
    GroupedImage image = in.independent.view();
    image.counts = counts.data();
    MethodSettings settings;
    settings.std_error = true;
    const EstimatorResult result = mean_denoiser(DenoiseMode::kError).image({{}, image}, settings);
    const bool is_few = samples < 4;
    EXPECT_EQ(result.note.find("fewer than 4 samples per pixel") != std::string::npos, is_few) << samples;
    EXPECT_EQ(result.std_error.data.empty(), is_few) << samples;
    const double before = square_error(mean_of_groups(in.independent.view()).estimate);
    EXPECT_LT(square_error(result.estimate), samples == 1 ? 1.001 * before : 0.8 * before) << samples;
  }
}

TEST(MixedDenoising, OfOneRenderSaysThatAnotherOneTellsItsNoise) {
  const Inputs in(3, kWidth, kHeight, 1);
  const EstimatorResult result = mean_denoiser(DenoiseMode::kError).image({{}, in.independent.view()}, {});
  EXPECT_NE(result.note.find("one render alone does not tell its noise"), std::string::npos) << result.note;
}

/// All of them would be read beyond their ends, or where the image has something else.
TEST(MixedDenoising, RefusesFeaturesOfAnotherSizeThanTheImage) {
  const Inputs in(3);
  const Image right(kWidth, kHeight, 3), half(kWidth / 2, kHeight / 2, 3), large(2 * kWidth, kHeight, 3);
  const Image turned(kHeight, kWidth, 3), grey(kWidth, kHeight, 1);
  Image cut(kWidth, kHeight, 3);
  cut.data.resize(cut.data.size() / 2);
  const auto message = [&](const Image* albedo, const Image* normal) {
    MethodSettings settings;
    settings.features.albedo = albedo, settings.features.normal = normal;
    return test_support::message_of(
        [&] {
          mean_denoiser(DenoiseMode::kError).image({{}, in.independent.view()}, settings);
        },
        ErrorCode::kInput);
  };
  for (const Image* wrong : std::initializer_list<const Image*>{&half, &large, &turned, &grey, &cut}) {
    EXPECT_EQ(message(wrong, &right).find("the albedo has "), 0u);
    EXPECT_EQ(message(&right, wrong).find("the normal has "), 0u);
  }
  EXPECT_EQ(message(&half, &half),
            fmt::format("the albedo has {} x {} pixels of 3 channels and {} values, the image "
                        "{} x {} pixels; expected the same size, 3 channels and {} values",
                        kWidth / 2, kHeight / 2, half.data.size(), kWidth, kHeight, right.data.size()));
  EXPECT_EQ(message(nullptr, &right), "a normal without an albedo is not used; give both");
}

TEST(MixedDenoising, OfASinglePassDoesNotDependOnThreads) {
  const Inputs in(3);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const EstimatorResult alone = denoised_mean(in.independent, DenoiseMode::kError);
  const tbb::global_control four(tbb::global_control::max_allowed_parallelism, 4);
  const EstimatorResult together = denoised_mean(in.independent, DenoiseMode::kError);
  EXPECT_EQ(together.estimate.data, alone.estimate.data);
  EXPECT_EQ(together.std_error.data, alone.std_error.data);
}

/// For a denoiser that makes everything too dark but keeps the edges.
TEST(MixedDenoising, ResidualGivesBackWhatPixelsAlikeLack) {
  const Inputs in(10, kWidth, kHeight, 12, 0);
  const std::vector<unsigned char> valid(static_cast<size_t>(kWidth) * kHeight, 1);
  const Moments h = moments(in.independent.view(), valid, 0, 0.0f);
  const Image dark = truth(0.8f / kOutliers);
  Image corrected = dark;
  add_residual(h, {}, valid, corrected);
  const float scale = 1 / kOutliers;
  EXPECT_LT(square_error(corrected, scale), 0.2 * square_error(dark, scale));
}

TEST(MixedDenoising, UsesFeatures) {
  const Inputs in(2);
  Image albedo(kWidth, kHeight, 3), normal(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) {
        albedo.pixel(x, y)[c] = x + y > 45 ? 0.2f : 0.7f;
        normal.pixel(x, y)[c] = c == 2;
      }
  const EstimatorResult guided = denoised(in, DenoiseMode::kError, {&albedo, &normal});
  EXPECT_NE(guided.estimate.data, denoised(in, DenoiseMode::kError).estimate.data);
  EXPECT_LT(square_error(guided.estimate), 0.8 * square_error(iicv_of(in)));
}

TEST(MixedDenoising, GivesTheNetworkFeaturesBehindGlass) {
  const Image images[4];
  const Features first{&images[0], &images[1], nullptr, nullptr}, all{&images[0], &images[1], &images[2], &images[3]};
  EXPECT_EQ(network_features(first).albedo, &images[0]);
  EXPECT_EQ(network_features(first).normal, &images[1]);
  EXPECT_EQ(network_features(all).albedo, &images[2]);
  EXPECT_EQ(network_features(all).normal, &images[3]);
  const Features half{&images[0], &images[1], &images[2], nullptr};
  EXPECT_EQ(network_features(half).albedo, &images[0]) << "both of the same surface";
}

/// Frames of a static scene and a denoiser that changes nothing: the error falls with the number of frames.
TEST(MixedDenoising, OfFramesUsesSamplesOfFramesBefore) {
  CandidateMaker same;
  same.names = {"same"};
  same.network = true;
  same.make = one_by_one([](const CandidateInput& in) { return std::vector<Image>{*in.estimate}; });
  MixingHistory history{nullptr, true};
  std::vector<double> errors;
  for (const uint64_t seed : {51, 52, 53, 54}) {
    const test::Grouped frame = test::noisy_image(kWidth, kHeight, 4, seed, 1.0f, 0);
    const EstimatorResult result =
        denoise_by_mixture(parts_of_mean(frame.view()), {same}, DenoiseMode::kAuto, false, {}, history).result;
    ASSERT_EQ(result.kept_samples.size(), kKeptSamples.size());
    errors.push_back(square_error(result.estimate, 1 / kOutliers));
    history.before = std::make_shared<History>(History{result.estimate,
                                                       Image(kWidth, kHeight, 1),
                                                       std::vector<unsigned char>(size_t{kWidth} * kHeight, 1),
                                                       {result.kept_samples[0], result.kept_samples[1]},
                                                       Image(),
                                                       Image()});
  }
  EXPECT_LT(errors[1], 0.7 * errors[0]);
  EXPECT_LT(errors[3], 0.45 * errors[0]);
  same.network = false;
  const test::Grouped frame = test::noisy_image(kWidth, kHeight, 4, 55, 1.0f, 0);
  EXPECT_TRUE(denoise_by_mixture(parts_of_mean(frame.view()), {same}, DenoiseMode::kAuto, false, {}, history)
                  .result.kept_samples[0]
                  .data.empty());
}

TEST(MixedDenoising, OfASinglePassKeepsFirefliesFromCandidates) {
  test::Grouped image = test::noisy_image(kWidth, kHeight, 12, 5, 1.0f, 0);
  float* group = &image.data[((20 * kWidth + 30) * 12 + 4) * 3];
  for (int c = 0; c < 3; ++c) group[c] += 1200;
  std::vector<Image> seen, independent;
  CandidateMaker maker;
  maker.names = {"seen"};
  maker.make = one_by_one([&](const CandidateInput& in) {
    seen.push_back(*in.estimate);
    independent.push_back(*in.independent);
    return std::vector<Image>{*in.estimate};
  });
  denoise_by_mixture(parts_of_mean(image.view()), {maker}, DenoiseMode::kError, false);
  ASSERT_EQ(seen.size(), 3u);
  EXPECT_GT(independent[0].pixel(30, 20)[0], 100);
  EXPECT_GT(independent[1].pixel(30, 20)[0], 200) << "the half with the groups 0, 2, …";
  for (const Image& part : seen)
    for (float value : part.data) ASSERT_LT(value, 10);
}

TEST(MixedDenoising, DoesNotDependOnThreads) {
  const Inputs in(3);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const EstimatorResult alone = denoised(in, DenoiseMode::kBalanced);
  const tbb::global_control four(tbb::global_control::max_allowed_parallelism, 4);
  const EstimatorResult together = denoised(in, DenoiseMode::kBalanced);
  EXPECT_EQ(together.estimate.data, alone.estimate.data);
  EXPECT_EQ(together.std_error.data, alone.std_error.data);
}

/// Candidates that a broken denoiser might give, beside good ones.
TEST(MixedDenoising, GivesBadCandidatesNoWeightAndAPerfectOneMost) {
  const Inputs in(4, kWidth, kHeight, 12, 0);
  CandidateMaker planted;
  planted.names = {"blurred", "constant", "shifted", "perfect"};
  planted.make = one_by_one([](const CandidateInput& input) {
    const Image& f = *input.estimate;
    std::vector<Image> images(3, Image(f.width, f.height, 3));
    for (int y = 0; y < f.height; ++y)
      for (int x = 0; x < f.width; ++x)
        for (int c = 0; c < 3; ++c) {
          float sum = 0;
          for (int dx = -20; dx <= 20; ++dx) sum += f.pixel(std::clamp(x + dx, 0, f.width - 1), y)[c];
          images[0].pixel(x, y)[c] = sum / 41;
          images[1].pixel(x, y)[c] = 0.5f;
          images[2].pixel(x, y)[c] = f.pixel((x + 30) % f.width, y)[c];
        }
    images.push_back(truth(1 / kOutliers));
    return images;
  });
  const MixedDenoising all =
      denoise_by_mixture(parts_of_pair(make_estimator("iicv"), in.crn.view(), in.independent.view(), {}),
                         {filtered_candidates({}), planted}, DenoiseMode::kError, false);
  ASSERT_EQ(all.names, (std::vector<std::string>{"sharp", "sharp-independent", "smooth", "blurred", "constant",
                                                 "shifted", "perfect"}));
  std::vector<double> weights;
  for (const Image& image : all.weights) {
    double sum = 0;
    for (float w : image.data) sum += w;
    weights.push_back(sum / static_cast<double>(image.data.size()));
  }
  for (int bad : {3, 4, 5}) EXPECT_LT(weights[bad], 0.05) << all.names[bad];
  EXPECT_GT(weights[6], 0.65);
}

TEST(MixedDenoising, KeepsBlackBordersBlack) {
  Inputs in(5);
  for (test::Grouped* image : {&in.crn, &in.independent})
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        if (x < 9 || y >= kHeight - 6) std::fill_n(image->pixel(x, y), image->groups * 3, 0.0f);
  const EstimatorResult result = denoised(in, DenoiseMode::kBalanced);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) {
        ASSERT_TRUE(std::isfinite(result.estimate.pixel(x, y)[c]));
        const bool is_border = x < 9 || y >= kHeight - 6;
        ASSERT_TRUE(!is_border || result.estimate.pixel(x, y)[c] == 0) << x << " " << y;
      }
}

TEST(MixedDenoising, TakesAnyRange) {
  for (const float scale : {1e-2f, 1e5f}) {
    Inputs in(6);
    in.scale(scale);
    const EstimatorResult result = denoised(in, DenoiseMode::kError);
    EXPECT_LT(square_error(result.estimate, scale), 0.85 * square_error(iicv_of(in), scale)) << scale;
    for (float value : result.std_error.data) ASSERT_TRUE(std::isfinite(value) && value >= 0);
  }
}

TEST(MixedDenoising, SurvivesFirefliesAndValuesThatAreNotFinite) {
  Inputs in(7);
  for (int c = 0; c < 3; ++c) in.independent.pixel(20, 20)[c] = 1e7f;
  in.crn.pixel(40, 30)[4] = std::numeric_limits<float>::quiet_NaN();
  const EstimatorResult result = denoised(in, DenoiseMode::kError);
  EXPECT_EQ(result.nonfinite_pixels, 1);
  for (float value : result.estimate.data) ASSERT_TRUE(std::isfinite(value));
  for (float value : result.std_error.data) ASSERT_TRUE(std::isfinite(value));
}

TEST(MixedDenoising, TakesTinyImages) {
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 3}, {17, 1}, {1, 40}}) {
    const Inputs in(8, width, height, 6);
    const EstimatorResult result = denoised(in, DenoiseMode::kBalanced);
    ASSERT_EQ(result.estimate.data.size(), static_cast<size_t>(width) * height * 3);
    for (float value : result.estimate.data) ASSERT_TRUE(std::isfinite(value));
  }
}

TEST(MixedDenoising, SaysWhatItCannotDo) {
  EXPECT_EQ(message_of([] { denoise_mode("much"); }), "`denoise` 'much': expected none, auto, bias, balanced, error");
  EXPECT_NE(message_of([] {
              with_denoising(make_estimator("iduw"), {DenoiseMode::kError});
            }).find("denoising needs an estimator that predicts its error, not iduw"),
            std::string::npos);
  MixedDenoisingOptions elsewhere;
  elsewhere.oidn.library = "/nowhere/libOpenImageDenoise.so.2";
  const Inputs in(9);
  EXPECT_NE(message_of([&] {
              with_denoising(make_estimator("iicv"), elsewhere).image({in.crn.view(), in.independent.view()}, {});
            }).find("Open Image Denoise was not found (/nowhere/"),
            std::string::npos);
  EXPECT_EQ(denoiser(DenoiseMode::kError).min_groups, 6);
}

}  // namespace
}  // namespace covary::mixed_denoising_test
