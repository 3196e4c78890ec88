// SPDX-License-Identifier: Apache-2.0
// Chi-square goodness-of-fit tests of samplers against the densities that they claim.
//
// The domain (sphere of directions or unit square) is mapped to the unit square by an equal-area map and split into
// about `n_cells` boxes with equal numbers of samples of a first, independent batch, so that narrow lobes are resolved.
// The density is integrated over each box by adaptive Gauss-Lobatto quadrature; a second batch is counted. Boxes with
// an expected count below 5 are pooled. The fraction of samples that do not fail (and are not left out on purpose, such
// as those of delta lobes) is compared with the total mass of the density.
//
// Smallest errors detected with power 0.99 at alpha = 5e-7 (non-central chi-square distribution), as rms relative error
// of the density over the domain, and as relative error in a single cell:
//     N = 400 000, 128 cells (default)   2.0 %   23 %
//     N = 100 000,  64 cells             3.5 %   28 %
//     N =  40 000,  32 cells             5.0 %   28 %
// and, of the total mass m, 0.0005 (mass_tolerance) + 7.4 sqrt(m (1 - m) / N).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "core/random.h"
#include "core/vec.h"
#include "statistics/p_values.h"

namespace covary::statistics {

struct Chi2Options {
  std::string name = "chi2";  ///< of the case, in messages and files
  int n_samples = 400000;     ///< of the counted batch; more are drawn to place the cells
  int n_cells = 128;          ///< upper bound
  uint64_t seed = 1;
  double alpha = test_alpha();   ///< false-positive probability of this case
  double mass_tolerance = 5e-4;  ///< numerical error allowed in the integral of the density
};

struct Chi2Result {
  bool accepted = false;
  double p_value = 0;
  double statistic = 0;
  int dof = 0;
  double mass = 0;      ///< integral of the density over the domain
  double fraction = 0;  ///< fraction of samples that did not fail
  std::string message = "the test was not run";
};

/// Draws one sample with the random numbers of `random` (use vertex 0 and any events); nullopt if sampling fails.
template <typename Point>
using Sampler = std::function<std::optional<Point>(const PathRandom& random)>;
template <typename Point>
using Density = std::function<double(const Point&)>;

/// Directions; the density is per unit solid angle.
Chi2Result chi2_sphere(const Sampler<Vec3>& sample, const Density<Vec3>& pdf, const Chi2Options& options = {});
/// Points of the unit square [0, 1)^2; the density is per unit area.
Chi2Result chi2_square(const Sampler<Vec2>& sample, const Density<Vec2>& pdf, const Chi2Options& options = {});
/// Indices 0 … probabilities.size() - 1; `observed`: their counts.
Chi2Result chi2_discrete(std::span<const double> observed, std::span<const double> probabilities,
                         const Chi2Options& options = {});

/// Integral of a density over the sphere or the unit square by the tests' quadrature, in `n` x `n` boxes.
double integrate_sphere(const Density<Vec3>& f, double tolerance = 1e-5, int n = 16);
double integrate_square(const Density<Vec2>& f, double tolerance = 1e-5, int n = 16);

/// Equal-area map of the unit square to the sphere and back: x = phi / 2 pi, y = (1 - z) / 2.
Vec3 direction_from_square(double x, double y);

}  // namespace covary::statistics
