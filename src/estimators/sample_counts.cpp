// SPDX-License-Identifier: Apache-2.0
#include "estimators/sample_counts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "core/error.h"
#include "filters/filter_input.h"

namespace covary {
namespace {

constexpr uint32_t kMax = 1u << 30;  // maximum samples of any pixel
constexpr double kOffset = 0.01;     // of squared brightness
constexpr double kMinShare = 0.7, kLargestShare = 2;
constexpr double kDamping = 0.5;  // exponent of e for least-error
// Limits and window of kDenoised.
constexpr double kMinOfFiltered = 0.5, kLargestOfFiltered = 4;
constexpr int kFilteredWindow = 15;
constexpr int kBisections = 60;

/// Rounding up must not depend on the last bits of a power or logarithm.
double rounded_up(double samples) { return std::ceil(samples - 1e-6); }

/// Samples that pixels demand for a factor s: of_pixel s - already, before limits and rounding.
struct Demand {
  std::vector<double> of_pixel;
  double already = 0;    ///< samples that already count
  double for_error = 0;  ///< the factor that gives the relative error, if one is given
};

/// Brightness |C| of each pixel.
Planes brightness(const FilterInput& input, Norm norm) {
  Planes plane(input.width(), input.height(), 1, 0, 0);
  for (int y = 0; y < input.height(); ++y)
    for (int x = 0; x < input.width(); ++x)
      plane.row(0, y)[x] = colour_length(
          {input.dependent.row(0, y)[x], input.dependent.row(1, y)[x], input.dependent.row(2, y)[x]}, norm);
  return plane;
}

/// (3 sigma)^2 / |C|^2 of each pixel, as in [Csonka2002] Sec. 5, N = (3 sigma / (eps |C|))^2 - n; except for
/// equal-error, with |C| averaged as well and 0.01 added to its square. For variance (3 sigma)^2 / |C|.
std::vector<double> squared_errors(const GroupedImage& image, const CountOptions& options) {
  long n_nonfinite = 0;
  const std::vector<unsigned char> valid = finite_pixels(image, image, n_nonfinite);
  const FilterInput input =
      filter_input(image, image, valid, VarianceSource::kDependent, options.smoothing, 0, options.norm);
  const bool of_variance = options.allocation == Allocation::kVariance;
  const bool exact = of_variance || options.allocation == Allocation::kEqualError;
  Planes means = brightness(input, options.norm);
  if (!exact) means = box_mean(means, valid, options.smoothing, 0, 0);
  std::vector<double> errors(valid.size());
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const size_t pixel = static_cast<size_t>(y) * image.width + x;
      const double variance = 9.0 * input.variance.row(0, y)[x], mean = means.row(0, y)[x];
      if (!valid[pixel] || variance <= 0) continue;
      errors[pixel] = variance / std::max((of_variance ? mean : mean * mean) + (exact ? 0 : kOffset), 1e-30);
    }
  return errors;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double mean_count(const GroupedImage& image) {
  if (!image.counts) return image.groups;
  const size_t n_pixels = static_cast<size_t>(image.width) * image.height;
  return std::accumulate(image.counts, image.counts + n_pixels, 0.0) / static_cast<double>(n_pixels);
}

/// Means over neighbours.
std::vector<double> smoothed(std::span<const double> errors, const GroupedImage& image) {
  Planes plane(image.width, image.height, 1, 0, 0);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      plane.row(0, y)[x] = static_cast<float>(errors[static_cast<size_t>(y) * image.width + x]);
  const std::vector<unsigned char> all(errors.size(), 1);
  plane = box_mean(plane, all, kFilteredWindow, 0, 0);
  std::vector<double> means(errors.size());
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) means[static_cast<size_t>(y) * image.width + x] = plane.row(0, y)[x];
  return means;
}

Demand demand_of(const GroupedImage& image, const CountOptions& options, std::span<const double> filtered) {
  const double error = options.relative_error.value_or(1), per_error = 1 / (error * error);
  Demand demand;
  if (options.allocation == Allocation::kEqualError) {
    demand.of_pixel = squared_errors(image, options);                   // (3 sigma / |C|)^2
    if (options.first_pass_counts) demand.already = mean_count(image);  // n of [Csonka2002] Sec. 5
    demand.for_error = per_error;                                       // 1 / eps^2
    return demand;
  }
  if (options.allocation == Allocation::kVariance) {
    demand.of_pixel = squared_errors(image, options);
    return demand;
  }
  const bool is_filtered = options.allocation == Allocation::kDenoised;
  std::vector<double> errors = is_filtered ? smoothed(filtered, image) : squared_errors(image, options);
  const double mean_square = mean_of(errors);
  const double damping = is_filtered ? 1 : kDamping, least = is_filtered ? kMinOfFiltered : kMinShare;
  const double largest = is_filtered ? kLargestOfFiltered : kLargestShare;
  for (double& e : errors) e = options.allocation == Allocation::kUniform ? 1 : std::pow(e, damping / 2);
  if (const double mean = mean_of(errors); mean > 0)
    for (double& e : errors) e = std::clamp(e / mean, least, largest);
  else
    std::fill(errors.begin(), errors.end(), 1.0);
  demand.of_pixel = std::move(errors);
  if (options.tops_up) demand.already = mean_count(image);
  // Mean of squared error / (s share), where shares have mean one; exact for uniform counts.
  demand.for_error = mean_square * per_error;
  return demand;
}

/// The published filter averages only pixels with equal numbers, so that uniform ones must not differ at all.
bool all_equal(const CountOptions& options) { return options.classes && options.allocation == Allocation::kUniform; }

/// Converts demands to numbers of samples.
class Rounding {
 public:
  Rounding(const CountOptions& options, uint32_t multiple)
      : options_(options), multiple_(multiple), classes_(options.classes && !all_equal(options)) {}

