// SPDX-License-Identifier: Apache-2.0
// The image-space control variates of Yang & Moon 2025 as written in the paper, in double precision, one pixel at a
// time, without regard for speed. Equation numbers are the paper's.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <vector>

#include "film/grouped_image.h"

namespace covary::reference {

struct Pixel {
  int x, y;
};
using Rgb = std::array<double, 3>;
using RgbImage = std::vector<Rgb>;

/// Number of samples in group t.
inline double size(const GroupedImage& image, int x, int y, int t) {
  const double N = image.count(x, y);
  return std::ceil((N - t) / image.groups);
}

inline Rgb mean(const GroupedImage& image, int x, int y, int first = 0, int step = 1) {
  Rgb m{};
  double n = 0;
  for (int t = first; t < image.groups; t += step) {
    n += size(image, x, y, t);
    for (int c = 0; c < 3; ++c) m[c] += size(image, x, y, t) * image.pixel(x, y)[3 * t + c];
  }
  for (double& v : m) v /= n;
  return m;
}

inline Rgb variance_of_mean(const GroupedImage& image, int x, int y, int first = 0, int step = 1) {
  const Rgb m = mean(image, x, y, first, step);
  Rgb v{};
  double samples = 0;
  int n = 0;
  for (int t = first; t < image.groups; t += step, ++n) {
    samples += size(image, x, y, t);
    for (int c = 0; c < 3; ++c) v[c] += size(image, x, y, t) * std::pow(image.pixel(x, y)[3 * t + c] - m[c], 2);
  }
  for (double& s : v) s /= samples * (n - 1.0);
  return v;
}

inline double distance2(const Rgb& a, const Rgb& b) {
  double d = 0;
  for (int c = 0; c < 3; ++c) d += (a[c] - b[c]) * (a[c] - b[c]);
  return d;
}

template <typename Function>
RgbImage map_pixels(const GroupedImage& image, const Function& function) {
  RgbImage result;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) result.push_back(function(x, y));
  return result;
}

/// Cross-bilateral mean of `values` at (x, y), guided by the CRN image: the weights of Eq. (11) times the sample counts
/// of `counted`, if it has any.
inline Rgb guided_mean(const GroupedImage& crn, const RgbImage& values, int window, int x, int y,
                       const GroupedImage& counted = {}) {
  const int r = window / 2;
  const Rgb centre = mean(crn, x, y), variance = variance_of_mean(crn, x, y);
  const double bandwidth = std::max(variance[0] + variance[1] + variance[2], 1e-30);
  Rgb sum{};
  double weights = 0;
  for (int qy = std::max(0, y - r); qy <= std::min(crn.height - 1, y + r); ++qy)
    for (int qx = std::max(0, x - r); qx <= std::min(crn.width - 1, x + r); ++qx) {
      const double count = counted.counts ? counted.count(qx, qy) : 1;
      const double w = count * std::exp(-distance2(mean(crn, qx, qy), centre) / bandwidth);
      weights += w;
      for (int c = 0; c < 3; ++c) sum[c] += w * values[qy * crn.width + qx][c];
    }
  for (double& s : sum) s /= weights;
  return sum;
}

/// Eq. (11) for the mean image `h`, with the sample counts of `counted` if it has any.
inline RgbImage pilot_error(const GroupedImage& crn, const RgbImage& h, int window, const GroupedImage& counted = {}) {
  return map_pixels(crn, [&](int x, int y) {
    Rgb e = guided_mean(crn, h, window, x, y, counted);
    for (int c = 0; c < 3; ++c) e[c] = std::pow(e[c] - h[y * crn.width + x][c], 2);
    return e;
  });
}

