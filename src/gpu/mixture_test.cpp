// SPDX-License-Identifier: Apache-2.0
// Weights, mixtures and what held-out samples tell of them on a device, against denoising/ and risk/: both get the
// processor's candidates.
#include "gpu/mixture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "denoising/mixed_rows.h"
#include "denoising/parts_mixture.h"
#include "estimators/test_images.h"
#include "gpu/comparison.h"
#include "gpu/held_out.h"
#include "risk/held_out_bias.h"
#include "risk/image_risk.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;
using test_support::values_of;

constexpr int kWidth = 61, kHeight = 43;

Buffer<float> up(const std::vector<float>& values) { return test_device().upload(std::span(values)); }

std::vector<float> down(const Buffer<float>& values) { return test_device().download(values); }

/// A part and its candidates on the device.
struct PartOnDevice {
  MeanBuffers independent;
  Buffer<float> std_error, base, candidates;

  PartOnDevice() = default;
  PartOnDevice(const DenoisingPart& part, const CandidateSet& set)
      : independent{up(values_of(part.independent.mean)), up(values_of(part.independent.variance_of_mean))},
        std_error(up(part.image.std_error.data)),
        base(up(set.base.data)) {
    std::vector<float> all;
    for (const Image& candidate : set.candidates) all.insert(all.end(), candidate.data.begin(), candidate.data.end());
    candidates = up(all);
  }
};

/// A mean of 10 groups with filtered candidates, as the processor mixes it; and its input on the device.
struct Example {
  test::Grouped groups = test::noisy_image(kWidth, kHeight, 10, 8, 1);
  Image albedo = Image(kWidth, kHeight, 3), normal = albedo, normal_behind = albedo;
  Features features{&albedo, &normal, &albedo, &normal_behind};
  std::vector<CandidateMaker> makers;
  PartsWeighting weighting;
  DenoisingParts parts;
  MixedParts mixed;
  std::array<PartOnDevice, 3> on_device;
  std::array<Buffer<float>, 2> counts;
  Buffer<unsigned char> valid;

  explicit Example(float bias_share = 1, FilterKinds kinds = FilterKinds::kAll) : weighting{bias_share, 0, false} {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) {
          albedo.pixel(x, y)[c] = x / 8 % 2 ? 0.7f : 0.2f;
          normal.pixel(x, y)[c] = normal_behind.pixel(x, y)[c] = y > 20 ? 0.5f : -0.2f;
          if (x < 15) normal_behind.pixel(x, y)[c] = 0.9f;  // a mirror
        }
    groups.pixel(3, 4)[1] = INFINITY;
    makers = {filtered_candidates(features, CandidateBase::kMean, kinds)};
    parts = covary::parts_of_mean(groups.view());
    parts.features = features;
    mixed = mix_parts(parts, makers, weighting);
    on_device = {PartOnDevice(parts.whole, mixed.whole), PartOnDevice(parts.halves[0], mixed.halves[0]),
                 PartOnDevice(parts.halves[1], mixed.halves[1])};
    valid = test_device().upload(std::span(std::as_const(parts.valid)));
    for (const int half : {0, 1})
      counts[half] = error_weights(test_device(), on_device[half + 1].candidates, on_device[half + 1].std_error);
  }

  MixtureBuffers input(bool planted_bug = false) const {
    MixtureBuffers in{kWidth, kHeight, static_cast<int>(mixed.whole.candidates.size())};
    in.whole = {&on_device[0].base, &on_device[0].candidates};
    for (const int half : {0, 1}) {
      in.halves[half] = {&on_device[half + 1].base, &on_device[half + 1].candidates};
      in.independent[half] = &on_device[half + 1].independent.mean;
      in.counts[half] = &counts[half];
    }
    in.valid = &valid, in.bias_share = weighting.bias_share, in.prior = kPriorOfMean, in.planted_bug = planted_bug;
    return in;
  }
  MixedBuffers mix_on_device(bool planted_bug = false) const {
    const MixtureBuffers in = input(planted_bug);
    const std::vector<NormalRow> rows = gpu::normal_rows(test_device(), in, 0, kHeight);
    return gpu::mix(test_device(), in, weights_of_whole(true, makers, weighting, mean_samples(groups.view()), rows));
  }
};

std::vector<float> all_weights(const Mixture& mixture) {
  std::vector<float> all;
  for (const Image& image : mixture.weights) all.insert(all.end(), image.data.begin(), image.data.end());
  return all;
}

TEST(GpuMixture, IsThatOfTheProcessor) {
  for (const auto& [bias_share, kinds] :
       {std::pair(1.0f, FilterKinds::kAll), std::pair(4.0f, FilterKinds::kRegression)}) {
    SCOPED_TRACE(bias_share);
    const Example example(bias_share, kinds);
    for (const int half : {0, 1}) EXPECT_TRUE(agree(example.mixed.counts[half].data, down(example.counts[half])));
    const MixedBuffers found = example.mix_on_device();
    const Mixture& expected = example.mixed.mixture;
    EXPECT_TRUE(agree(all_weights(expected), down(found.weights)));
    EXPECT_TRUE(agree(expected.image.data, down(found.image)));
    for (const int half : {0, 1}) EXPECT_TRUE(agree(expected.halves[half].data, down(found.halves[half])));
    EXPECT_TRUE(agree(
        disagreement(example.mixed.whole, example.mixed.whole.candidates[0], expected.image, example.parts.valid).data,
        down(disagreement(test_device(), example.input(), found.image))));
  }
}

