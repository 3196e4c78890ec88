// SPDX-License-Identifier: Apache-2.0
// Number of samples for each pixel, from the means C and variances sigma^2 of a first pass: adaptive sampling
// [Mitchell1987], biased if the first samples stay in the image [KirkArvo1991].
//
//   equal-error   the same relative error eps in all pixels, [Csonka2002] Sec. 5: N = (3 sigma / (eps |C|))^2 - n with
//                 the samples n of the first pass. Dark and noisy pixels take nearly everything.
//   least-error   towards the least sum of squared relative errors for a given number of samples, for which N would be
//                 proportional to e = sigma / sqrt(|C|^2 + 0.01). But e comes from few samples, whose errors are common
//                 to neighbours, and C is dark where sigma is missed: so N is proportional to sqrt(e), with |C| and
//                 sigma^2 averaged over neighbours, and at least 0.7 and at most twice its mean.
//   denoised      if the first pass becomes a denoised image: towards its least relMSE per ray. A filter that
//                 averages p and q in the same way has var M_p = d var h_p, where d is also q's part in all errors, so
//                 that the optimal N is proportional to sqrt(N_1 var M / ((M^2 + 0.01) c)), with N_1 of the first pass
//                 and the cost c of a sample. The image's squared error, including bias, replaces the variance,
//                 averaged over 15 x 15 pixels; at least half and at most four times the mean of N. [Firmino2023] have
//                 the same aim, with derivatives of the network.
//   variance      N proportional to sigma^2 / |C|, [Csonka2002] Sec. 3, which does not give the equal relative error
//                 that the section wants.
//   uniform       the same in all pixels; the remainder of the budget is spread, except when rounding to classes: then
//                 all are equal, and no class is needed.
//
// With a relative error, `equal-error` reaches it in every pixel, and the others on average: the root mean square of 3
// sigma / sqrt(N (|C|^2 + 0.01)) is eps. Without one, or if it needs more than the budget, the one free factor is set
// so that the numbers sum to the budget, after rounding up to integers or to the classes 0, 1, 10, 20, 50, 100, 200,
// 500, … (the paper has "a few categories, e.g. 1, 10, 20, 50, 100, etc.").
//
// Non-finite pixels are treated as noise-free.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "film/grouped_image.h"
#include "filters/norm.h"
#include "settings/settings.h"

namespace covary {

enum class Allocation { kEqualError, kVariance, kMinError, kUniform, kDenoised };

struct CountOptions {
  Allocation allocation = Allocation::kMinError;
  std::optional<float> relative_error;  ///< eps > 0
  int min_spp = 1;                      ///< minimum per pixel, >= 0
  std::optional<int> max_spp;           ///< maximum per pixel, >= min_spp and 1; default: no limit
  bool classes = false;                 ///< round up to classes
  bool first_pass_counts = true;        ///< the first pass is part of the image
  /// Allocate the sum including the first pass's samples, so that pixels get what they lack.
  bool tops_up = false;
  Norm norm = Norm::kSum;  ///< of colours, for kEqualError and kVariance
  /// Side of the window over which sigma^2 and, except for kEqualError and kVariance, |C| are averaged, odd, 1 … 63.
  int smoothing = 7;

  /// Throws Error(kUsage) if no multiple of `multiple` is at most max_spp and at least min_spp, and for a relative
  /// error with kVariance, which has none.
  void check_limits(uint32_t multiple) const;
};

/// Number of samples per pixel, row by row. `budget`: mean samples per pixel, >= 0; infinite for no limit, which
/// requires a relative error. Numbers are multiples of `multiple` >= 1. They sum to the budget to within 1 %, unless
/// min_spp, max_spp or `multiple` prevent it, for `uniform` with classes, and if no pixel has noise: `least-error` then
/// gives all pixels the same number, and `equal-error` min_spp. Throws Error(kUsage) for invalid options.
/// `filtered`: for kDenoised, the squared relative error of the denoised image at each pixel, over the cost of a sample
/// there.
std::vector<uint32_t> sample_counts(const GroupedImage& first_pass, double budget, const CountOptions& options,
                                    uint32_t multiple = 1, std::span<const double> filtered = {});

/// Whether every pixel has as many samples as the relative error requires, ignoring budget and max_spp. True without a
/// relative error.
bool have_relative_error(const GroupedImage& first_pass, const std::vector<uint32_t>& counts,
                         const CountOptions& options, uint32_t multiple = 1);

/// The smallest class that is at least `samples`.
uint32_t class_of(double samples);

/// For estimators whose last pass has per-pixel numbers of samples chosen from an earlier one: of a pair, the CRN pass;
/// otherwise a pilot, an independent pass that is not part of the image, so that the mean stays unbiased.
struct AdaptiveSampling {
  CountOptions counts;
  std::optional<int> first_spp;  ///< of the first pass, >= 1; default: half of the budget, at most max_first_spp
  int max_first_spp = 50;
  bool reads_groups = false;  ///< the estimator needs group means, not only the sample variance
};

/// Options that only affect how passes are rendered.
inline constexpr const char* kAdaptiveOptions[] = {"adaptive", "dependent-spp", "max-spp"};
/// Declares all of these but the first.
void ask_for(Settings& parameters, AdaptiveSampling& sampling);
/// Declares all of these, with the defaults `standard` and the help of --adaptive; returns nothing unless that is
/// given.
std::optional<AdaptiveSampling> ask_for_adaptive(Settings& parameters, AdaptiveSampling standard,
                                                 const std::string& help);

}  // namespace covary
