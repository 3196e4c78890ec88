// SPDX-License-Identifier: Apache-2.0
#include "estimators/polynomials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimators/method.h"
#include "film/grouped_image.h"

namespace covary {
namespace {

constexpr int kSize = 32;  // 28 functions in 6 dimensions, 3 channels, and one to fill rows of kLanes
constexpr int kLanes = 8;
constexpr size_t kBlock = 4;  // samples added at once, to reduce loads and stores of the sums
/// Pivots of the normal matrix, relative to the number of samples, are near 1 for many samples. Below this, the
/// coordinates do not determine the coefficients.
constexpr double kSmallestPivot = 1e-10;

/// The basis functions of degree 1 and 2 at one point, orthonormal on [0, 1)^d.
void evaluate_basis(const float* u, int dimensions, double* basis) {
  int n = 0;
  for (int i = 0; i < dimensions; ++i) basis[n++] = std::sqrt(3.0) * (2.0 * u[i] - 1);
  for (int i = 0; i < dimensions; ++i) {
    basis[n++] = std::sqrt(1.25) * (basis[i] * basis[i] - 1);
    for (int j = 0; j < i; ++j) basis[n++] = basis[i] * basis[j];
  }
}

}  // namespace

std::vector<std::string> PolynomialsOptions::validate() const {
  std::vector<std::string> problems;
  if (dimensions < 1 || dimensions > kMaxDimensions)
    problems.push_back(fmt::format("dimensions is {}, expected 1 to {}", dimensions, kMaxDimensions));
  else if (samples <= static_cast<uint32_t>(n_coefficients()))
    problems.push_back(fmt::format(
        "{} samples per pixel are too few to fit the {} coefficients of {} dimensions, expected at least {}", samples,
        n_coefficients(), dimensions, n_coefficients() + 1));
  return problems;
}

Spectrum polynomials(std::span<const Spectrum> values, std::span<const float> coordinates, int dimensions) {
  const PolynomialsOptions options{dimensions, static_cast<uint32_t>(values.size())};
  std::vector<std::string> problems = options.validate();
  if (problems.empty() && coordinates.size() != values.size() * static_cast<size_t>(dimensions))
    problems.push_back(fmt::format("{} coordinates for {} samples, expected {} of each", coordinates.size(),
                                   values.size(), dimensions));
  throw_if_any(kPolynomials, problems);

  const auto n = static_cast<double>(values.size());
  double mean[3] = {0, 0, 0};  // of the values; finally the estimate
  for (const Spectrum& value : values)
    for (int c = 0; c < 3; ++c) mean[c] += value[c];
  for (double& m : mean) m /= n;

  // Inner products over the samples of the basis (constant function last) and of the values minus their mean.
  const int constant = options.n_coefficients() - 1, size = constant + 4;
  static_assert((PolynomialsOptions::kMaxDimensions + 1) * (PolynomialsOptions::kMaxDimensions + 2) / 2 + 3 <= kSize);
  alignas(64) double products[kSize][kSize] = {};
  for (size_t first = 0; first < values.size(); first += kBlock) {
    alignas(64) double v[kBlock][kSize] = {};
    for (size_t s = first; s < std::min(first + kBlock, values.size()); ++s) {
      double* const row = v[s - first];
      evaluate_basis(coordinates.data() + s * dimensions, dimensions, row);
      row[constant] = 1;
      for (int c = 0; c < 3; ++c) row[constant + 1 + c] = values[s][c] - mean[c];
    }
    for (int i = 0; i < size; ++i)
      for (int j = 0; j <= i; j += kLanes)
        for (int lane = j; lane < j + kLanes; ++lane)
          for (size_t b = 0; b < kBlock; ++b) products[i][lane] += v[b][i] * v[b][lane];
  }

  // Least squares by eliminating one function after another. Once only the constant remains, its coefficient is the
  // quotient of its remaining products: the integral of the fit, as all other basis functions integrate to zero.
  const auto determined = [&](int k) { return products[k][k] > kSmallestPivot * n; };
  int k = 0;
  for (; k < constant && determined(k); ++k) {
    double column[kSize];
    for (int i = k + 1; i < size; ++i) column[i] = products[i][k];
    for (int i = k + 1; i < size; ++i) {
      const double factor = column[i] / products[k][k];
      for (int j = k + 1; j <= i; ++j) products[i][j] -= factor * column[j];
    }
  }
  // [Salaun2022]: the mean minus sum beta_i (m_i - M_i).
  if (k == constant && determined(constant))
    for (int c = 0; c < 3; ++c) mean[c] += products[constant + 1 + c][constant] / products[constant][constant];
  return {static_cast<float>(mean[0]), static_cast<float>(mean[1]), static_cast<float>(mean[2])};
}

Method make_polynomials(Settings&) {
  const PolynomialsOptions o;
  PixelPass pass;
  pass.dimensions = o.dimensions;
  pass.film_settings = fmt::format("{} dimensions={}", kPolynomials, o.dimensions);
  pass.pixel = [d = o.dimensions](std::span<const Spectrum> values, std::span<const float> coordinates) {
    return polynomials(values, coordinates, d);
  };
  pass.check_samples = [d = o.dimensions](uint32_t samples) { return PolynomialsOptions{d, samples}.validate(); };
  Method estimator;
  estimator.passes = pass;
  estimator.summary = "for direct light";
  return estimator;
}

}  // namespace covary
