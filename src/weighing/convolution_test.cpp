// SPDX-License-Identifier: Apache-2.0
#include "weighing/convolution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

namespace covary::convolution_test {
namespace {

void append_half(uint16_t bits, std::string& bytes) {
  bytes.push_back(static_cast<char>(bits & 255)), bytes.push_back(static_cast<char>(bits >> 8));
}

/// Planes with a border of zeros and a value that differs everywhere.
Planes planes_of(int width, int height, int count) {
  Planes planes(width, height, count, 1, 0);
  for (int c = 0; c < count; ++c)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) planes.row(c, y)[x] = std::sin(static_cast<float>(1 + x + 7 * y + 31 * c));
  return planes;
}

TEST(Convolution, ReadsHalves) {
  EXPECT_EQ(from_half(0), 0.0f);
  EXPECT_EQ(from_half(0x3c00), 1.0f);
  EXPECT_EQ(from_half(0xc000), -2.0f);
  EXPECT_EQ(from_half(0x3555), 1365.0f / 4096);
  EXPECT_EQ(from_half(1), std::ldexp(1.0f, -24));
  EXPECT_EQ(from_half(0x83ff), -1023 * std::ldexp(1.0f, -24));
  EXPECT_EQ(from_half(0x7bff), 65504.0f);
  EXPECT_EQ(from_half(0x7c00), std::numeric_limits<float>::infinity());
}

/// Weights in the file are [row][column][input][output].
TEST(Convolution, SumsTheSquareAroundOverAllInputs) {
  constexpr int kInputs = 3, kOutputs = 6, kWidth = 61, kHeight = 5;
  std::string bytes;
  const auto weight = [](int n) { return static_cast<uint16_t>(0x3000 + 37 * n % 0x800 + (n % 3 == 0 ? 0x8000 : 0)); };
  for (int n = 0; n < 9 * kInputs * kOutputs + kOutputs; ++n) append_half(weight(n), bytes);
  bytes += "rest";
  std::string_view rest = bytes;
  const Convolution layer = read_convolution(rest, 3, kInputs, kOutputs);
  EXPECT_EQ(rest, "rest");
  const Planes first = planes_of(kWidth, kHeight, 1), second = planes_of(kWidth, kHeight, 2);
  const Planes result = convolved(layer, {&first, &second}, false);
  ASSERT_EQ(result.count(), kOutputs);
  for (int o = 0; o < kOutputs; ++o)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        double sum = from_half(weight(9 * kInputs * kOutputs + o));
        for (int place = 0; place < 9; ++place)
          for (int i = 0; i < kInputs; ++i) {
            const Planes& source = i == 0 ? first : second;
            const float value = source.row(i == 0 ? 0 : i - 1, y + place / 3 - 1)[x + place % 3 - 1];
            sum += from_half(weight((place * kInputs + i) * kOutputs + o)) * static_cast<double>(value);
          }
        ASSERT_NEAR(result.row(o, y)[x], sum, 1e-5) << o << " at " << x << ", " << y;
      }
  const Planes positive = convolved(layer, {&first, &second});
  for (int x = 0; x < kWidth; ++x) ASSERT_EQ(positive.row(0, 2)[x], std::max(result.row(0, 2)[x], 0.0f)) << x;
  EXPECT_EQ(result.row(0, 0)[kWidth], 0) << "the border remains";
}

TEST(Convolution, HalvesByMeansAndDoubles) {
  const Planes planes = planes_of(8, 4, 2), small = halved(planes), large = doubled(small);
  EXPECT_NEAR(small.row(1, 1)[2],
              (planes.row(1, 2)[4] + planes.row(1, 2)[5] + planes.row(1, 3)[4] + planes.row(1, 3)[5]) / 4, 1e-6);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 8; ++x) EXPECT_EQ(large.row(1, y)[x], small.row(1, y / 2)[x / 2]);
}

}  // namespace
}  // namespace covary::convolution_test
