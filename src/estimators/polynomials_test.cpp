// SPDX-License-Identifier: Apache-2.0
// Polynomial control variates against a slow reference; exactness, degenerate input, noise and bias.
#include "estimators/polynomials.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "core/error.h"
#include "estimators/reference_polynomials.h"
#include "statistics/p_values.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::message_of;

/// The samples of one pixel.
struct Samples {
  std::vector<Spectrum> values;
  std::vector<float> coordinates;
  int dimensions;
  Spectrum estimate() const { return polynomials(values, coordinates, dimensions); }
};

/// Coordinates are multiples of 2^-24, like those of paths.
float uniform(std::mt19937& random) { return static_cast<float>(random() >> 8) * 0x1p-24f; }

template <typename Function>
Samples sample(int n, int dimensions, std::mt19937& random, const Function& f) {
  Samples samples{{}, {}, dimensions};
  for (int s = 0; s < n; ++s) {
    const size_t first = samples.coordinates.size();
    for (int i = 0; i < dimensions; ++i) samples.coordinates.push_back(uniform(random));
    samples.values.push_back(f(samples.coordinates.data() + first));
  }
  return samples;
}

/// Mean and standard deviation of one channel.
std::pair<double, double> mean_of(const std::vector<Spectrum>& values, int channel) {
  statistics::Moments moments;
  for (const Spectrum& v : values) moments.add(v[channel]);
  return {moments.mean(), std::sqrt(moments.variance_of_mean())};
}

TEST(Polynomials, AgreesWithTheReference) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  double largest_correction = 0;
  for (const int d : {1, 2, 3, 4, 5, 6})
    for (const int n : {5, 17, 24, 48, 64, 65, 128, 192, 1000}) {
      if (PolynomialsOptions{d, static_cast<uint32_t>(n)}.n_coefficients() >= n) continue;
      // A trend, many black samples and a long tail, as in real pixels.
      const Samples samples = sample(n, d, random, [&](const float* u) {
        const float v = random() % 4 ? std::exp(2 * normal(random)) : 0;
        return Spectrum(v, 0.1f * v + u[0], 1 + u[0] * u[d - 1] * u[d - 1]);
      });
      const std::array<double, 3> exact = reference::polynomials(samples.values, samples.coordinates, d);
      const Spectrum fast = samples.estimate();
      for (int c = 0; c < 3; ++c) {
        const auto [mean, deviation] = mean_of(samples.values, c);
        EXPECT_NEAR(fast[c], exact[c], 1e-5 * deviation + 1e-6 * std::abs(exact[c])) << "d " << d << ", n " << n;
        largest_correction = std::max(largest_correction, std::abs(exact[c] - mean) / deviation);
      }
    }
  EXPECT_GT(largest_correction, 1) << "the cases are too easy: the mean alone would pass";
}

TEST(Polynomials, IntegratesPolynomialsOfDegreeTwoExactly) {
  std::mt19937 random(2);
  for (const int d : {1, 2, 4, 6}) {
    const std::vector<std::vector<int>> terms = reference::monomials(d);
    std::vector<Spectrum> coefficients;
    Spectrum expected(3, 3, 3);
    for (const std::vector<int>& term : terms) {
      coefficients.emplace_back(uniform(random) - 0.5f, uniform(random), -uniform(random));
      expected += coefficients.back() * static_cast<float>(reference::integral(term));
    }
    const auto f = [&](const float* u) {
      Spectrum value(3, 3, 3);
      for (size_t i = 0; i < terms.size(); ++i)
        value += coefficients[i] * static_cast<float>(reference::monomial(terms[i], u));
      return value;
    };
    for (const int n : {static_cast<int>(terms.size()) + 2, 200}) {
      const Samples samples = sample(n, d, random, f);
      // Values have 24 bits; with one sample more than coefficients, their rounding is amplified.
      const double tolerance = n == 200 ? 1e-6 : 1e-3;
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(samples.estimate()[c], expected[c], tolerance) << "d " << d << ", n " << n;
    }
    // Planted bug: a polynomial of one degree more is not integrated exactly.
    const Samples cubic = sample(200, d, random, [&](const float* u) { return f(u) + Spectrum(u[0] * u[0] * u[0]); });
    EXPECT_GT(std::abs(cubic.estimate().r - expected.r - 0.25), 1e-5);
  }
}

