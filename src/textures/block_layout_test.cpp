// SPDX-License-Identifier: Apache-2.0
#include "textures/block_layout.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "core/large_vector.h"

namespace covary {
namespace {

TEST(BlockLayout, GivesEachTexelAPlaceOfItsOwn) {
  for (const auto& [width, height] : {std::pair{1, 1}, {4, 4}, {5, 3}, {7, 9}, {16, 1}}) {
    const BlockLayout layout(width, height);
    std::vector<int> uses(layout.size());
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const size_t i = layout.index(x, y);
        ASSERT_LT(i, layout.size());
        EXPECT_EQ(++uses[i], 1) << x << ", " << y << " of " << width << " x " << height;
        EXPECT_EQ(i / 16, layout.index(x / 4 * 4, y / 4 * 4) / 16) << "not in the block of its neighbours";
      }
  }
}

TEST(LargeVector, BeginsOnACacheLineAndLargeOnesOnAHugePage) {
  const LargeVector<float> small(3, 1.0f), large(size_t{1} << 20, 1.0f);
  EXPECT_EQ(reinterpret_cast<uintptr_t>(small.data()) % 64, 0u);
  EXPECT_EQ(reinterpret_cast<uintptr_t>(large.data()) % (2u << 20), 0u);
  EXPECT_EQ(large.back(), 1.0f);
}

}  // namespace
}  // namespace covary