  uint32_t operator()(double samples) const {
    const double most = options_.max_spp ? std::min<double>(*options_.max_spp, kMax) : kMax;
    const double wanted = std::clamp(samples, 0.0, most);
    const auto whole = classes_ ? class_of(wanted) : static_cast<uint32_t>(rounded_up(wanted));
    const auto limited = std::clamp(whole, static_cast<uint32_t>(options_.min_spp), static_cast<uint32_t>(most));
    const uint64_t up = (uint64_t{limited} + multiple_ - 1) / multiple_ * multiple_;
    return static_cast<uint32_t>(static_cast<double>(up) > most ? up - multiple_ : up);
  }

 private:
  const CountOptions& options_;
  uint32_t multiple_;
  bool classes_;
};

std::vector<uint32_t> counts_for(const Demand& demand, double factor, const Rounding& rounding) {
  std::vector<uint32_t> counts(demand.of_pixel.size());
  // N[p] of [Csonka2002] Sec. 5, with 1 / eps^2 as the factor; negative results become zero; rounded up to classes.
  for (size_t i = 0; i < counts.size(); ++i) counts[i] = rounding(factor * demand.of_pixel[i] - demand.already);
  return counts;
}

double sum_of(const std::vector<uint32_t>& counts) {
  return static_cast<double>(std::accumulate(counts.begin(), counts.end(), uint64_t{0}));
}

/// Numbers that sum to `total`, as nearly as limits allow; fewer if pixels of equal demand must not differ.
std::vector<uint32_t> counts_within(const Demand& demand, double total, const Rounding& rounding, bool may_differ) {
  double low = -30 * std::log(10.0), high = 40 * std::log(10.0);
  std::vector<uint32_t> fewer = counts_for(demand, std::exp(low), rounding), more;
  if (sum_of(fewer) >= total) return fewer;
  more = counts_for(demand, std::exp(high), rounding);
  if (sum_of(more) <= total) return more;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    std::vector<uint32_t> counts = counts_for(demand, std::exp(middle), rounding);
    const bool too_many = sum_of(counts) > total;
    (too_many ? high : low) = middle;
    (too_many ? more : fewer) = std::move(counts);
  }
  if (!may_differ) return fewer;
  // Pixels of equal demand step together. Let as many of them step as the total allows, evenly spread.
  const double part = (total - sum_of(fewer)) / (sum_of(more) - sum_of(fewer));
  double due = 0;
  for (size_t i = 0; i < fewer.size(); ++i) {
    if (more[i] == fewer[i]) continue;
    due += part;
    if (due < 0.5) continue;
    fewer[i] = more[i];
    due -= 1;
  }
  return fewer;
}

}  // namespace

