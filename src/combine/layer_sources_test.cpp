// SPDX-License-Identifier: Apache-2.0
// Layers of any renderer, denoised with their image.
#include "combine/layer_sources.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "combine/combine.h"
#include "combine/registry.h"
#include "core/error.h"
#include "denoising/mixed_denoising.h"
#include "estimators/test_images.h"

namespace covary::layer_sources_test {
namespace {

constexpr int kWidth = 32, kHeight = 24, kGroups = 4;

/// An image with two lamps, each with its own noise.
struct Lamps {
  std::vector<float> both, key, fill;
  Lamps() {
    uint64_t n = 0;
    const auto uniform = [&] { return test::noise(7, 0, n++) + 0.5f; };
    for (int i = 0; i < kWidth * kHeight * kGroups * 3; ++i) {
      key.push_back(uniform() < 0.5f ? uniform() : 0), fill.push_back(0.3f * uniform());
      both.push_back(key.back() + fill.back());
    }
  }
  static GroupedSource source(const std::vector<float>& values, int groups = kGroups) {
    return source_of(GroupedImage{kWidth, kHeight, groups, values.data()}, {.name = "test"});
  }
  CombineRequest request(std::vector<LayerSource> layers) const {
    CombineRequest request;
    request.independent = source(both);
    request.layers = std::move(layers);
    request.estimator = with_denoising(make_estimator(kNoEstimator), DenoisingChoice{"auto", "off", nullptr});
    request.settings.std_error = true;
    return request;
  }
};

void expect_sum(const CombinedImage& combined) {
  for (size_t i = 0; i < combined.image.estimate.data.size(); ++i) {
    double sum = 0;
    for (const auto& [name, layer] : combined.layers) sum += layer.data[i];
    ASSERT_NEAR(sum, combined.image.estimate.data[i], 1e-5) << i;
  }
}

std::string message(const CombineRequest& request) {
  try {
    combine(request);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(LayerSources, AddUpToThePicture) {
  const Lamps lamps;
  const CombinedImage combined =
      combine(lamps.request({{"key", Lamps::source(lamps.key)}, {"fill", Lamps::source(lamps.fill)}}));
  ASSERT_EQ(combined.layers.size(), 2u);
  expect_sum(combined);
  EXPECT_EQ(combined.image.estimate.data, combine(lamps.request({})).image.estimate.data)
      << "layers leave the picture as it is";
}

TEST(LayerSources, LeaveARest) {
  const Lamps lamps;
  const CombinedImage combined = combine(lamps.request({{"key", Lamps::source(lamps.key)}}));
  ASSERT_EQ(combined.layers.size(), 2u);
  ASSERT_TRUE(combined.layers.contains(kRest));
  expect_sum(combined);
  const std::vector<float>& rest = combined.layers.at(kRest).data;
  double sum = 0;
  for (const float value : rest) sum += value;
  EXPECT_NEAR(sum / static_cast<double>(rest.size()), 0.15, 0.01);
}

TEST(LayerSources, AreOfTheImagesPixelsAndGroups) {
  const Lamps lamps;
  EXPECT_NE(message(lamps.request({{"key", Lamps::source(lamps.key, 2)}}))
                .find("the layer 'key' has 32 x 24 pixels in 2 groups, the image 32 x 24 in 4"),
            std::string::npos);
  EXPECT_NE(message(lamps.request({{"key", Lamps::source(lamps.key)}, {"key", Lamps::source(lamps.key)}}))
                .find("the layer 'key' appears twice"),
            std::string::npos);
}

TEST(LayerSources, AreLeftOutWhereTheyAreNotFinite) {
  const Lamps lamps;
  std::vector<float> broken = lamps.key;
  constexpr size_t kPixel = 2 * kWidth + 5;
  float* const values = &broken[kPixel * 3 * kGroups];
  values[3 + 1] = NAN;  // green of the second group
  const CombineRequest request = lamps.request({{"key", Lamps::source(broken)}, {"fill", Lamps::source(lamps.fill)}});
  const CombinedImage combined = combine(request);
  expect_sum(combined);
  std::vector<std::string> texts;
  for (const Finding& finding : combined.inputs.findings) texts.push_back(finding.text);
  EXPECT_NE(std::find(texts.begin(), texts.end(),
                      "the layer 'key': 1 of 768 pixels hold values that are not finite, the first at (5, 2) in render "
                      "2; these values are left out; find the cause in the renderer"),
            texts.end())
      << testing::PrintToString(texts);

  const GroupedImage picture = request.independent.all();
  const WholeLayers whole(picture, request.layers);
  const float others = (values[1] + values[6 + 1] + values[9 + 1]) / 3;
  EXPECT_NEAR(whole.view()[0].image.pixel(5, 2)[3 + 1], others, 1e-6);
}

}  // namespace
}  // namespace covary::layer_sources_test
