// SPDX-License-Identifier: Apache-2.0
// Mixtures of images: coefficients against explicit sums and solutions, and images with known errors.
#include "dependent_tests/least_error_mixture.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "estimators/test_images.h"

namespace covary::least_error_mixture_test {
namespace {

constexpr int kWidth = 60, kHeight = 50;

/// A constant image with noise of standard deviation `noise` in each channel.
struct Scene {
  FilterInput input;
  Planes noise = Planes(kWidth, kHeight, 1, 0, 0);
  std::vector<unsigned char> valid = std::vector<unsigned char>(kWidth * kHeight, 1);

  explicit Scene(double deviation) {
    input.independent = Planes(kWidth, kHeight, 3, 0, 0);
    input.count = Planes(kWidth, kHeight, 1, 0, 8);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        for (int c = 0; c < 3; ++c) input.independent.row(c, y)[x] = 1 + random(1, x, y, c, deviation);
        noise.row(0, y)[x] = static_cast<float>(3 * deviation * deviation);
      }
  }
  /// Uniform with standard deviation `deviation`.
  static float random(uint64_t seed, int x, int y, int c, double deviation) {
    const double uniform = test::noise(seed, static_cast<uint64_t>(y * kWidth + x), static_cast<uint64_t>(c));
    return static_cast<float>(uniform * std::sqrt(12.0) * deviation);
  }
  Image mix(const std::vector<MixtureCandidate>& candidates, int window) const {
    return least_error_mixture(input, noise, valid, candidates, window);
  }
};

Image noisy(uint64_t seed, double value, double deviation) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] = static_cast<float>(value) + Scene::random(seed, x, y, c, deviation);
  return image;
}

double mean_square_error(const Image& image) {
  double sum = 0;
  for (const float value : image.data) sum += std::pow(value - 1.0, 2);
  return sum / static_cast<double>(image.data.size());
}

/// Minimises x'Ax / 2 - b'x over x >= 0, sum x <= 1, among the solutions for all sets of nonzero weights, with their
/// sum free or equal to 1.
Eigen::Vector3d least_over_simplex(const Eigen::Matrix3d& A, const Eigen::Vector3d& b) {
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  for (int set = 1; set < 16; ++set) {
    Eigen::Matrix4d system = Eigen::Matrix4d::Identity();  // the last row: the Lagrange multiplier of the sum
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (int j = 0; j < 3; ++j) {
      if (!(set >> j & 1)) continue;
      for (int k = 0; k < 3; ++k) system(j, k) = set >> k & 1 ? A(j, k) : 0;
      right[j] = b[j];
      if (set & 8) system(j, 3) = system(3, j) = 1;
    }
    if (set & 8) system(3, 3) = 0, right[3] = 1;
    const Eigen::Vector3d x = system.fullPivLu().solve(right).head<3>();
    const auto value = [&](const Eigen::Vector3d& at) { return 0.5 * at.dot(A * at) - b.dot(at); };
    if (x.minCoeff() > -1e-9 && x.sum() < 1 + 1e-9 && value(x) < value(best)) best = x;
  }
  return best;
}

TEST(LeastErrorMixture, EqualsTheSolutionWrittenOut) {
  Scene scene(0.3);
  const Image a = noisy(2, 0.9, 0.3), b = noisy(3, 1.1, 0.2), c = noisy(4, 1, 0.4);
  Image own(kWidth, kHeight, 1);
  for (size_t i = 0; i < own.data.size(); ++i) own.data[i] = static_cast<float>(i % 7) / 10;
  scene.valid[9 * kWidth + 12] = 0;
  scene.input.count.row(0, 20)[21] = 0;
  const std::vector<MixtureCandidate> candidates = {{&a, nullptr}, {&b, &own}, {&c, nullptr}};
  const Image result = scene.mix(candidates, 5);
  const auto h = [&](int x, int y, int k) { return double{scene.input.independent.row(k, y)[x]}; };
  const auto used = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < kWidth && y < kHeight && !(x == 12 && y == 9) && !(x == 21 && y == 20);
  };
  for (const auto& [px, py] : {std::pair{11, 8}, {0, 0}, {59, 49}, {21, 19}, {40, 31}, {40, 32}}) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (int y = py - 2; y <= py + 2; ++y)
      for (int x = px - 2; x <= px + 2; ++x) {
        if (!used(x, y)) continue;
        double brightness = 0, n = 0;
        for (int qy = y - 3; qy <= y + 3; ++qy)
          for (int qx = x - 3; qx <= x + 3; ++qx)
            if (used(qx, qy)) brightness += (h(qx, qy, 0) + h(qx, qy, 1) + h(qx, qy, 2)) / 3, ++n;
        const double weight = 1 / (std::pow(brightness / n, 2) + 0.01);
        for (int j = 0; j < 3; ++j) {
          for (int k = 0; k < 3; ++k)
            for (int i = 0; i < 3; ++i)
              A(j, k) += weight * (candidates[j].colour->pixel(x, y)[i] - h(x, y, i)) *
                         (candidates[k].colour->pixel(x, y)[i] - h(x, y, i));
          const double own_weight = j == 1 ? own.pixel(x, y)[0] : 0;
          right[j] += weight * scene.noise.row(0, y)[x] * (1 - own_weight);
        }
      }
    A += 1e-3 * A.trace() / 3 * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d solution = least_over_simplex(A, right);
    for (int i = 0; i < 3; ++i) {
      double expected = h(px, py, i);
      for (int j = 0; j < 3; ++j) expected += solution[j] * (candidates[j].colour->pixel(px, py)[i] - h(px, py, i));
      EXPECT_NEAR(result.pixel(px, py)[i], expected, 1e-4) << px << " " << py;
    }
  }
  EXPECT_EQ(result.pixel(12, 9)[0], scene.input.independent.row(0, 9)[12]) << "left out";
}