uint32_t class_of(double samples) {
  if (samples <= 1) return samples > 1e-6 ? 1 : 0;
  for (uint64_t decade = 10; decade < kMax; decade *= 10)
    for (const uint64_t step : {1, 2, 5})
      if (samples <= static_cast<double>(decade * step)) return static_cast<uint32_t>(decade * step);
  return kMax;
}

void CountOptions::check_limits(uint32_t multiple) const {
  if (allocation == Allocation::kVariance && relative_error)
    throw Error(
        ErrorCode::kUsage,
        "`allocation` is variance, whose numbers give no relative error: expected samples or a time instead of one, "
        "or `allocation` relative-error");
  const uint32_t least = std::max(multiple, static_cast<uint32_t>(min_spp));
  if (max_spp && static_cast<uint32_t>(*max_spp) / multiple * multiple < least)
    throw Error(ErrorCode::kUsage,
                fmt::format("`max-spp` is {}, expected at least {}, one sample for each group (`groups`)", *max_spp,
                            (least + multiple - 1) / multiple * multiple));
}

std::vector<uint32_t> sample_counts(const GroupedImage& first_pass, double budget, const CountOptions& options,
                                    uint32_t multiple, std::span<const double> filtered) {
  options.check_limits(multiple);
  COVARY_CHECK(multiple >= 1 && budget >= 0 && (std::isfinite(budget) || options.relative_error),
               "counts follow from a budget or a relative error");
  const Demand demand = demand_of(first_pass, options, filtered);
  const Rounding rounding(options, multiple);
  const double total = budget * static_cast<double>(demand.of_pixel.size());
  if (options.relative_error) {
    std::vector<uint32_t> counts = counts_for(demand, demand.for_error, rounding);
    if (sum_of(counts) <= total) return counts;
  }
  return counts_within(demand, total, rounding, !all_equal(options));
}

bool have_relative_error(const GroupedImage& first_pass, const std::vector<uint32_t>& counts,
                         const CountOptions& options, uint32_t multiple) {
  if (!options.relative_error) return true;
  CountOptions without_limit = options;
  without_limit.max_spp.reset();
  const Demand demand = demand_of(first_pass, without_limit, {});
  const std::vector<uint32_t> wanted = counts_for(demand, demand.for_error, Rounding(without_limit, multiple));
  return std::equal(counts.begin(), counts.end(), wanted.begin(), wanted.end(), std::greater_equal<>());
}

void ask_for(Settings& parameters, AdaptiveSampling& sampling) {
  static constexpr OptionTraits kPasses{.effect = OptionEffect::kPasses};
  Settings& p = parameters;
  p.whole("dependent-spp", sampling.first_spp, {.low = 1},
          "First pass's samples; default: half of all, of dependent-tests at most 50", kPasses);
  p.whole("max-spp", sampling.counts.max_spp, {.low = 1}, "Maximum samples per pixel in the last pass", kPasses);
}

std::optional<AdaptiveSampling> ask_for_adaptive(Settings& parameters, AdaptiveSampling standard,
                                                 const std::string& help) {
  const bool is_adaptive = parameters.flag("adaptive", help, {.effect = OptionEffect::kPasses});
  ask_for(parameters, standard);
  if (is_adaptive) return standard;
  parameters.only_if(false, kAdaptiveOptions, "without `adaptive`: all pixels get the same number of samples");
  return {};
}

}  // namespace covary
