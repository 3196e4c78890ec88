// SPDX-License-Identifier: Apache-2.0
// Dependent tests driven filtering. F. Csonka, L. Szirmay-Kalos, C. Kelemen, G. Antal, Eurographics 2002 [Csonka2002].
//
// Two images of one scene: in the CRN image ("dependent tests") all pixels share their random numbers, so that
// differences between its pixels have little noise; in the independent image each pixel has its own N samples, where N
// is chosen from the first image (sample_counts.h). The independent image is filtered over pixels that are similar in
// the CRN image, with weights that balance noise against distortion; the result is averaged with the CRN image.
//
// The defaults extend the paper: weights that exactly minimise the error bound over a large window
// (bound_filter.h), sigma from both passes and averaged over neighbours, a combination by measured errors instead of
// numbers of samples (least_error_mixture.h), and differences scaled up where the CRN image is darker than the
// independent one because too few of its samples found the light. DependentTestsOptions::paper() has none of them.
//
// Consistent with Filter::kExact; biased for any number of samples: the filter distorts, and numbers of samples chosen
// from an image that is part of the average favour its low values.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "dependent_tests/bound_filter.h"
#include "dependent_tests/region_filter.h"
#include "estimators/estimator_result.h"
#include "estimators/sample_counts.h"
#include "film/grouped_image.h"
#include "filters/filter_input.h"

namespace covary {

class Settings;
struct Method;

enum class DependentFilter {
  kPaper,  ///< region_filter.h
  kExact,  ///< bound_filter.h
};
enum class CombinationWeights {
  kCounts,     ///< n : N, the samples of the pixel in both images, [Csonka2002] Sec. 5
  kEffective,  ///< n : N_eff, the effective number of samples of the filtered mean
  /// By least error, measured with the independent samples, least_error_mixture.h: of C_d, C_i, the filtered image and,
  /// with kExact, the one filtered over 3 x 3 pixels.
  kMeasured,
};

struct DependentTestsOptions {
  DependentFilter filter = DependentFilter::kExact;
  RegionOptions regions;  ///< of kPaper
  int window = 7;         ///< of kExact: side of the square around a pixel, odd, 3 … 63
  CombinationWeights weights = CombinationWeights::kMeasured;
  VarianceSource variance = VarianceSource::kBoth;
  Norm norm = Norm::kSum;  ///< with kExact always kSum
  int smoothing = 7;       ///< side of the window over which sigma^2 is averaged, odd, 1 … 63
  /// Side of the window over which the brightness of the two images is compared, odd, 1 … 63; 0: no comparison. Only
  /// for kExact. Differences Delta are multiplied by the ratio where the independent image is brighter.
  int guard = 15;
  /// Side of the window over which kMeasured measures errors, odd, 3 … 63.
  int measure_window = 31;

  /// The published estimator with its published settings.
  static DependentTestsOptions paper();
};

/// Where the filters run, such as on a GPU (gpu/dependent_filters.h); otherwise here.
struct DependentFilters {
  std::function<FilteredImage(const FilterInput&, const RegionOptions&)> region = region_filter;
  std::function<FilteredImage(const FilterInput&, int window, const Planes* difference_scale)> bound = bound_filter;
};

/// Intermediate results of dependent_tests(): the images of [Csonka2002] Fig. 2 (`dependent`, `independent`,
/// `filtered`, `combined`) and, with one channel each, `samples` of the independent image, number of pixels in the
/// `region`, `centre_weight` and error `bound`, which is infinite where no pixel has samples.
using DependentTestsStages = std::map<std::string, Image>;

/// Pixels may have any number of samples in either image; with none in the independent one, the result is that of the
/// CRN image. `stages`: may be null. Throws Error(kUsage) listing every problem with the inputs: both images
/// must have the same size, and the CRN image two groups or the variance of its samples. Bit-identical for any number
/// of threads.
EstimatorResult dependent_tests(const GroupedImage& crn, const GroupedImage& independent,
                                const DependentTestsOptions& options = {}, DependentTestsStages* stages = nullptr,
                                const DependentFilters& filters = {});

/// Radius of influence of the input on a pixel, in rows or columns.
int dependent_tests_halo(const DependentTestsOptions& options);

/// Approximate memory of dependent_tests() beyond its input, including its result: bytes per pixel.
inline constexpr double kDependentTestsBytesPerPixel = 4.0 * (3 + 3 + 2 + 2 + 7 + 4 + 7 + 3 + 6 + 1) + 24;
/// Without stages, large images are processed in bands of rows, with the bits of the whole: at most this many bytes
/// beyond input and result, unless 64 rows and their surroundings need more.
inline constexpr double kDependentTestsBand = 48e6;

/// The options of make_dependent_tests(), declared to `settings`. Throws Error(kUsage) likewise.
struct DeclaredDependentTests {
  DependentTestsOptions filter;
  AdaptiveSampling adaptive;
};
DeclaredDependentTests declare_dependent_tests(Settings& settings);

inline constexpr const char* kDependentTests = "dependent-tests";
/// Whether an option of an estimator only affects how passes are rendered: kAdaptiveOptions, and `allocation` of this.
bool is_adaptive_option(const std::string& name);
/// The estimator `dependent-tests` with these options. Throws Error(kUsage) listing everything wrong with them.
Method make_dependent_tests(Settings& options);

}  // namespace covary