TEST(Polynomials, EqualValuesScalesAndChannels) {
  std::mt19937 random(3);
  const auto constant = [](const float*) { return Spectrum(0.1f, 0, 7e8f); };
  EXPECT_EQ(sample(48, 4, random, constant).estimate(), Spectrum(0.1f, 0, 7e8f));
  const auto black = [](const float*) { return Spectrum(0); };
  EXPECT_EQ(sample(192, 6, random, black).estimate(), Spectrum(0));

  Samples samples =
      sample(100, 3, random, [&](const float* u) { return Spectrum(u[0], uniform(random), u[1] * u[2]); });
  const Spectrum estimate = samples.estimate();
  for (Spectrum& value : samples.values) value *= 2;
  EXPECT_EQ(samples.estimate(), estimate * 2);
  for (Spectrum& value : samples.values) value = {value.b, value.r, value.g};
  EXPECT_EQ(samples.estimate(), Spectrum(2 * estimate.b, 2 * estimate.r, 2 * estimate.g));
}

TEST(Polynomials, CoordinatesThatDetermineNothingLeaveTheMean) {
  std::mt19937 random(4);
  const auto f = [&](const float* u) { return Spectrum(u[0] + uniform(random)); };
  const auto expect_mean = [](const Samples& samples) {
    EXPECT_NEAR(samples.estimate().r, mean_of(samples.values, 0).first, 1e-6);
  };
  Samples samples = sample(60, 3, random, f);
  for (int s = 0; s < 60; ++s) samples.coordinates[3 * s + 2] = 0.25f;  // one number is constant
  expect_mean(samples);
  samples = sample(60, 3, random, f);
  for (int s = 0; s < 60; ++s) samples.coordinates[3 * s + 1] = samples.coordinates[3 * s];  // two are equal
  expect_mean(samples);
  samples = sample(60, 3, random, f);
  for (int i = 0; i < 180; ++i)
    samples.coordinates[i] = samples.coordinates[i % 27];  // nine points for ten coefficients
  expect_mean(samples);
  samples = sample(60, 3, random, f);
  std::fill(samples.coordinates.begin(), samples.coordinates.end(), 0.0f);
  expect_mean(samples);
}

TEST(Polynomials, ReportsWrongSizes) {
  const auto message = [](int n, int n_coordinates, int d) {
    return message_of(
        [&] { polynomials(std::vector<Spectrum>(n), std::vector<float>(static_cast<size_t>(n_coordinates)), d); });
  };
  EXPECT_EQ(
      message(15, 60, 4),
      "polynomials: 15 samples per pixel are too few to fit the 15 coefficients of 4 dimensions, expected at least 16");
  EXPECT_EQ(message(100, 0, 0), "polynomials: dimensions is 0, expected 1 to 6");
  EXPECT_EQ(message(100, 700, 7), "polynomials: dimensions is 7, expected 1 to 6");
  EXPECT_EQ(message(100, 300, 2), "polynomials: 300 coordinates for 100 samples, expected 2 of each");
}

// ---- noise and bias -------------------------------------------------------------------------------------------------

constexpr int kD = 4;

double smooth(const double* u) { return std::exp(u[0] - 0.5 * u[1]) + u[0] * u[2] * u[3] + std::cos(2 * u[3]); }

/// Orthonormal polynomials of degree 1 and 2 in kD dimensions.
std::vector<double> legendre(const double* u) {
  std::vector<double> b;
  for (int i = 0; i < kD; ++i) {
    const double x = 2 * u[i] - 1;
    b.push_back(std::sqrt(3.0) * x);
    b.push_back(std::sqrt(5.0) * (1.5 * x * x - 0.5));
    for (int j = 0; j < i; ++j) b.push_back(3 * x * (2 * u[j] - 1));
  }
  return b;
}

/// Theoretical properties of the estimator for smooth(), by quadrature.
struct Theory {
  double integral = 0, variance = 0, residual_variance = 0;
  double bias_times_n = 0;  ///< asymptotically: -E[r |b|^2], r: residual of the best fit, b: the basis
};

