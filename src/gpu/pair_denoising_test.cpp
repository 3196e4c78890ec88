// SPDX-License-Identifier: Apache-2.0
// Denoising of a pair's image on a device, against the processor's.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"
#include "estimators/test_images.h"
#include "gpu/comparison.h"
#include "gpu/mixed_denoising.h"
#include "gpu/target.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;

constexpr int kWidth = 49, kHeight = 37;

struct Pair {
  test::Grouped crn = test::crn_image(kWidth, kHeight, 8, 1),
                independent = test::independent_image(kWidth, kHeight, 8, 2);
  Image albedo = Image(kWidth, kHeight, 3), normal = albedo;
  MethodSettings settings;

  Pair() {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) {
          albedo.pixel(x, y)[c] = x / 8 % 2 ? 0.7f : 0.2f;
          normal.pixel(x, y)[c] = y > 20 ? 0.5f : -0.2f;
        }
    independent.pixel(3, 4)[1] = std::numeric_limits<float>::infinity();
    settings.std_error = true;
    settings.crn_samples = 64;
  }
  Samples samples() const { return {crn.view(), independent.view()}; }
};

Method denoised_pair(DenoiseMode mode, bool on_device) {
  MixedDenoisingOptions options;
  options.mode = mode;
  options.use_oidn = false;
  if (on_device)
    options.mix_pair = [](const PairMixture& request, const auto&) { return mix_pair(test_device(), request); };
  return with_denoising(make_estimator(kIicv), options);
}

void expect_same(Pair& in, DenoiseMode mode) {
  for (const bool has_features : {true, false}) {
    SCOPED_TRACE(has_features);
    in.settings.features = has_features ? Features{&in.albedo, &in.normal} : Features{};
    const auto expected = denoised_pair(mode, false).image(in.samples(), in.settings),
               found = denoised_pair(mode, true).image(in.samples(), in.settings);
    EXPECT_TRUE(agree(expected.estimate.data, found.estimate.data));
    EXPECT_TRUE(agree(expected.std_error.data, found.std_error.data));
    EXPECT_TRUE(agree(expected.bias.data, found.bias.data));
    EXPECT_EQ(found.nonfinite_pixels, 1);
    EXPECT_EQ(found.risk_kind, expected.risk_kind);
    EXPECT_EQ(found.note, "");
    ASSERT_TRUE(found.risks && expected.risks);
    ASSERT_EQ(found.risks->images.size(), expected.risks->images.size());
    for (size_t i = 0; i < found.risks->images.size(); ++i) {
      EXPECT_EQ(found.risks->images[i].name, expected.risks->images[i].name);
      EXPECT_NEAR(found.risks->images[i].relmse, expected.risks->images[i].relmse,
                  1e-3 * expected.risks->images[i].relmse);
    }
  }
}

TEST(GpuPairDenoising, IsThatOfTheProcessor) {
  Pair in;
  expect_same(in, DenoiseMode::kAuto);
}

/// With residual correction, whose weights follow the pixels' numbers of samples.
TEST(GpuPairDenoising, LowersBiasAsTheProcessorDoes) {
  Pair in;
  expect_same(in, DenoiseMode::kBias);
  for (int i = 0; i < kWidth * kHeight; ++i) in.independent.counts.push_back(8 + static_cast<uint32_t>(i % 5 * 8));
  expect_same(in, DenoiseMode::kBalanced);
}

TEST(GpuPairDenoising, NoticesAWrongCorrection) {
  Pair in;
  DenoisingParts parts = parts_of_pair(make_estimator(kIicv), in.crn.view(), in.independent.view(), in.settings);
  const PairMixture request{&parts, {4, 0, true}, {}, false, false};
  const MixedDenoising right = mix_pair(test_device(), request),
                       wrong = mix_pair(test_device(), request, {"residual_correction.cl", 0, {}});
  EXPECT_FALSE(agree(right.result.estimate.data, wrong.result.estimate.data));
}

TEST(GpuPairDenoising, TakesTheImagesOfANetwork) {
  Pair in;
  DenoisingParts parts = parts_of_pair(make_estimator(kIicv), in.crn.view(), in.independent.view(), in.settings);
  parts.features = {&in.albedo, &in.normal};
  const auto made = std::make_shared<NetworkImages>();
  made->images = {mean_image(parts.whole.independent), mean_image(parts.halves[0].independent),
                  mean_image(parts.halves[1].independent)};
  made->runs = 3;
  for (Image& image : made->images)
    for (float& value : image.data) value = 0.5f * value + 0.4f;  // less noise, and bias
  const PairMixture request{&parts, {1, 1, false}, [&] { return *made; }, true, true};
  const MixedDenoising found = mix_pair(test_device(), request);
  const std::vector<CandidateMaker> makers = {filtered_candidates(parts.features),
                                              neural_candidates({}, {}, CandidateBase::kPair, made)};
  const MixedDenoising expected = denoise_by_mixture(parts, makers, DenoiseMode::kAuto, true);
  ASSERT_EQ(found.names, expected.names);
  EXPECT_EQ(found.result.network_runs, 3);
  EXPECT_EQ(found.result.risk_kind, ErrorKind::kPairNetwork);
  for (size_t i = 0; i < expected.candidates.size(); ++i) {
    EXPECT_TRUE(agree(expected.candidates[i].data, found.candidates[i].data)) << expected.names[i];
    EXPECT_TRUE(agree(expected.weights[i].data, found.weights[i].data)) << expected.names[i];
  }
  EXPECT_TRUE(agree(expected.result.estimate.data, found.result.estimate.data));
}

/// Of the command line's method.
TEST(GpuPairDenoising, IsPartOfTheDefault) {
  const Pair in;
  const auto target = std::make_shared<Target>(device::Device::open("opencl"), false);
  const auto picture = [&](const char* mode) {
    return make_default_estimator(true, {}, {mode, "off", {}}, target).image(in.samples(), in.settings);
  };
  EXPECT_EQ(picture(DenoisingChoice::kAuto).note, "");
  EXPECT_EQ(target->made_by(), target->info().text());
  EXPECT_EQ(picture("bias").note, "");
}

}  // namespace
}  // namespace covary::gpu
