// SPDX-License-Identifier: Apache-2.0
#include "filters/neighbours.h"

#include <gtest/gtest.h>

#include <set>

#include "estimators/reference_control_variates.h"
#include "estimators/test_images.h"

namespace covary {
namespace {

struct Found {
  std::vector<lanes::vint> keys;
  std::vector<uint16_t> chosen;
  explicit Found(const NeighbourSearch& s) : keys(s.offsets().size()), chosen(s.chosen_size()) {}
};

Planes means(const test::Grouped& image, int border) {
  const std::vector<unsigned char> valid(static_cast<size_t>(image.width) * image.height, 1);
  return moments(image.view(), valid, border, kFar).mean;
}

/// Sizes that are not multiples of the lanes; borders; few and many candidates.
TEST(Neighbours, AreTheNearestInValue) {
  const test::Grouped image = test::crn_image(37, 21, 4, 5);
  for (const auto& [k, window] : {std::pair{25, 11}, {24, 11}, {3, 3}, {1, 5}, {100, 21}, {9, 3}}) {
    const NeighbourSearch search(k, window);
    const Planes guide = means(image, window / 2);
    Found found(search);
    for (int y = 0; y < image.height; ++y)
      for (int x0 = 0; x0 < image.width; x0 += lanes::kLanes) {
        search.find(guide, x0, y, found.keys.data(), found.chosen.data());
        for (int l = 0; l < std::min(lanes::kLanes, image.width - x0); ++l) {
          const int x = x0 + l;
          std::vector<double> all;
          const auto distance = [&](Offset o) {
            return reference::distance2(reference::mean(image.view(), x, y),
                                        reference::mean(image.view(), x + o.dx, y + o.dy));
          };
          const auto inside = [&](Offset o) {
            return x + o.dx >= 0 && y + o.dy >= 0 && x + o.dx < image.width && y + o.dy < image.height;
          };
          for (Offset o : search.offsets())
            if (inside(o)) all.push_back(distance(o));
          std::sort(all.begin(), all.end());
          std::set<int> different;
          int n_inside = 0;
          for (int i = 0; i < k; ++i) {
            const int index = found.chosen[l * k + i];
            different.insert(index);
            if (!inside(search.offsets()[index])) continue;
            ++n_inside;
            // No nearer candidate may have been missed, up to the 14 bits with which distances are compared.
            const double limit = all[std::min<size_t>(k, all.size()) - 1];
            EXPECT_LE(distance(search.offsets()[index]), limit * (1 + 1.0 / 8192) + 1e-12) << x << ", " << y;
          }
          EXPECT_EQ(different.size(), static_cast<size_t>(k));
          EXPECT_EQ(n_inside, std::min<int>(k, static_cast<int>(all.size()))) << x << ", " << y;
        }
      }
  }
}

TEST(Neighbours, OfEqualValuesAreTheNearestInSpace) {
  const test::Grouped image = test::constant_image(40, 40, 3, 0.7f);
  const NeighbourSearch search(25, 11);
  const Planes guide = means(image, 5);
  Found found(search);
  search.find(guide, 12, 20, found.keys.data(), found.chosen.data());
  for (int l = 0; l < lanes::kLanes; ++l)
    for (int i = 0; i < 25; ++i) EXPECT_EQ(found.chosen[l * 25 + i], i);
  // Offsets are ordered outwards from the target.
  EXPECT_EQ(search.offsets()[0].dx, 0);
  EXPECT_EQ(search.offsets()[0].dy, 0);
  for (size_t i = 1; i < search.offsets().size(); ++i) {
    const Offset a = search.offsets()[i - 1], b = search.offsets()[i];
    EXPECT_LE(a.dx * a.dx + a.dy * a.dy, b.dx * b.dx + b.dy * b.dy);
  }
}

}  // namespace
}  // namespace covary