/// The light that the CRN image misses (missing_light.h).
inline RgbImage missing_light(const GroupedImage& crn, const GroupedImage& independent) {
  const int r = 5;
  struct Of {
    Rgb g, h, noise_g, noise_h;
  };
  std::vector<Of> of;
  for (int y = 0; y < crn.height; ++y)
    for (int x = 0; x < crn.width; ++x)
      of.push_back(
          {mean(crn, x, y), mean(independent, x, y), variance_of_mean(crn, x, y), variance_of_mean(independent, x, y)});
  const auto sum = [](const Rgb& v) { return v[0] + v[1] + v[2]; };
  return map_pixels(crn, [&](int x, int y) {
    const Of& own = of[static_cast<size_t>(y) * crn.width + x];
    const auto each = [&](const auto& visit) {
      for (int qy = std::max(0, y - r); qy <= std::min(crn.height - 1, y + r); ++qy)
        for (int qx = std::max(0, x - r); qx <= std::min(crn.width - 1, x + r); ++qx)
          visit(of[static_cast<size_t>(qy) * crn.width + qx], independent.counts ? independent.count(qx, qy) : 1.0);
    };
    double n = 0, difference = 0, noise = 0;
    each([&](const Of& q, double) { n += 1, difference += sum(q.h) - sum(q.g), noise += sum(q.noise_h); });
    const double tau2 = std::max(0.0, std::pow(difference / n, 2) - 3 * noise / n / 121) / 48;
    const double bandwidth = std::max(sum(own.noise_g) + tau2, 1e-30);
    Rgb d{};
    double weights = 0, variance = 0, of_pixel = 0;
    each([&](const Of& q, double count) {
      const double w = count * std::exp(-distance2(q.g, own.g) / bandwidth);
      weights += w;
      of_pixel += w * sum(q.noise_h);
      variance += w * w * sum(q.noise_h);
      for (int c = 0; c < 3; ++c) d[c] += w * (q.h[c] - q.g[c]);
    });
    for (double& v : d) v /= weights;
    variance /= weights * weights;
    const double own_noise = sum(own.noise_g), squares = std::max(distance2(d, {0, 0, 0}), 1e-30);
    const double known = std::min(1.0, own_noise / std::max(0.01 * of_pixel / weights, 1e-30));
    const double beyond = std::sqrt(std::max(0.0, 1 - std::max(9 * known, 2.0) * (own_noise + variance) / squares));
    const double part = own_noise > 0 ? (sum(d) > 0 ? beyond : 0) : 1;
    for (double& v : d) v *= part;
    return d;
  });
}

struct Settings {
  bool shared = true, symmetric = true;
  double ridge = 0;             ///< > 0: replaces the errors of h
  double smallest_penalty = 0;  ///< lower bound, relative to the variance of the CRN groups
  double mean_constraint = 0;   ///< weight of the condition sum beta g = f, relative to the noise
  double sample_fraction = 0;   ///< part of the penalty that is the variance of h
};

struct Result {
  Rgb estimate, std_error;
};

