// SPDX-License-Identifier: Apache-2.0
// How many samples each pixel of an image gets, from the means C and variances sigma^2 of a first pass over it.
//
//   equal-error   all pixels the same relative error eps, [Csonka2002] Sec. 5: N = (3 sigma / (eps |C|))^2 - n, n being
//                 the samples of the first pass. Dark and noisy pixels take nearly everything.
//   least-error   towards the least sum of squared relative errors for a number of samples, which would be N in
//                 proportion to e = sigma / sqrt(|C|^2 + 0.01). As e is known from few samples, whose errors are
//                 common to neighbours, and C is dark where sigma is missed: N in proportion to sqrt(e), with |C| and
//                 sigma^2 averaged over neighbours, at least 0.7 and at most twice its mean.
//   denoised      where the first pass becomes a denoised image: towards its least relMSE per ray (ours). A filter that
//                 averages alike around p and q has var M_p = d var h_p, and d is q's part in all errors, too, so that
//                 N in proportion to sqrt(N_1 var M / ((M^2 + 0.01) c)) is best, with N_1 of the first pass and the
//                 cost c of a sample. The image's squared error, its bias included, takes the variance's place,
//                 averaged over 15 x 15 pixels; at least a half and at most four times the mean of N.
//   uniform       all pixels the same; what is left of the budget is spread, but not where numbers are rounded to
//                 classes: there all are equal, and no class is needed.
//
// With a relative error, `equal-error` has it in every pixel, and the others on average: the root of the mean of
// (3 sigma)^2 / (N (|C|^2 + 0.01)) is eps. Without, or where that needs more than the budget, the one free factor is
// found such that the numbers add up to the budget. Numbers are rounded up before: to whole ones, or to classes 0, 1,
// 10, 20, 50, 100, 200, 500, … (the paper has "a few categories, e.g. 1, 10, 20, 50, 100, etc.").
//
// Pixels that are not finite are treated as having no noise.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "film/grouped_image.h"
#include "settings/settings.h"

namespace covary {

enum class Allocation { kEqualError, kLeastError, kUniform, kDenoised };

struct CountOptions {
  Allocation allocation = Allocation::kLeastError;
  std::optional<float> relative_error;  ///< eps > 0
  int min_spp = 1;                      ///< samples that each pixel gets at least, >= 0
  std::optional<int> max_spp;           ///< and at most, >= min_spp and 1; default: no limit
  bool classes = false;                 ///< round up to classes
  bool first_pass_counts = true;        ///< its samples are part of the image
  /// Numbers are shared out together with the first pass's samples, so that pixels get what they lack.
  bool tops_up = false;
  /// Side of the window over which sigma^2, and |C| of kLeastError, are averaged, odd, 1 … 63.
  int smoothing = 7;

  /// Everything that is wrong with the options; empty if nothing is. Numbers are to be multiples of `multiple`.
  std::vector<std::string> validate(uint32_t multiple = 1) const;
};

/// The number for each pixel, row by row. `budget`: of samples per pixel on average, >= 0; infinite for no limit, which
/// needs a relative error. Numbers are multiples of `multiple` >= 1. They add up to the budget to 1 %, unless min_spp,
/// max_spp or `multiple` do not allow it, for `uniform` with classes, and where no pixel has noise: `least-error` then
/// gives all the same, and `equal-error` min_spp. Throws Error(kUsage) for options that are wrong.
/// `filtered`: for kDenoised, the squared relative error of the denoised image at each pixel, over the cost of a
/// sample there.
std::vector<uint32_t> sample_counts(const GroupedImage& first_pass, double budget, const CountOptions& options,
                                    uint32_t multiple = 1, std::span<const double> filtered = {});

/// Whether every pixel has as many samples as the relative error asks for, whatever budget and max_spp are. True
/// without a relative error.
bool have_relative_error(const GroupedImage& first_pass, const std::vector<uint32_t>& counts,
                         const CountOptions& options, uint32_t multiple = 1);

/// The smallest class that is at least `samples`.
uint32_t class_of(double samples);

/// Of estimators whose last pass has as many samples in each pixel as an earlier one says. A pair's CRN pass tells;
/// otherwise a pilot, an independent pass that is not part of the image, so that the mean stays unbiased.
struct AdaptiveSampling {
  CountOptions counts;
  bool names_allocation = false;  ///< counts.allocation was asked for
  std::optional<int> first_spp;   ///< of the first pass, >= 1; default: half of the budget, at most most_first_spp
  int most_first_spp = 50;
  int least_min_spp = 0;      ///< smallest value of counts.min_spp that the estimator takes
  bool reads_groups = false;  ///< the estimator needs means of groups, not only the variance of samples

  std::vector<std::string> validate() const;
};

/// Options that only say how passes are rendered.
inline constexpr const char* kAdaptiveOptions[] = {"adaptive",       "dependent-spp", "allocation",
                                                   "relative-error", "min-spp",       "max-spp"};
/// Asks for these but the first.
void ask_for(Settings& parameters, AdaptiveSampling& sampling);
/// Asks for all of these, with `standard` for defaults and the help of --adaptive; nothing where that is not given.
/// Appends what is wrong with them to `problems`.
std::optional<AdaptiveSampling> ask_for_adaptive(Settings& parameters, AdaptiveSampling standard,
                                                 const std::string& help, std::vector<std::string>& problems);

}  // namespace covary