/// Combining two images with independent errors of variances v and w gives the minimum error v w / (v + w).
TEST(LeastErrorMixture, WeightsIndependentErrorsByTheirVariance) {
  const Scene scene(0.3);
  const Image other = noisy(5, 1, 0.15);
  const double v = 0.09, w = 0.0225;
  EXPECT_NEAR(mean_square_error(scene.mix({{&other, nullptr}}, 31)), v * w / (v + w), 0.03 * w);
}

/// An error common to all pixels of an image is detected like any other.
TEST(LeastErrorMixture, LeavesAnImageThatIsWrong) {
  const Scene scene(0.1);
  const Image wrong = noisy(6, 1.7, 0.01), right = noisy(7, 1, 0.01);
  EXPECT_NEAR(mean_square_error(scene.mix({{&wrong, nullptr}}, 31)), 0.01, 0.0005);
  EXPECT_LT(mean_square_error(scene.mix({{&wrong, nullptr}, {&right, nullptr}}, 31)), 0.0003);
}

/// An image of which a quarter is the pixel's own samples, the rest as many others: half of each is best.
TEST(LeastErrorMixture, CountsThePixelsOwnSamplesOnce) {
  const Scene scene(0.3);
  const Image other = noisy(8, 1, 0.3);
  Image image(kWidth, kHeight, 3), own(kWidth, kHeight, 1);
  std::fill(own.data.begin(), own.data.end(), 0.25f);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] = 0.25f * scene.input.independent.row(c, y)[x] + 0.75f * other.pixel(x, y)[c];
  EXPECT_NEAR(mean_square_error(scene.mix({{&image, &own}}, 31)), 0.045, 0.002);
  EXPECT_GT(mean_square_error(scene.mix({{&image, nullptr}}, 31)), 0.048) << "too little of its own";
}

/// Left a noisy light, right dark pixels; the candidate is right on the light and leaks into one column beside it.
TEST(LeastErrorMixture, LeaksIntoDarkPixelsBesideALightCount) {
  constexpr int kEdge = 30;
  constexpr float kLight = 10, kDark = 0.05f, kLeak = 0.5f;
  Scene scene(1);
  Image candidate(kWidth, kHeight, 3);
  Planes brightest(kWidth, kHeight, 1, 0, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool lit = x < kEdge;
      for (int c = 0; c < 3; ++c) {
        scene.input.independent.row(c, y)[x] = lit ? kLight + Scene::random(1, x, y, c, 1) : kDark;
        candidate.pixel(x, y)[c] = lit ? kLight : x == kEdge ? kLeak : kDark;
      }
      if (!lit) scene.noise.row(0, y)[x] = 0;
      brightest.row(0, y)[x] = lit ? kLight : x == kEdge ? kLeak : kDark;
    }
  const std::vector<MixtureCandidate> candidates = {{&candidate, nullptr}};
  const auto dark = [&](const Planes* limit) {
    return least_error_mixture(scene.input, scene.noise, scene.valid, candidates, 7, limit).pixel(kEdge, 25)[1];
  };
  EXPECT_GT(dark(nullptr), 0.45f) << "the dark pixels count as bright ones";
  // Three columns of a light of variance 1, and one of a leak: the candidate's weight, a = b / A.
  const double lit = 3 / (kLight * kLight + 0.01), leak = std::pow(kLeak - kDark, 2) / (kLeak * kLeak + 0.01);
  EXPECT_NEAR(dark(&brightest), kDark + (kLeak - kDark) * lit / (lit + leak), 0.03);
}

TEST(LeastErrorMixture, WithoutNoiseOrDifferenceItIsTheImageItself) {
  Scene silent(0.3);
  for (int y = 0; y < kHeight; ++y) std::fill_n(silent.noise.row(0, y), kWidth, 0.0f);
  const Image other = noisy(9, 1, 0.3);
  const Scene scene(0.3);
  Image same(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) same.pixel(x, y)[c] = scene.input.independent.row(c, y)[x];
  EXPECT_EQ(silent.mix({{&other, nullptr}}, 7).data, same.data);
  EXPECT_EQ(scene.mix({{&same, nullptr}}, 7).data, same.data);
  Image far = other;
  far.pixel(30, 30)[1] = 1e25f;
  for (const float value : scene.mix({{&far, nullptr}}, 7).data) EXPECT_TRUE(std::isfinite(value));
}

}  // namespace
}  // namespace covary::least_error_mixture_test
