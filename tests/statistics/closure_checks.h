// SPDX-License-Identifier: Apache-2.0
// Everything that can be checked about a reflectance model without knowing it: that it draws from the density it
// claims, lobe by lobe, and that value, weight and density of a sample fit together.
#pragma once

#include <string>
#include <vector>

#include "scene/bsdf.h"
#include "statistics/chi2.h"

namespace covary::statistics {

/// Checks `closure` for one outgoing direction and returns the messages of all failures (none: it passed).
///   1. the probabilities of the lobes do not sum to more than 1;
///   2. for samples: eval() gives the density and value * 1 / density the sample promised; the density is
///      sum_l pmf_l pdf_l; a lobe's flags are among the closure's;
///   3. chi-square of the mixture (delta lobes left out), and of each smooth lobe against pmf_l pdf_l;
///   4. binomial test of the probability of each delta lobe.
/// `options.alpha` holds for each of the statistical comparisons. `value_tolerance` is relative, for item 2.
std::vector<std::string> check_closure(const BsdfClosure& closure, const Vec3& wo, const Chi2Options& options,
                                       double value_tolerance = 2e-3);

/// The sum of `messages`, one a line, for GoogleTest's EXPECT_EQ(join(check_closure(...)), "").
inline std::string join(const std::vector<std::string>& messages) {
  std::string text;
  for (const std::string& m : messages) text += m + "\n";
  return text;
}

/// Directional albedo: integral of value over all wi of smooth lobes by quadrature, per channel, with an absolute
/// tolerance of about 1e-4.
Spectrum smooth_albedo(const BsdfClosure& closure, const Vec3& wo);
/// The same, delta lobes included, as the mean weight of `n` samples; `variance_of_mean` is that of the green channel.
Spectrum sampled_albedo(const BsdfClosure& closure, const Vec3& wo, int n, uint64_t seed, double* variance_of_mean);

}  // namespace covary::statistics
