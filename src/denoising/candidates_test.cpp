// SPDX-License-Identifier: Apache-2.0
#include "denoising/candidates.h"

#include <gtest/gtest.h>

#include "denoising/parts_mixture.h"
#include "estimators/test_images.h"

namespace covary::candidates_test {
namespace {

/// A wall beside a lamp as bright, which reflects nothing: divided by its albedo, it would outshine the wall.
TEST(Candidates, OfAWallDoNotShineLikeTheLampBesideIt) {
  constexpr int kWidth = 48, kHeight = 40, kLamp = 24;
  Image albedo(kWidth, kHeight, 3), normal(kWidth, kHeight, 3);
  test::Grouped image = test::noisy_image(kWidth, kHeight, 2, 3, 1);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) {
        albedo.pixel(x, y)[c] = x < kLamp ? 0.5f : 0;
        normal.pixel(x, y)[c] = c == 2;
        const auto index = static_cast<uint64_t>(y * kWidth + x);
        for (int g = 0; g < 2; ++g) {
          const float noise = test::noise(5, 2 * index + g, 0);
          image.pixel(x, y)[3 * g + c] = x < kLamp ? 1 + noise : 600 + 1200 * noise;
        }
      }
  const Features features{&albedo, &normal};
  const DenoisingParts parts = parts_of_mean(image.view());
  const CandidateMaker maker = filtered_candidates(features, CandidateBase::kMean, FilterKinds::kAll);
  const Image mean = mean_image(parts.whole.independent);
  const CandidateInput input = input_of(parts.whole, mean, parts.valid, 0);
  const std::vector<Image> candidates = maker.make({&input, 1})[0];
  ASSERT_EQ(candidates.size(), maker.names.size());
  for (size_t p = 0; p < candidates.size(); ++p) {
    float beside = 0;
    for (int y = 0; y < kHeight; ++y) beside += candidates[p].pixel(kLamp - 1, y)[0] / kHeight;
    EXPECT_LT(beside, 3) << maker.names[p];
  }
}

}  // namespace
}  // namespace covary::candidates_test
