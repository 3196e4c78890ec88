// SPDX-License-Identifier: Apache-2.0
// Dependent tests driven filtering. F. Csonka, L. Szirmay-Kalos, C. Kelemen, G. Antal, Eurographics 2002 [Csonka2002].
//
// Two images of one scene: in the CRN image ("dependent tests") all pixels use the same random numbers, so that the
// differences between its pixels have little noise; the independent image has its own samples N in each pixel, numbers
// that follow from the first (sample_counts.h). The independent image is filtered where the CRN image says that pixels
// are alike, by weights that hold the balance between noise and distortion; the result is averaged with the CRN image.
//
// The defaults go beyond the paper, each an option: the weights that really minimise the error bound over a large
// window (bound_filter.h), sigma from both passes and averaged over neighbours, a combination by measured errors
// instead of numbers of samples (least_error_mixture.h), and differences scaled up where the CRN image is darker than
// the independent one, because too few of its samples found the light. DependentTestsOptions::paper() has none of them.
//
// Claim: consistent with Filter::kExact, and biased for any number of samples: the filter distorts, and numbers of
// samples that follow from an image that is averaged in favour its low values.
#pragma once

#include <map>
#include <string>

#include "dependent_tests/bound_filter.h"
#include "dependent_tests/region_filter.h"
#include "estimators/estimator_result.h"
#include "film/grouped_image.h"
#include "filters/filter_input.h"

namespace covary {

class Settings;
struct Estimator;

enum class DependentFilter {
  kPaper,  ///< region_filter.h
  kExact,  ///< bound_filter.h
};
enum class CombinationWeights {
  kCounts,     ///< n : N, the samples of the pixel in both images, [Csonka2002] Sec. 5
  kEffective,  ///< n : N_eff, the samples that the filtered mean is worth
  /// Of the least error that is measured with the independent samples, least_error_mixture.h: of C_d, C_i, the filtered
  /// image and, with kExact, the one filtered over 3 x 3 pixels.
  kMeasured,
};

struct DependentTestsOptions {
  DependentFilter filter = DependentFilter::kExact;
  RegionOptions regions;  ///< of kPaper
  int window = 7;         ///< of kExact: side of the square around a pixel, odd, 3 … 63
  CombinationWeights weights = CombinationWeights::kMeasured;
  VarianceSource variance = VarianceSource::kBoth;
  int smoothing = 7;  ///< side of the window over which sigma^2 is averaged, odd, 1 … 63
  /// Side of the window over which the brightness of both images is compared, odd, 1 … 63; 0: not compared. Only of
  /// kExact. Differences Delta are multiplied by the ratio where the independent image is brighter.
  int guard = 15;
  /// Side of the window over which kMeasured measures errors, odd, 3 … 63.
  int measure_window = 31;

  /// The published estimator with its published settings.
  static DependentTestsOptions paper();
  /// Everything that is wrong with the options; empty if nothing is.
  std::vector<std::string> validate() const;
};

/// What dependent_tests() did: the images of [Csonka2002] Fig. 2 (`dependent`, `independent`, `filtered`, `combined`)
/// and, with one channel each, `samples` of the independent image, pixels of the `region`, `centre_weight` and error
/// `bound`, which is infinite where no pixel has samples.
using DependentTestsStages = std::map<std::string, Image>;

/// Pixels may have any number of samples in either image, none in the independent one: then the result is the CRN
/// image's. `stages`: may be null. Throws Error(kUsage) that lists every problem of options and inputs: both images
/// must have the same size, and the CRN image two groups or the variance of its samples. Bit-identical for any number
/// of threads.
EstimatorResult dependent_tests(const GroupedImage& crn, const GroupedImage& independent,
                                const DependentTestsOptions& options = {}, DependentTestsStages* stages = nullptr);

/// How far from a pixel, in rows or columns, the input can influence it.
int dependent_tests_reach(const DependentTestsOptions& options);

/// Memory that dependent_tests() takes beside its input, its result included: bytes per pixel, about.
inline constexpr double kDependentTestsBytesPerPixel = 4.0 * (3 + 3 + 2 + 2 + 7 + 4 + 7 + 3 + 6) + 24;
/// Without stages, large images are taken in bands of rows, with the bits of the whole: no more than so many bytes
/// beside input and result, where 64 rows and those around them do not need more.
inline constexpr double kDependentTestsBand = 48e6;

/// The estimator `dependent-tests` with these options. Throws Error(kUsage) that lists everything that is wrong with
/// them.
Estimator make_dependent_tests(Settings& options);

}  // namespace covary