TEST(GpuMixture, NoticesWeightsJudgedByTheirOwnSamples) {
  const Example example;
  EXPECT_FALSE(agree(all_weights(example.mixed.mixture), down(example.mix_on_device(true).weights)));
}

/// What held-out samples tell, by the processor and by the device, of the same images.
struct HeldOutExample : Example {
  std::array<Buffer<float>, 2> halves;
  Buffer<float> image;
  HeldOutInput expected;
  HeldOutBuffers given;

  HeldOutExample() {
    const Mixture& mixture = mixed.mixture;
    for (const int half : {0, 1}) {
      halves[half] = up(mixture.halves[half].data);
      expected.halves[half] = &mixture.halves[half];
      expected.independent[half] = &parts.halves[half].independent;
      given.halves[half] = {&halves[half]};
      given.independent[half] = &on_device[half + 1].independent;
    }
    image = up(mixture.image.data);
    expected.guide = &guide_of(mixed.whole), expected.valid = &parts.valid;
    given.width = kWidth, given.height = kHeight;
    given.guide = &on_device[0].candidates, given.valid = &valid;
  }
};

/// Sums of rows as floats, relative to the largest, so that those near 0 may differ.
template <typename Row>
std::vector<float> relative_sums(const std::vector<Row>& rows, const std::vector<Row>& scale, double Row::*sum) {
  double largest = 1e-30;
  for (const Row& row : scale) largest = std::max(largest, std::abs(row.*sum));
  std::vector<float> values;
  for (const Row& row : rows) values.push_back(static_cast<float>(row.*sum / largest));
  return values;
}

template <typename Row>
testing::AssertionResult sums_agree(const std::vector<Row>& expected, const std::vector<Row>& found, double Row::*sum) {
  return agree(relative_sums(expected, expected, sum), relative_sums(found, expected, sum));
}

TEST(GpuHeldOut, ErrorsAreThoseOfTheProcessor) {
  HeldOutExample example;
  const HeldOutParts expected = covary::held_out_parts(example.expected);
  const HeldOutParts found = held_out_parts(test_device(), example.given);
  EXPECT_TRUE(agree(expected.relative.data, found.relative.data));
  EXPECT_TRUE(agree(expected.weight.data, found.weight.data));
  for (const auto sum : {&HeldOutRow::error, &HeldOutRow::variance, &HeldOutRow::squares})
    EXPECT_TRUE(sums_agree(expected.rows, found.rows, sum));
  EXPECT_EQ(expected.rows[0].parts, found.rows[0].parts);
  example.given.planted_bug = true;
  EXPECT_FALSE(sums_agree(expected.rows, held_out_rows(test_device(), example.given), &HeldOutRow::error));
}

TEST(GpuHeldOut, BiasIsThatOfTheProcessor) {
  HeldOutExample example;
  for (const int half : {0, 1}) {  // images that are too bright where it is dark
    Image& image = example.mixed.mixture.halves[half];
    for (float& value : image.data) value *= value < 0.5f ? 1.3f : 1.0f;
    example.halves[half] = up(image.data);
  }
  const std::array features = {&guide_of(example.mixed.halves[0]), &guide_of(example.mixed.halves[1])};
  const Image expected =
      covary::held_out_bias({example.expected.halves, features, example.expected.independent, &example.parts.valid});
  ASSERT_GT(std::count_if(expected.data.begin(), expected.data.end(), [](float b) { return b != 0; }), 500);
  const std::array on_device = {
      std::as_const(example.on_device[1].candidates).size() ? &example.on_device[1].candidates : nullptr,
      &example.on_device[2].candidates};
  const auto found = [&](bool planted_bug) {
    example.given.planted_bug = planted_bug;
    return gpu::held_out_bias(test_device(), example.given, {on_device[0], on_device[1]}).data;
  };
  EXPECT_TRUE(agree(expected.data, found(false)));
  EXPECT_FALSE(agree(expected.data, found(true)));
}

TEST(GpuHeldOut, RiskIsThatOfTheProcessor) {
  HeldOutExample example;
  example.mixed.mixture.image.pixel(30, 20)[1] *= 200;  // spread light
  example.image = up(example.mixed.mixture.image.data);
  const GroupedImage view = example.groups.view();
  const std::vector<RiskRow> expected = covary::image_risk(
      {&example.mixed.mixture.image, example.expected.halves, &example.parts.whole.independent,
       example.expected.independent, &view, example.expected.guide, &example.parts.valid, example.features});
  const Groups groups = upload(test_device(), view);
  const Buffer<float> normal = up(example.normal.data), behind = up(example.normal_behind.data);
  const auto found = [&](bool planted_bug) {
    example.given.planted_bug = planted_bug;
    return gpu::image_risk(test_device(), example.given, example.image, example.on_device[0].independent, groups,
                           {.normal = &normal, .normal_behind = &behind});
  };
  const std::vector<RiskRow> rows = found(false);
  ASSERT_GT(sum_of(expected).spread, 0);
  ASSERT_GT(sum_of(expected).specular_noise, 0);
  for (const auto& [name, sum] : kRiskSums) {
    SCOPED_TRACE(name);
    EXPECT_TRUE(sums_agree(expected, rows, sum));
  }
  EXPECT_FALSE(sums_agree(expected, found(true), &RiskRow::error));
}

}  // namespace
}  // namespace covary::gpu
