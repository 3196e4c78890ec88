// SPDX-License-Identifier: Apache-2.0
#include "scene/lobed_filter.h"

#include <gtest/gtest.h>

#include <cmath>

namespace covary {
namespace {

const LobedFilter* const kFilters[] = {&LobedFilter::mitchell(1.0f / 3, 1.0f / 3), &LobedFilter::catmull_rom(),
                                       &LobedFilter::lanczos(3), &LobedFilter::lanczos(1)};

// [MitchellNetravali1988] Eq. (8): with B = C = 1/3, the filter is 8/9 at 0, 1/18 at 1 and -5/144 at 3/2. The
// Catmull-Rom spline interpolates: 1 at 0, 0 at the other pixels, -1/16 at 3/2.
TEST(LobedFilter, FollowsTheFormulas) {
  const LobedFilter &mitchell = *kFilters[0], &catmull_rom = *kFilters[1], &lanczos = *kFilters[2];
  EXPECT_NEAR(mitchell.value(0), 8.0 / 9, 1e-6);
  EXPECT_NEAR(mitchell.value(-1), 1.0 / 18, 1e-6);
  EXPECT_NEAR(mitchell.value(1.5), -5.0 / 144, 1e-6);
  EXPECT_EQ(mitchell.value(2), 0);
  EXPECT_NEAR(catmull_rom.value(0), 1, 1e-6);
  EXPECT_NEAR(catmull_rom.value(1), 0, 1e-6);
  EXPECT_NEAR(catmull_rom.value(-1.5), -1.0 / 16, 1e-6);
  // sinc(3/2) sinc(1/2) over sinc(1/2) sinc(1/6), where sinc(x) = sin(pi x) / (pi x).
  const auto sinc = [](double x) { return std::sin(M_PI * x) / (M_PI * x); };
  EXPECT_NEAR(lanczos.value(1.5) / lanczos.value(0.5), sinc(1.5) * sinc(0.5) / (sinc(0.5) * sinc(1.0 / 6)), 1e-6);
}

TEST(LobedFilter, IntegratesToOne) {
  for (const LobedFilter* filter : kFilters) {
    double sum = 0;
    constexpr int kN = 100000;
    for (int i = 0; i < kN; ++i) sum += filter->value(filter->radius() * (2 * (i + 0.5) / kN - 1));
    EXPECT_NEAR(sum * 2 * filter->radius() / kN, 1, 1e-5) << filter->text();
  }
}

// Weighted samples have the moments of the filter itself: 1, 0, and its second moment.
TEST(LobedFilter, WeightedSamplesFollowTheFilter) {
  for (const LobedFilter* filter : kFilters) {
    constexpr int kN = 1000000;
    double sums[3] = {0, 0, 0}, second = 0, largest = 0;
    for (int i = 0; i < kN; ++i) {
      const double u = (i + 0.5) / kN, x = filter->radius() * (2 * u - 1);
      const LobedFilter::Sample s = filter->sample(static_cast<float>(u));
      ASSERT_LE(std::abs(s.offset), filter->radius());
      for (int k = 0; k < 3; ++k) sums[k] += s.weight * std::pow(s.offset, k) / kN;
      second += x * x * filter->value(x) * 2 * filter->radius() / kN;
      largest = std::max<double>(largest, std::abs(s.weight));
    }
    EXPECT_NEAR(sums[0], 1, 1e-4) << filter->text();
    EXPECT_NEAR(sums[1], 0, 1e-4) << filter->text();
    EXPECT_NEAR(sums[2], second, 1e-3) << filter->text();
    EXPECT_LT(largest, 1.5) << filter->text();  // the integral of the magnitude is 1.08 to 1.33
  }
}

}  // namespace
}  // namespace covary