/// Eqs. (7), (8), (10) at `target` with the given neighbours. `error_of_h`: squared error of h per pixel. `missing`:
/// missing_light(), or empty.
inline Result control_variates(const GroupedImage& crn, const RgbImage& h, const RgbImage& error_of_h,
                               const RgbImage& variance_of_h, Pixel target, const std::vector<Pixel>& neighbours,
                               const Settings& s, const RgbImage& missing = {}) {
  const int T = crn.groups, k = static_cast<int>(neighbours.size());
  const auto index = [&](Pixel p) { return p.y * crn.width + p.x; };
  std::array<Eigen::MatrixXd, 3> X;
  std::array<Eigen::VectorXd, 3> y;
  for (int c = 0; c < 3; ++c) {
    X[c].resize(T, k);
    y[c].resize(T);
    // Rows scaled to equal variance.
    const auto centred = [&](Pixel p, int t) {
      const double weight = size(crn, p.x, p.y, t) * T / crn.count(p.x, p.y);
      return std::sqrt(weight) * (crn.pixel(p.x, p.y)[3 * t + c] - mean(crn, p.x, p.y)[c]);
    };
    for (int t = 0; t < T; ++t) {
      y[c](t) = centred(target, t);
      for (int i = 0; i < k; ++i) X[c](t, i) = centred(neighbours[i], t);
    }
  }
  // V_h of the groups: a group mean has T times the variance of the mean. Its lower bound is a small fraction of the
  // variance of the CRN groups.
  const auto group_variance = [&](Pixel p, int c) { return T * variance_of_mean(crn, p.x, p.y)[c]; };
  const auto lacks = [&](Pixel p, int c) { return missing.empty() ? 0.0 : missing[index(p)][c]; };
  const auto light = [&](Pixel p, int c) { return mean(crn, p.x, p.y)[c] + lacks(p, c); };
  const auto penalty = [&](int first, int last, double condition) {
    const auto sum = [&](const auto& element) {
      double total = 0;
      for (int c = first; c <= last; ++c) total += element(c);
      return total;
    };
    Eigen::VectorXd V(k);
    double mean_diagonal = 0;
    for (int i = 0; i < k; ++i) {
      const Pixel q = neighbours[i];
      const double groups = sum([&](int c) { return group_variance(q, c); });
      const double own = sum([&](int c) { return T * error_of_h[index(target)][c]; });
      const double error = sum([&](int c) { return T * error_of_h[index(q)][c]; });
      const double variance = sum([&](int c) { return T * variance_of_h[index(q)][c]; });
      const double brightness = sum([&](int c) { return std::pow(light(q, c), 2); });
      V(i) = (1 - s.sample_fraction) * (s.symmetric ? 0.5 * (own + error) : error) + s.sample_fraction * variance;
      V(i) = std::max({V(i), s.smallest_penalty * groups, s.smallest_penalty * condition * brightness});
      mean_diagonal += groups / k;
    }
    if (s.ridge > 0) V.setConstant(s.ridge * mean_diagonal);
    return V;
  };
  // Eq. (10); for shared coefficients, the rows of the channels are stacked.
  std::array<Eigen::VectorXd, 3> beta;
  std::array<double, 3> left;  // 1 - degrees of freedom of the fit / degrees of freedom of the groups
  for (int c = 0; c < (s.shared ? 1 : 3); ++c) {
    const int last = s.shared ? 2 : c;
    // The condition: mean_constraint times the group variance, as a common error in proportion to the brightness.
    double noise = 0, squares = 0;
    for (const Pixel q : neighbours)
      for (int d = c; d <= last; ++d) {
        noise += group_variance(q, d) + T * std::pow(lacks(q, d), 2);
        squares += std::pow(light(q, d), 2);
      }
    const double condition = s.mean_constraint > 0 ? noise / squares : 0;
    Eigen::MatrixXd A = penalty(c, last, condition).asDiagonal();
    Eigen::VectorXd b = Eigen::VectorXd::Zero(k);
    for (int d = c; d <= last; ++d) {
      A += X[d].transpose() * X[d] / (T - 1);
      b += X[d].transpose() * y[d] / (T - 1);
      Eigen::VectorXd g(k);
      for (int i = 0; i < k; ++i) g(i) = light(neighbours[i], d);
      A += s.mean_constraint * condition * g * g.transpose();
      b += s.mean_constraint * condition * g * light(target, d);
    }
    const Eigen::LDLT<Eigen::MatrixXd> factored = A.ldlt();
    beta[c] = factored.solve(b);
    double freedom = 0;
    for (int d = c; d <= last; ++d) freedom += (X[d] * factored.solve(X[d].transpose().eval())).trace() / (T - 1);
    left[c] = std::max(1 - freedom / ((last - c + 1) * (T - 1)), 0.1);
  }
  if (s.shared) {
    beta[1] = beta[2] = beta[0];
    left[1] = left[2] = left[0];
  }

  Result result{mean(crn, target.x, target.y), {}};
  for (int c = 0; c < 3; ++c) {
    // Eq. (8), the residuals by generalised cross-validation.
    double variance = (y[c] - X[c] * beta[c]).squaredNorm() / (T - 1) / T / (left[c] * left[c]);
    double unseen = lacks(target, c);
    for (int i = 0; i < k; ++i) unseen -= beta[c](i) * lacks(neighbours[i], c);
    variance += unseen * unseen;
    double mean_variance = 0;
    for (const Pixel q : neighbours) mean_variance += variance_of_h[index(q)][c] / k;
    for (int i = 0; i < k; ++i) {
      const Pixel q = neighbours[i];
      result.estimate[c] -= beta[c](i) * (mean(crn, q.x, q.y)[c] - h[index(q)][c]);  // Eq. (7)
      variance += beta[c](i) * beta[c](i) *
                  ((1 - s.sample_fraction) * variance_of_h[index(q)][c] + s.sample_fraction * mean_variance);
    }
    result.std_error[c] = std::sqrt(variance);
  }
  return result;
}

}  // namespace covary::reference
