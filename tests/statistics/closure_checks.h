// SPDX-License-Identifier: Apache-2.0
// Checks that hold for every BSDF: each lobe samples from the density that it claims, and the value, weight and density
// of a sample are consistent.
#pragma once

#include <string>
#include <vector>

#include "scene/bsdf.h"
#include "statistics/chi2.h"

namespace covary::statistics {

/// Checks `closure` for one outgoing direction and returns the messages of all failures; empty if it passed.
///   1. the probabilities of the lobes do not sum to more than 1;
///   2. for samples: eval() agrees with the sample's density and weight = value / density; the density is
///      sum_l pmf_l pdf_l; a lobe's flags are among the closure's;
///   3. chi-square test of the mixture (without delta lobes), and of each smooth lobe against pmf_l pdf_l;
///   4. binomial test of the probability of each delta lobe.
/// `options.alpha` applies to each statistical comparison. `value_tolerance` is relative, for item 2.
std::vector<std::string> check_closure(const BsdfClosure& closure, const Vec3& wo, const Chi2Options& options,
                                       double value_tolerance = 2e-3);

/// Concatenates `messages`, one per line, for EXPECT_EQ(join(check_closure(...)), "").
inline std::string join(const std::vector<std::string>& messages) {
  std::string text;
  for (const std::string& m : messages) text += m + "\n";
  return text;
}

/// Directional albedo of the smooth lobes: the integral of value over all wi by quadrature, per channel, with an
/// absolute tolerance of about 1e-4.
Spectrum smooth_albedo(const BsdfClosure& closure, const Vec3& wo);
/// The same including delta lobes, as the mean weight of `n` samples; `variance_of_mean`: of the green channel.
Spectrum sampled_albedo(const BsdfClosure& closure, const Vec3& wo, int n, uint64_t seed, double* variance_of_mean);

}  // namespace covary::statistics