Theory theory() {
  // Gauss-Legendre, 5 points: exact up to degree 9 in each coordinate.
  const double a = std::sqrt(5 - 2 * std::sqrt(10.0 / 7)) / 3, b = std::sqrt(5 + 2 * std::sqrt(10.0 / 7)) / 3;
  const double wa = (322 + 13 * std::sqrt(70.0)) / 1800, wb = (322 - 13 * std::sqrt(70.0)) / 1800;
  const double nodes[5] = {(1 - b) / 2, (1 - a) / 2, 0.5, (1 + a) / 2, (1 + b) / 2};
  const double weights[5] = {wb, wa, 64.0 / 225, wa, wb};
  const auto integrate = [&](const auto& f) {
    double sum = 0;
    for (int i = 0; i < 625; ++i) {
      const int k[kD] = {i % 5, i / 5 % 5, i / 25 % 5, i / 125};
      const double u[kD] = {nodes[k[0]], nodes[k[1]], nodes[k[2]], nodes[k[3]]};
      sum += weights[k[0]] * weights[k[1]] * weights[k[2]] * weights[k[3]] * f(u);
    }
    return sum;
  };
  Theory t;
  t.integral = integrate(smooth);
  const size_t n_terms = 14;
  std::vector<double> coefficients;
  for (size_t i = 0; i < n_terms; ++i)
    coefficients.push_back(integrate([&](const double* u) { return smooth(u) * legendre(u)[i]; }));
  const auto residual = [&](const double* u) {
    const std::vector<double> basis = legendre(u);
    double r = smooth(u) - t.integral;
    for (size_t i = 0; i < n_terms; ++i) r -= coefficients[i] * basis[i];
    return r;
  };
  t.variance = integrate([&](const double* u) { return std::pow(smooth(u) - t.integral, 2); });
  t.residual_variance = integrate([&](const double* u) { return std::pow(residual(u), 2); });
  t.bias_times_n = integrate([&](const double* u) {
    double squares = 0;
    for (double value : legendre(u)) squares -= value * value;
    return residual(u) * squares;
  });
  return t;
}

/// K pixels of n samples each. A `scale` other than 1 plants a bug: the coordinates are not those that made the
/// samples.
statistics::Moments many_pixels(int n, int k, float scale) {
  std::mt19937 random(5);
  statistics::Moments moments;
  for (int i = 0; i < k; ++i) {
    Samples samples = sample(n, kD, random, [](const float* u) {
      const double exact[kD] = {u[0], u[1], u[2], u[3]};
      return Spectrum(static_cast<float>(smooth(exact)));
    });
    for (float& u : samples.coordinates) u *= scale;
    moments.add(samples.estimate().r);
  }
  return moments;
}

// N = 8000 pixels of 192 samples, alpha = 5e-7. The smallest bias detected with power 0.99 is asserted below to be less
// than 1 % of the standard deviation of the plain mean; the planted bug shifts the estimate by more.
TEST(Polynomials, NoiseFallsAndTheBiasIsWhatTheorySays) {
  constexpr int kSamples = 192, kPixels = 8000;
  const Theory t = theory();
  const double plain = std::sqrt(t.variance / kSamples);
  const statistics::Moments moments = many_pixels(kSamples, kPixels, 1);

  // The variance of the mean residual is the lower bound; fitting 15 coefficients adds about a tenth, and more if
  // residuals are large far from the centre.
  const double least = t.residual_variance / kSamples;
  EXPECT_GT(moments.sample_variance(), 0.95 * least);
  EXPECT_LT(moments.sample_variance(), 1.3 * least);
  EXPECT_LT(moments.sample_variance(), 0.02 * t.variance / kSamples);

  EXPECT_LT(
      statistics::smallest_detectable(std::sqrt(moments.sample_variance()), kPixels, statistics::test_alpha(), 0.99),
      0.01 * plain);
  // Terms of order 1 / n^2 are at most a fraction 2 * 15 / n of the first.
  const double bias = t.bias_times_n / kSamples, slack = std::abs(bias) * 30 / kSamples;
  const statistics::TestResult right = statistics::z_test(moments.mean(), moments.variance_of_mean(), t.integral + bias,
                                                          statistics::test_alpha(), slack);
  EXPECT_TRUE(right.accepted) << right.message;
  const statistics::Moments wrong = many_pixels(kSamples, kPixels, 0.99f);
  EXPECT_FALSE(
      statistics::z_test(wrong.mean(), wrong.variance_of_mean(), t.integral + bias, statistics::test_alpha(), slack)
          .accepted);
}

}  // namespace
}  // namespace covary
