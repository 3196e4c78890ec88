// SPDX-License-Identifier: Apache-2.0
#include "dependent_tests/dependent_tests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "dependent_tests/least_error_mixture.h"
#include "estimators/control_variates.h"
#include "estimators/method.h"

namespace covary {
namespace {

constexpr const char* kAllocationOption = "allocation";

/// Factors for the differences of the CRN image: if few of its samples found the light, it is too dark, and so are its
/// differences. Ratio of the windows' mean brightness, at least 1; kFar where only the independent image has light.
Planes difference_scale(const FilterInput& input, const std::vector<unsigned char>& valid, int window) {
  const auto brightness = [&](const Planes& colours) {
    Planes planes(input.width(), input.height(), 1, 0, 0);
    parallel_for(input.height(), 8, [&](int y) {
      for (int x = 0; x < input.width(); ++x)
        planes.row(0, y)[x] = colour_length({colours.row(0, y)[x], colours.row(1, y)[x], colours.row(2, y)[x]});
    });
    return planes;
  };
  // Pixels without independent samples have no brightness to compare.
  std::vector<unsigned char> both = valid;
  for (int y = 0; y < input.height(); ++y)
    for (int x = 0; x < input.width(); ++x)
      if (input.count.row(0, y)[x] <= 0) both[static_cast<size_t>(y) * input.width() + x] = 0;
  Planes scale = box_mean(brightness(input.independent), both, window, 0, 1);
  const Planes dependent = box_mean(brightness(input.dependent), both, window, 0, 1);
  parallel_for(input.height(), 8, [&](int y) {
    for (int x = 0; x < input.width(); ++x) {
      const float independent = scale.row(0, y)[x];
      scale.row(0, y)[x] =
          independent <= dependent.row(0, y)[x] ? 1.0f : std::min(kFar, independent / dependent.row(0, y)[x]);
    }
  });
  return scale;
}

/// The mean of both images, weighted by samples, [Csonka2002] Sec. 5: C = (n C_d + N C_i') / (n + N).
Image combine(const GroupedImage& crn, const FilterInput& input, const FilteredImage& filtered,
              CombinationWeights weights) {
  Image result(crn.width, crn.height, 3);
  parallel_for(crn.height, 8, [&](int y) {
    for (int x = 0; x < crn.width; ++x) {
      const auto n = static_cast<double>(crn.count(x, y));
      const double N =
          weights == CombinationWeights::kCounts ? input.count.row(0, y)[x] : filtered.effective_samples.pixel(x, y)[0];
      const double part = n + N > 0 ? N / (n + N) : 0;
      for (int c = 0; c < 3; ++c)
        result.pixel(x, y)[c] =
            static_cast<float>((1 - part) * input.dependent.row(c, y)[x] + part * filtered.colour.pixel(x, y)[c]);
    }
  });
  return result;
}

Image image_of(const Planes& planes) {
  Image image(planes.width(), planes.height(), planes.count());
  for (int y = 0; y < planes.height(); ++y)
    for (int x = 0; x < planes.width(); ++x)
      for (int c = 0; c < planes.count(); ++c) image.pixel(x, y)[c] = planes.row(c, y)[x];
  return image;
}

/// v of least_error_mixture.h: variance of the independent image's means, from its own samples if there are enough.
Planes noise_of_means(const GroupedImage& crn, const GroupedImage& independent) {
  Planes noise(crn.width, crn.height, 1, 0, 0);
  parallel_for(crn.height, 8, [&](int y) {
    for (int x = 0; x < crn.width; ++x) {
      const bool tells = variance_freedom(independent, x, y) > 0;
      const Spectrum variance = (tells ? independent : crn).sample_variance(x, y);
      if (const uint32_t count = independent.count(x, y); count > 0)
        noise.row(0, y)[x] = (variance.r + variance.g + variance.b) / static_cast<float>(count);
    }
  });
  return noise;
}

/// Of the CRN and the filtered image the brighter, at each pixel: a pixel that is dark in both is dark, even if its
/// neighbours are bright.
Planes brightest_of(const FilterInput& input, const Image& filtered) {
  Planes brightest(input.width(), input.height(), 1, 0, 0);
  parallel_for(input.height(), 8, [&](int y) {
    for (int x = 0; x < input.width(); ++x) {
      const float* f = filtered.pixel(x, y);
      const Spectrum d(input.dependent.row(0, y)[x], input.dependent.row(1, y)[x], input.dependent.row(2, y)[x]);
      brightest.row(0, y)[x] = std::max(colour_length(d), colour_length({f[0], f[1], f[2]})) / 3;
    }
  });
  return brightest;
}

/// Writes the mixture of least measured error to pixels that have independent samples.
void mix(const GroupedImage& crn, const GroupedImage& independent, const std::vector<unsigned char>& valid,
         const DependentTestsOptions& options, const DependentFilters& filters, const FilterInput& input,
         const FilteredImage& filtered, const Planes* scale, Image& result) {
  const Image dependent = image_of(input.dependent);
  std::vector<MixtureCandidate> candidates = {{&dependent, nullptr}, {&filtered.colour, &filtered.centre_weight}};
  std::optional<FilteredImage> narrow;
  if (options.filter == DependentFilter::kExact && options.window > 3) {
    narrow.emplace(filters.bound(input, 3, scale));
    candidates.push_back({&narrow->colour, &narrow->centre_weight});
  }
  const Planes brightest = brightest_of(input, filtered.colour);
  const Image mixture = least_error_mixture(input, noise_of_means(crn, independent), valid, candidates,
                                            options.measure_window, &brightest);
  for (int y = 0; y < crn.height; ++y)
    for (int x = 0; x < crn.width; ++x)
      if (input.count.row(0, y)[x] > 0) std::copy_n(mixture.pixel(x, y), 3, result.pixel(x, y));
}

void check(const GroupedImage& crn, const GroupedImage& independent, std::vector<std::string>& problems) {
  // Pixels may be without samples, which check_inputs() would reject if it knew the counts.
  GroupedImage without_counts[2] = {crn, independent};
  for (GroupedImage& image : without_counts) image.counts = nullptr;
  check_inputs(without_counts[0], without_counts[1], 1, 1, problems);
  if (problems.empty() && crn.groups < 2 && !crn.variance_in_groups)
    problems.push_back("the CRN image has 1 group, at least 2 are needed where films do not keep sample variances");
}

/// Processes two whole images at once; pixels with valid = 0 are ignored.
Image filter_and_combine(const GroupedImage& crn, const GroupedImage& independent,
                         const std::vector<unsigned char>& valid, const DependentTestsOptions& options,
                         const DependentFilters& filters, DependentTestsStages* stages) {
  const bool exact = options.filter == DependentFilter::kExact;
  const int border = exact ? options.window / 2 : options.regions.max_region;
  const FilterInput input =
      filter_input(crn, independent, valid, options.variance, options.smoothing, border, options.norm);
  std::optional<Planes> scale;
  if (exact && options.guard > 0) scale = difference_scale(input, valid, options.guard);
  FilteredImage filtered =
      exact ? filters.bound(input, options.window, scale ? &*scale : nullptr) : filters.region(input, options.regions);
  Image estimate = combine(crn, input, filtered, options.weights);
  if (options.weights == CombinationWeights::kMeasured)
    mix(crn, independent, valid, options, filters, input, filtered, scale ? &*scale : nullptr, estimate);
  fill_invalid(crn, independent, valid, estimate);
  if (!stages) return estimate;
  *stages = {{"dependent", image_of(input.dependent)},
             {"independent", image_of(input.independent)},
             {"combined", estimate},
             {"samples", image_of(input.count)},
             {"filtered", std::move(filtered.colour)},
             {"region", std::move(filtered.region)},
             {"bound", std::move(filtered.bound)},
             {"centre_weight", std::move(filtered.centre_weight)}};
  return estimate;
}

/// Rows in a band, without the surrounding ones it needs; small bands would spend most time on the latter.
int rows_of_band(int width, int halo) {
  constexpr int kMin = 64;
  const double rows = kDependentTestsBand / (kDependentTestsBytesPerPixel * width);
  return std::max(kMin, static_cast<int>(rows) - 2 * halo);
}

}  // namespace

DependentTestsOptions DependentTestsOptions::paper() {
  DependentTestsOptions options;
  options.filter = DependentFilter::kPaper;
  options.weights = CombinationWeights::kCounts;
  options.variance = VarianceSource::kDependent;
  options.smoothing = 1;
  options.guard = 0;
  return options;
}

namespace {

bool is_odd(int value, int low) {
  return OptionRange{.low = static_cast<double>(low), .high = 63, .odd = true}.contains(value);
}

bool in_range(const DependentTestsOptions& o) {
  return (o.norm == Norm::kSum || o.filter == DependentFilter::kPaper) && is_odd(o.window, 3) &&
         is_odd(o.smoothing, 1) && is_odd(o.measure_window, 3) && (o.guard == 0 || is_odd(o.guard, 1)) &&
         o.regions.max_region >= 1 && o.regions.max_region <= 63 && o.regions.min_centre_drop >= 0;
}

}  // namespace

EstimatorResult dependent_tests(const GroupedImage& crn, const GroupedImage& independent,
                                const DependentTestsOptions& options, DependentTestsStages* stages,
                                const DependentFilters& filters) {
  COVARY_CHECK(in_range(options), "options of dependent-tests are in the ranges that dependent_tests.h states");
  std::vector<std::string> problems;
  check(crn, independent, problems);
  throw_if_any(kDependentTests, problems);

  const int width = crn.width, height = crn.height, halo = dependent_tests_halo(options);
  const int step = rows_of_band(width, halo);
  EstimatorResult result;
  const std::vector<unsigned char> valid = finite_pixels(crn, independent, result.nonfinite_pixels);
  if (stages || step >= height) {
    result.estimate = filter_and_combine(crn, independent, valid, options, filters, stages);
    return result;
  }
  result.estimate = Image(width, height, 3);
  for (int y = 0; y < height; y += step) {
    const int own = std::min(step, height - y), first = std::max(0, y - halo);
    const int rows = std::min(height, y + own + halo) - first;
    const auto valid_rows = valid.begin() + static_cast<std::ptrdiff_t>(first) * width;
    const Image band = filter_and_combine(rows_of(crn, first, rows), rows_of(independent, first, rows),
                                          {valid_rows, valid_rows + static_cast<std::ptrdiff_t>(rows) * width}, options,
                                          filters, nullptr);
    std::copy_n(band.pixel(0, y - first), 3 * static_cast<size_t>(width) * own, result.estimate.pixel(0, y));
  }
  return result;
}

int dependent_tests_halo(const DependentTestsOptions& options) {
  const bool paper = options.filter == DependentFilter::kPaper;
  const int window = paper ? options.regions.max_region : options.window;
  const int filter = std::max(window / 2 + options.smoothing / 2, paper ? 0 : options.guard / 2);
  const bool measured = options.weights == CombinationWeights::kMeasured;
  return filter + (measured ? least_error_mixture_halo(options.measure_window) : 0);
}

namespace {

/// Declares its own options; those of --adaptive were declared before.
void declare(Settings& p, DependentTestsOptions& o) {
  static constexpr std::pair<const char*, Falloff> kFalloffs[] = {{"pyramid", Falloff::kPyramid},
                                                                  {"count", Falloff::kCount},
                                                                  {"spline", Falloff::kSpline},
                                                                  {"gaussian", Falloff::kGaussian}};
  static constexpr std::pair<const char*, Norm> kNorms[] = {{"sum", Norm::kSum}, {"euclidean", Norm::kEuclidean}};
  p.whole("window", o.window, kWindowRange, kWindowHelp);
  p.whole("max-region", o.regions.max_region, {.low = 1, .high = 63}, "Maximum side of a region of `paper`");
  p.real("min-centre-drop", o.regions.min_centre_drop, {.low = 0},
         "Regions grow while their centre's weight drops by at least this much");
  p.choice<Falloff>("falloff", o.regions.falloff, kFalloffs, "Weight by distance; count: pyramid by number of pixels");
  p.choice<Norm>("norm", o.norm, kNorms, "Of colours: sum of channels, or Euclidean",
                 {.effect = OptionEffect::kPasses});
  const bool exact = o.filter == DependentFilter::kExact;
  p.only_if(exact, {"window"}, "with `paper`");
  p.only_if(!exact, {"max-region", "min-centre-drop", "falloff", "norm", kAllocationOption},
            "without `paper`: only the published filter has regions, norms and counts to choose from");
}

}  // namespace

bool is_adaptive_option(const std::string& name) {
  return name == kAllocationOption ||
         std::find(std::begin(kAdaptiveOptions), std::end(kAdaptiveOptions), name) != std::end(kAdaptiveOptions);
}

DeclaredDependentTests declare_dependent_tests(Settings& p) {
  const bool paper = p.flag("paper", "dependent-tests as published: its filter, weights and allocation",
                            {.effect = OptionEffect::kPasses});
  DeclaredDependentTests declared;
  if (paper) declared.filter = DependentTestsOptions::paper();
  CountOptions& counts = declared.adaptive.counts;
  if (paper) counts.min_spp = 0, counts.smoothing = 1;
  counts.classes = paper;
  ask_for(p, declared.adaptive);
  static constexpr std::pair<const char*, Allocation> kAllocations[] = {{"relative-error", Allocation::kEqualError},
                                                                        {"variance", Allocation::kVariance}};
  Allocation allocation = Allocation::kEqualError;
  p.choice<Allocation>(kAllocationOption, allocation, kAllocations,
                       "Samples by relative error, or as variance over colour", {.effect = OptionEffect::kPasses});
  if (paper) counts.allocation = allocation;
  declare(p, declared.filter);
  counts.norm = declared.filter.norm;
  return declared;
}

Method make_dependent_tests(Settings& p) {
  const auto [o, adaptive] = declare_dependent_tests(p);
  Method estimator;
  estimator.summary = "dependent tests driven filtering";
  estimator.min_groups = 2;
  estimator.adaptive = adaptive;
  estimator.halo = dependent_tests_halo(o);
  estimator.memory.always = kDependentTestsBytesPerPixel;
  estimator.memory.largest_part = kDependentTestsBand;
  estimator.passes = PassPair{.image = [o = o](const GroupedImage& crn, const GroupedImage& independent,
                                               const MethodSettings&) { return dependent_tests(crn, independent, o); },
                              .explain = {}};
  estimator.stages = [o = o](const Samples& samples, const MethodSettings&) {
    DependentTestsStages stages;
    dependent_tests(samples.crn, samples.independent, o, &stages);
    return stages;
  };
  return estimator;
}

}  // namespace covary
