// SPDX-License-Identifier: Apache-2.0
// Regression against its formula in double precision; it preserves what weighted means blur.
#include "filters/regression.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "estimators/test_images.h"
#include "filters/nl_means.h"

namespace covary {
namespace {

struct FittedPicture {
  Image f, s, other, feature, position;
  std::vector<unsigned char> valid;

  FittedPicture(int width, int height) : f(width, height, 3), s(f), other(f), feature(width, height, 2), position(f) {
    valid.assign(static_cast<size_t>(width) * height, 1);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const uint64_t pixel = static_cast<uint64_t>(y) * width + x;
        for (int i : {0, 1, 2}) position.pixel(x, y)[i] = 40 * test::noise(7, pixel, i);
        for (int i : {0, 1}) feature.pixel(x, y)[i] = test::noise(6, pixel, i);
        for (int c = 0; c < 3; ++c) {
          s.pixel(x, y)[c] = 0.1f + 0.05f * test::noise(3, pixel, c);
          f.pixel(x, y)[c] = expected(x, y, c) + s.pixel(x, y)[c] * 1.7f * test::noise(4, pixel, c);
          other.pixel(x, y)[c] = test::noise(5, pixel, c);
        }
      }
  }
  /// A first-order function of features and position.
  float expected(int x, int y, int c) const {
    const float* q = feature.pixel(x, y);
    return 1 + 0.4f * q[0] - 0.2f * static_cast<float>(c) * q[1] + 0.01f * static_cast<float>(x - y);
  }
  std::vector<Image> regressed(const std::vector<const Image*>& sources, bool coarse = false) const {
    const Image* const features[] = {&feature};
    return covary::regressed({&f, &s, sources, std::vector(sources.size(), &other), &position, coarse}, features,
                             valid);
  }
};

/// Weight of a pixel in the window of another, which may be outside the frame.
double likeness(const FittedPicture& p, int x, int y, int qx, int qy) {
  const auto at = [&](const Image& image, int px, int py) {
    return image.pixel(std::clamp(px, 0, image.width - 1), std::clamp(py, 0, image.height - 1));
  };
  double distance = 0;
  for (int v = -1; v <= 1; ++v)
    for (int u = -1; u <= 1; ++u)
      for (int c = 0; c < 3; ++c) {
        const double difference = at(p.f, x + u, y + v)[c] - at(p.f, qx + u, qy + v)[c];
        const double own = std::pow(at(p.s, x + u, y + v)[c], 2), that = std::pow(at(p.s, qx + u, qy + v)[c], 2);
        distance += (difference * difference - own - std::min(own, that)) / (own + that) / 27;
      }
  return std::exp(-std::max(distance / 0.25, 0.0));
}

/// The formula of regression.h for the image itself, channel 0.
std::vector<double> by_formula(const FittedPicture& p, int step) {
  const int width = p.f.width, height = p.f.height;
  std::vector<double> sum, total(p.valid.size(), 1);
  for (size_t i = 0; i < p.valid.size(); ++i) sum.push_back(p.other.data[3 * i]);
  for (int y = 1; y <= height + step - 2; y += step)
    for (int x = 1; x <= width + step - 2; x += step) {
      const int centre_x = std::min(x, width - 1), centre_y = std::min(y, height - 1);
      const float* centre = p.feature.pixel(centre_x, centre_y);
      Eigen::MatrixXd a = Eigen::MatrixXd::Zero(8, 8);
      Eigen::VectorXd b = Eigen::VectorXd::Zero(8);
      const auto for_each = [&](const auto& visit) {
        for (int qy = std::max(0, y - 10); qy <= std::min(height - 1, y + 10); ++qy)
          for (int qx = std::max(0, x - 10); qx <= std::min(width - 1, x + 10); ++qx) {
            const size_t pixel = static_cast<size_t>(qy) * width + qx;
            if (!p.valid[pixel]) continue;
            const float* q = p.feature.pixel(qx, qy);
            Eigen::VectorXd t(8);
            const float *there = p.position.pixel(qx, qy), *here = p.position.pixel(centre_x, centre_y);
            t << 1, (qx - x) / 6.0, (qy - y) / 6.0, q[0] - centre[0], q[1] - centre[1], there[0] - here[0],
                there[1] - here[1], there[2] - here[2];
            visit(pixel, likeness(p, x, y, qx, qy), t);
          }
      };
      for_each([&](size_t pixel, double w, const Eigen::VectorXd& t) {
        a += w * t * t.transpose();
        b += w * t * p.f.data[3 * pixel];
      });
      const double ridge = 5e-4 * a(0, 0);
      for (int i = 1; i < 5; ++i) a(i, i) += ridge;
      for (int i = 5; i < 8; ++i) a(i, i) *= 1.001;
      const Eigen::VectorXd plane = a.ldlt().solve(b);
      for_each([&](size_t pixel, double w, const Eigen::VectorXd& t) {
        sum[pixel] += w * plane.dot(t);
        total[pixel] += w;
      });
    }
  for (size_t i = 0; i < sum.size(); ++i) sum[i] /= total[i];
  return sum;
}

TEST(Regression, IsItsFormula) {
  FittedPicture p(62, 50);  // more than one band of rows and one vector of windows, neither a multiple of three
  p.valid[20 * 62 + 30] = 0;
  for (const bool coarse : {false, true}) {
    const Image image = p.regressed({&p.f}, coarse)[0];
    const std::vector<double> expected = by_formula(p, coarse ? 4 : 3);
    for (size_t i = 0; i < expected.size(); ++i) ASSERT_NEAR(image.data[3 * i], expected[i], 2e-4) << i;
  }
}

TEST(Regression, KeepsTextureThatFeaturesOrPositionsShow) {
  FittedPicture p(60, 45);
  p.other = nl_means(std::vector<NlMeansSteering>{{&p.f, &p.s, {{0.5f, {&p.f}}}}}, nullptr, p.valid)[0];
  const Image* const features[] = {&p.feature};
  const Image image = covary::regressed({&p.f, &p.s, {&p.f}, {&p.other}}, features, p.valid)[0];
  const auto error = [&](const Image& of) {
    double sum = 0;
    for (int y = 0; y < 45; ++y)
      for (int x = 0; x < 60; ++x)
        for (int c = 0; c < 3; ++c) sum += std::pow(of.pixel(x, y)[c] - p.expected(x, y, c), 2);
    return sum;
  };
  EXPECT_LT(error(image), 0.5 * error(p.other));
  EXPECT_LT(error(image), 0.5 * error(p.f));
  // The same features as a position, in millimetres say.
  for (int y = 0; y < 45; ++y)
    for (int x = 0; x < 60; ++x)
      for (int c : {0, 1, 2}) p.position.pixel(x, y)[c] = 50 + 1000 * (c < 2 ? p.feature.pixel(x, y)[c] : 0);
  const Image by_position = covary::regressed({&p.f, &p.s, {&p.f}, {&p.other}, &p.position}, {}, p.valid)[0];
  EXPECT_LT(error(by_position), 0.5 * error(p.other));
  EXPECT_LT(error(by_position), 0.5 * error(p.f));
}

TEST(Regression, OfWantedRowsIsThatOfAll) {
  const FittedPicture p(30, 100);
  const Image* const features[] = {&p.feature};
  for (const bool coarse : {false, true}) {
    RegressionInput input{&p.f, &p.s, {&p.f}, {&p.other}, nullptr, coarse};
    const Image all = covary::regressed(input, features, p.valid)[0];
    for (const auto& [first, end] : {std::pair{0, 10}, {37, 38}, {20, 90}, {75, 100}, {100, 100}}) {
      input.wanted = {0, first, end};
      const Image rows = covary::regressed(input, features, p.valid)[0];
      for (int y = 0; y < 100; ++y)
        for (int i = 0; i < 3 * 30; ++i)
          ASSERT_EQ(rows.pixel(0, y)[i], y >= first && y < end ? all.pixel(0, y)[i] : 0) << first << " row " << y;
    }
  }
}

TEST(Regression, OfPartsAddsUpToThatOfTheWhole) {
  FittedPicture p(40, 30);
  std::fill(p.other.data.begin(), p.other.data.end(), 0.0f);
  Image rest = p.f;
  for (size_t i = 0; i < rest.data.size(); ++i) rest.data[i] -= p.s.data[i];
  const std::vector<Image> parts = p.regressed({&p.s, &rest}), whole = p.regressed({&p.f});
  ASSERT_EQ(parts.size(), 2u);
  for (size_t i = 0; i < rest.data.size(); ++i)
    ASSERT_NEAR(parts[0].data[i] + parts[1].data[i], whole[0].data[i], 1e-5);
}

TEST(Regression, DoesNotDependOnThreads) {
  const FittedPicture p(70, 60);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const std::vector<float> alone = p.regressed({&p.f})[0].data;
  const tbb::global_control four(tbb::global_control::max_allowed_parallelism, 4);
  EXPECT_EQ(p.regressed({&p.f})[0].data, alone);
}

TEST(Regression, IsTheOtherImageWhereNothingIsAlike) {
  FittedPicture p(20, 20);
  std::fill(p.valid.begin(), p.valid.end(), 0);
  EXPECT_EQ(p.regressed({&p.f})[0].data, p.other.data);
  const FittedPicture one(1, 1);
  for (const float value : one.regressed({&one.f})[0].data) EXPECT_TRUE(std::isfinite(value));
}

}  // namespace
}  // namespace covary
