// SPDX-License-Identifier: Apache-2.0
// Fireflies are clamped; light that both halves of the groups find is not.
#include "denoising/limited_groups.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <vector>

#include "denoising/parts_mixture.h"
#include "estimators/test_images.h"

namespace covary::limited_groups_test {
namespace {

constexpr int kWidth = 40, kHeight = 30, kGroups = 6;

struct Picture {
  std::vector<float> data = std::vector<float>(kWidth * kHeight * kGroups * 3, 1.0f);
  std::vector<unsigned char> valid = std::vector<unsigned char>(kWidth * kHeight, 1);
  float* at(int x, int y, int group) { return &data[((y * kWidth + x) * kGroups + group) * 3]; }
  GroupedImage view() const { return {kWidth, kHeight, kGroups, data.data()}; }
};

TEST(LimitedGroups, ScalesWhatTheOtherHalfDenies) {
  Picture p;
  for (int c = 0; c < 3; ++c) p.at(20, 10, 3)[c] = 100.0f * static_cast<float>(c);
  const LimitedGroups limited(p.view(), p.valid);
  const float* rgb = limited.view().pixel(20, 10);
  for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(rgb[9 + c], kBrighter * static_cast<float>(c)) << "in its colour";
  Picture expected;
  for (int c = 0; c < 3; ++c) expected.at(20, 10, 3)[c] = rgb[9 + c];
  EXPECT_EQ(std::vector<float>(limited.view().data, limited.view().data + p.data.size()), expected.data);
}

TEST(LimitedGroups, KeepsWhatTheOtherHalfFindsAround) {
  Picture p;
  for (int c = 0; c < 3; ++c) p.at(20, 10, 3)[c] = p.at(23, 7, 4)[c] = 100;  // at the corner of the window
  EXPECT_EQ(LimitedGroups(p.view(), p.valid).view().pixel(20, 10)[9], 100);
  Picture far;
  for (int c = 0; c < 3; ++c) far.at(20, 10, 3)[c] = far.at(24, 10, 4)[c] = 100;
  EXPECT_EQ(LimitedGroups(far.view(), far.valid).view().pixel(20, 10)[9], kBrighter);
  Picture same_half;
  for (int c = 0; c < 3; ++c) same_half.at(20, 10, 3)[c] = same_half.at(20, 10, 5)[c] = 100;
  EXPECT_EQ(LimitedGroups(same_half.view(), same_half.valid).view().pixel(20, 10)[9], kBrighter);
}

// No other pixels are like these two, so filters keep them.
TEST(LimitedGroups, WhatTheNetworkDeniesIsInNoCandidate) {
  Picture p;
  for (int c = 0; c < 3; ++c) p.at(20, 10, 3)[c] = p.at(23, 7, 4)[c] = 100;
  for (int i = 0; i < 3 * kGroups; ++i) p.at(5, 5, 0)[i] = 50;  // a small light source, in all groups
  CandidateMaker network, filter;
  network.names = {"oidn"}, network.network = true;
  network.make = one_by_one([](const CandidateInput& in) {
    Image flat = *in.estimate;
    std::fill(flat.data.begin(), flat.data.end(), 1.0f);
    return std::vector{flat};
  });
  filter.names = {"sharp"};
  filter.make = one_by_one([](const CandidateInput& in) { return std::vector{*in.estimate}; });
  const DenoisingParts parts = parts_of_mean(p.view());
  const auto candidate = [&](const std::vector<CandidateMaker>& makers) {
    return candidates_of({&parts.whole}, parts.valid, makers)[0].candidates.back();
  };
  const Image before = candidate({filter}), limited = candidate({network, filter});
  EXPECT_NEAR(before.pixel(20, 10)[0], 17.5, 1e-4) << "without a network";
  EXPECT_FLOAT_EQ(limited.pixel(20, 10)[0], 1.5f);
  EXPECT_FLOAT_EQ(limited.pixel(23, 7)[0], 1.5f);
  EXPECT_EQ(limited.pixel(5, 5)[0], 50);
  EXPECT_EQ(limited.pixel(30, 20)[0], 1);
}

TEST(LimitedGroups, KeepsNegativeValuesAndPixelsThatAreNotValid) {
  Picture p;
  for (int c = 0; c < 3; ++c) p.at(5, 5, 0)[c] = -7, p.at(0, 0, 0)[c] = p.at(39, 29, 1)[c] = 100;
  p.valid[0] = 0;
  p.valid[kWidth * kHeight - 1] = 0;
  const LimitedGroups limited(p.view(), p.valid);
  EXPECT_EQ(std::vector<float>(limited.view().data, limited.view().data + p.data.size()), p.data);
}

TEST(LimitedGroups, KeepsASingleGroup) {
  Picture p;
  for (int c = 0; c < 3; ++c) p.at(5, 5, 0)[c] = 100;
  const GroupedImage one{kWidth, kHeight * kGroups, 1, p.data.data()};
  const std::vector<unsigned char> valid(kWidth * kHeight * kGroups, 1);
  const LimitedGroups limited(one, valid);
  EXPECT_EQ(std::vector<float>(limited.view().data, limited.view().data + p.data.size()), p.data);
}

TEST(LimitedGroups, DoesNotDependOnThreads) {
  const test::Grouped image = test::noisy_image(kWidth, kHeight, kGroups, 3, 1.0f, 0.01f);
  const std::vector<unsigned char> valid(kWidth * kHeight, 1);
  const size_t n = static_cast<size_t>(kWidth) * kHeight * kGroups * 3;
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const LimitedGroups alone(image.view(), valid);
  const tbb::global_control four(tbb::global_control::max_allowed_parallelism, 4);
  const LimitedGroups together(image.view(), valid);
  EXPECT_EQ(std::vector<float>(alone.view().data, alone.view().data + n),
            std::vector<float>(together.view().data, together.view().data + n));
}

}  // namespace
}  // namespace covary::limited_groups_test
