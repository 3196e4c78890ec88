// SPDX-License-Identifier: Apache-2.0
// NL-means against its formula in double precision; effects of windows and masks.
#include "filters/nl_means.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "estimators/test_images.h"

namespace covary {
namespace {

struct Picture {
  Image f, s, other;
  Planes features;
  std::vector<unsigned char> valid;

  Picture(int width, int height) : f(width, height, 3), s(f), other(f), features(width, height, 2, kNlMeansRadius, 0) {
    valid.assign(static_cast<size_t>(width) * height, 1);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const uint64_t pixel = static_cast<uint64_t>(y) * width + x;
        for (int c = 0; c < 3; ++c) {
          s.pixel(x, y)[c] = 0.1f + 0.05f * test::noise(3, pixel, c);
          f.pixel(x, y)[c] = static_cast<float>(test::expected(x, y, c)) + 0.3f * test::noise(4, pixel, c);
          other.pixel(x, y)[c] = test::noise(5, pixel, c);
        }
        for (int i : {0, 1}) features.row(i, y)[x] = test::noise(6, pixel, i);
      }
  }
  std::vector<Image> filtered(const std::vector<NlMeansTask>& tasks) const {
    const NlMeansSteering steering[] = {{&f, &s, tasks}};
    return nl_means(steering, &features, valid);
  }
};

/// The formula of nl_means.h at one pixel.
std::array<double, 3> expected_mean(const Picture& p, const Image& source, int x, int y, double bandwidth) {
  const int width = p.f.width, height = p.f.height;
  std::array<double, 3> sum{};
  double weights = 0;
  for (int dy = -kNlMeansRadius; dy <= kNlMeansRadius; ++dy)
    for (int dx = -kNlMeansRadius; dx <= kNlMeansRadius; ++dx) {
      const int qx = x + dx, qy = y + dy;
      if (qx < 0 || qy < 0 || qx >= width || qy >= height || !p.valid[qy * width + qx]) continue;
      double distance = 0, feature = 0;
      for (int v = -1; v <= 1; ++v)
        for (int u = -1; u <= 1; ++u)
          for (int c = 0; c < 3; ++c) {
            const auto at = [&](const Image& image, int px, int py) {
              return static_cast<double>(image.pixel(std::clamp(px, 0, width - 1), std::clamp(py, 0, height - 1))[c]);
            };
            const double difference = at(p.f, x + u, y + v) - at(p.f, qx + u, qy + v);
            const double own = std::pow(at(p.s, x + u, y + v), 2), other = std::pow(at(p.s, qx + u, qy + v), 2);
            distance += (difference * difference - own - std::min(own, other)) / (own + other + 1e-10) / 27;
          }
      for (int i : {0, 1}) feature += std::pow(p.features.row(i, y)[x] - p.features.row(i, qy)[qx], 2);
      const double weight = std::exp(-std::max({distance / (bandwidth * bandwidth), feature, 0.0}));
      weights += weight;
      for (int c = 0; c < 3; ++c) sum[c] += weight * source.pixel(qx, qy)[c];
    }
  for (double& value : sum) value /= weights;
  return sum;
}

TEST(NlMeans, IsItsFormula) {
  Picture p(150, 37);  // more than one tile in both directions
  p.valid[20 * 150 + 70] = 0;
  const std::vector<Image> images = p.filtered({{0.5f, {&p.f, &p.other}}, {1.0f, {&p.f}}, {0.7f, {&p.other}}});
  ASSERT_EQ(images.size(), 4u);
  for (const auto& [x, y] : {std::pair{0, 0}, {149, 36}, {125, 15}, {126, 16}, {69, 20}, {149, 5}})
    for (const auto& [image, source, bandwidth] :
         {std::tuple{0, &p.f, 0.5}, {1, &p.other, 0.5}, {2, &p.f, 1.0}, {3, &p.other, 0.7}}) {
      const std::array<double, 3> expected = expected_mean(p, *source, x, y, bandwidth);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(images[image].pixel(x, y)[c], expected[c], 2e-5) << x << " " << y << " image " << image;
    }
}

TEST(NlMeans, LeavesOutWhatIsNotValid) {
  Picture p(20, 20);
  for (int c = 0; c < 3; ++c) p.other.pixel(9, 9)[c] = 1e30f;
  p.valid[9 * 20 + 9] = 0;
  const Image image = p.filtered({{1.0f, {&p.other}}})[0];
  for (float value : image.data) ASSERT_LT(value, 1.0f);
}

TEST(NlMeans, KeepsWhatHasNoErrorAndNoEqual) {
  Picture p(5, 4);
  std::fill(p.s.data.begin(), p.s.data.end(), 0.0f);
  EXPECT_EQ(p.filtered({{0.5f, {&p.f}}})[0].data, p.f.data);
  const Picture one(1, 1);
  EXPECT_EQ(one.filtered({{0.5f, {&one.f}}})[0].data, one.f.data);
}

TEST(NlMeans, DoesNotDependOnThreads) {
  const Picture p(140, 40);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const std::vector<float> alone = p.filtered({{0.5f, {&p.f}}})[0].data;
  const tbb::global_control four(tbb::global_control::max_allowed_parallelism, 4);
  EXPECT_EQ(p.filtered({{0.5f, {&p.f}}})[0].data, alone);
}

TEST(NlMeans, OfSeveralImagesIsThatOfEach) {
  const Picture p(140, 40);
  const NlMeansSteering both[] = {{&p.f, &p.s, {{0.5f, {&p.f}}}}, {&p.other, &p.s, {{1.0f, {&p.other, &p.f}}}}};
  const std::vector<Image> images = nl_means(both, &p.features, p.valid);
  ASSERT_EQ(images.size(), 3u);
  const std::vector<Image> second = nl_means(std::span(both).last(1), &p.features, p.valid);
  EXPECT_EQ(images[0].data, p.filtered({{0.5f, {&p.f}}})[0].data);
  EXPECT_EQ(images[1].data, second[0].data);
  EXPECT_EQ(images[2].data, second[1].data);
}

/// Over several tiles, which begin within the rows that are wanted and around them.
TEST(NlMeans, OfWantedRowsIsThatOfAll) {
  const Picture p(30, 200);
  const NlMeansSteering steering{&p.f, &p.s, {{0.5f, {&p.f}}}};
  const Image all = p.filtered({{0.5f, {&p.f}}})[0];
  for (const auto& [first, end] : {std::pair{0, 20}, {70, 71}, {50, 140}, {128, 200}, {200, 200}}) {
    const Image rows = nl_means({&steering, 1}, &p.features, p.valid, {0, first, end})[0];
    for (int y = 0; y < 200; ++y)
      for (int i = 0; i < 3 * 30; ++i)
        ASSERT_EQ(rows.pixel(0, y)[i], y >= first && y < end ? all.pixel(0, y)[i] : 0) << first << " row " << y;
  }
}

TEST(NlMeans, KeepsToValuesOfAnySize) {
  for (const float scale : {0.1f, 1e14f}) {
    Picture p(40, 20), scaled = p;
    for (Image* image : {&scaled.f, &scaled.s})
      for (float& value : image->data) value *= scale;
    const Image expected = p.filtered({{0.5f, {&p.f}}})[0], image = scaled.filtered({{0.5f, {&scaled.f}}})[0];
    for (size_t i = 0; i < image.data.size(); ++i)
      ASSERT_NEAR(image.data[i] / scale, expected.data[i], 1e-4 * (1 + std::abs(expected.data[i])));
  }
}

}  // namespace
}  // namespace covary
