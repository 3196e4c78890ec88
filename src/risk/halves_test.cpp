// SPDX-License-Identifier: Apache-2.0
#include "risk/halves.h"

#include <gtest/gtest.h>

#include "estimators/test_images.h"
#include "film/groups.h"

namespace covary {
namespace {

TEST(Halves, HoldEverySecondGroup) {
  const test::Grouped image = test::independent_image(5, 4, 7, 1);
  for (int first : {0, 1}) {
    const HalfImage half(image.view(), first);
    const GroupedImage view = half.view();
    ASSERT_EQ(view.groups, first == 0 ? 4 : 3);
    EXPECT_EQ(view.counts, nullptr);
    for (int t = 0; t < view.groups; ++t)
      for (int c = 0; c < 3; ++c)
        EXPECT_EQ(view.pixel(3, 2)[3 * t + c], image.view().pixel(3, 2)[3 * (2 * t + first) + c]);
  }
}

TEST(Halves, KeepTheSizesOfTheirGroups) {
  test::Grouped image = test::independent_image(30, 1, 7, 1);
  for (uint32_t n = 14; n < 44; ++n) image.counts.push_back(n);
  for (int first : {0, 1}) {
    const HalfImage half(image.view(), first);
    const GroupedImage view = half.view();
    for (int x = 0; x < 30; ++x)
      for (int t = 0; t < view.groups; ++t)
        EXPECT_EQ(group_size(view.count(x, 0), view.groups, t), group_size(image.counts[x], 7, 2 * t + first));
  }
}

}  // namespace
}  // namespace covary
