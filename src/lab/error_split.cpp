// SPDX-License-Identifier: Apache-2.0
#include "lab/error_split.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "metrics/metrics.h"

namespace covary::lab {
namespace {

/// The references, per pixel and in double: what does not change from render to render.
class References {
 public:
  References(std::span<const Image> images, std::span<const Image> denominators)
      : images_(images), denominators_(denominators), first_(images.front()), second_(images.back()) {
    COVARY_CHECK(images.size() == 1 || images.size() == 2, "one or two references");
    for (const Image& image : images) check_size(image);
    for (const Image& image : denominators) check_size(image);
  }
  void check_size(const Image& image) const {
    COVARY_CHECK(image.channels == 3, "3 channels");
    if (image.width != first_.width || image.height != first_.height)
      throw Error(ErrorCode::kInput, fmt::format("the image has {} x {} pixels, the reference {} x {}", image.width,
                                                 image.height, first_.width, first_.height));
  }
  size_t n_pixels() const { return static_cast<size_t>(first_.width) * first_.height; }
  bool finite(size_t p) const { return pixel_is_finite(first_, p) && pixel_is_finite(second_, p); }
  double mean(size_t i) const { return 0.5 * (static_cast<double>(first_.data[i]) + second_.data[i]); }
  double half_difference(size_t i) const { return 0.5 * (static_cast<double>(first_.data[i]) - second_.data[i]); }
  double weight(size_t p) const { return relative_weight(images_, denominators_, p); }
  double grey(size_t p) const { return (mean(3 * p) + mean(3 * p + 1) + mean(3 * p + 2)) / 3; }

 private:
  std::span<const Image> images_, denominators_;
  const Image &first_, &second_;
};

enum Weight { kRelative, kAbsolute, kWeights };
using PerWeight = std::array<double, kWeights>;

/// Sum of independent numbers with mean zero, and the root of the sum of their squares.
struct Lean {
  double sum = 0, squares = 0;
  void add(double t) { sum += t, squares += t * t; }
  double z() const { return squares > 0 ? sum / std::sqrt(squares) : 0; }
};

/// Mean of all renders over the pixels where every render and the references are finite.
struct MeanImage {
  std::vector<double> data;
  std::vector<char> finite;
};

MeanImage mean_image(std::span<const Image> renders, const References& references) {
  MeanImage mean{std::vector<double>(references.n_pixels() * 3), std::vector<char>(references.n_pixels())};
  for (size_t p = 0; p < mean.finite.size(); ++p) mean.finite[p] = references.finite(p);
  for (const Image& render : renders) {
    references.check_size(render);
    for (size_t p = 0; p < mean.finite.size(); ++p) {
      mean.finite[p] = mean.finite[p] && pixel_is_finite(render, p);
      if (!mean.finite[p]) continue;
      for (size_t i = 3 * p; i < 3 * p + 3; ++i) mean.data[i] += static_cast<double>(render.data[i]);
    }
  }
  for (double& v : mean.data) v /= static_cast<double>(renders.size());
  return mean;
}

/// Calls body(p, grey, weight) for each finite pixel p: the reference's grey value, and the weight of relative errors.
template <typename Body>
void for_each_pixel(const MeanImage& mean, const References& references, const Body& body) {
  for (size_t p = 0; p < mean.finite.size(); ++p) {
    if (!mean.finite[p]) continue;
    body(p, references.grey(p), references.weight(p));
  }
}

/// One render against the mean and the references: weighted sums over the finite pixels.
struct RenderSums {
  PerWeight error{}, around_mean{};  // (F_s - R1)(F_s - R2) and (F_s - F)^2
  double grey = 0;
  Lean lean;  // of F_s - F
};

RenderSums sums_of(const Image& render, const MeanImage& mean, const References& references) {
  RenderSums sums;
  for_each_pixel(mean, references, [&](size_t p, double, double weight) {
    double error = 0, around_mean = 0, lean = 0;
    for (size_t i = 3 * p; i < 3 * p + 3; ++i) {
      const double from_mean = render.data[i] - mean.data[i], h = references.half_difference(i);
      const double from_reference = render.data[i] - references.mean(i);
      error += from_reference * from_reference - h * h;  // (F - R1)(F - R2)
      around_mean += from_mean * from_mean;
      lean += from_mean * h;
      sums.grey += static_cast<double>(render.data[i]) / 3;
    }
    sums.error[kRelative] += weight * error, sums.error[kAbsolute] += error;
    sums.around_mean[kRelative] += weight * around_mean, sums.around_mean[kAbsolute] += around_mean;
    sums.lean.add(weight * lean);
  });
  return sums;
}

/// The references' contribution to the uncertainty and to the error.
struct ReferenceSums {
  uint64_t n_pixels = 0;
  PerWeight error_squares{};  // of 2 (F - R)(R1 - R2)/2 per pixel
  double grey = 0, grey_squares = 0, own_error = 0;
  Lean lean;
};

ReferenceSums reference_sums(const MeanImage& mean, const References& references) {
  ReferenceSums sums;
  for_each_pixel(mean, references, [&](size_t p, double grey, double weight) {
    double product = 0, h_squared = 0, h_grey = 0;
    for (size_t i = 3 * p; i < 3 * p + 3; ++i) {
      const double h = references.half_difference(i);
      product += 2 * (mean.data[i] - references.mean(i)) * h;
      h_squared += h * h;
      h_grey += h / 3;
    }
    ++sums.n_pixels;
    sums.error_squares[kRelative] += weight * weight * product * product;
    sums.error_squares[kAbsolute] += product * product;
    sums.own_error += weight * h_squared;
    sums.grey += grey, sums.grey_squares += h_grey * h_grey;
    sums.lean.add(weight * product);
  });
  return sums;
}

/// Adds a further independent standard error.
Estimate widened(const Estimate& estimate, double standard_error) {
  if (!std::isfinite(estimate.standard_error) || estimate.standard_error <= 0) return estimate;
  const double factor = std::hypot(estimate.standard_error, standard_error) / estimate.standard_error;
  return {estimate.value, estimate.standard_error * factor, estimate.value - (estimate.value - estimate.low) * factor,
          estimate.value + (estimate.high - estimate.value) * factor};
}

/// `error[s]`: error of render s; `around_mean[s]`: <(F_s - F)^2>.
SplitError split(const std::vector<double>& error, const std::vector<double>& around_mean, double reference_error) {
  SplitError result;
  result.of_render = error;
  result.error = widened(mean_estimate(error), reference_error);
  const size_t n = error.size();
  if (n < 2) return result;
  const double k = static_cast<double>(n);
  double sum = 0;
  for (double c : around_mean) sum += c;
  const double variance = sum / (k - 1);
  // Without render i, the sum of squares around the mean of the others is smaller by k/(k-1) c_i.
  const auto variance_without = [&](size_t i) { return (sum - k / (k - 1) * around_mean[i]) / (k - 2); };
  const auto error_without = [&](size_t i) { return (k * result.error.value - error[i]) / (k - 1); };
  const size_t n_jackknife = n < 3 ? 0 : n;
  result.variance = jackknife(variance, n_jackknife, variance_without);
  result.squared_bias = widened(jackknife(result.error.value - variance, n_jackknife,
                                          [&](size_t i) { return error_without(i) - variance_without(i); }),
                                reference_error);
  return result;
}

}  // namespace

ErrorSplit split_error(std::span<const Image> renders, std::span<const Image> images,
                       std::span<const Image> denominators) {
  COVARY_CHECK(!renders.empty(), "at least one render");
  const References references(images, denominators);
  const MeanImage mean = mean_image(renders, references);
  const ReferenceSums own = reference_sums(mean, references);
  ErrorSplit result;
  result.n_references = images.size();
  result.n_pixels = own.n_pixels;
  result.n_non_finite = mean.finite.size() - own.n_pixels;
  if (own.n_pixels == 0)
    throw Error(ErrorCode::kInput,
                fmt::format("none of the {} pixels is finite in all renders and references", mean.finite.size()));
  const double n = static_cast<double>(own.n_pixels);

  std::array<std::vector<double>, kWeights> error, around_mean;
  for (const Image& render : renders) {
    const RenderSums sums = sums_of(render, mean, references);
    for (size_t w = 0; w < kWeights; ++w) {
      error[w].push_back(sums.error[w] / (3 * n));
      around_mean[w].push_back(sums.around_mean[w] / (3 * n));
    }
    result.mean_ratio_of_render.push_back(sums.grey / own.grey);
    if (renders.size() > 1) result.reference_lean_of_render.push_back(sums.lean.z());
  }
  const auto reference_error = [&](size_t w) { return std::sqrt(own.error_squares[w]) / (3 * n); };
  result.relative = split(error[kRelative], around_mean[kRelative], reference_error(kRelative));
  result.absolute = split(error[kAbsolute], around_mean[kAbsolute], reference_error(kAbsolute));
  result.mean_ratio = widened(mean_estimate(result.mean_ratio_of_render), std::sqrt(own.grey_squares) / own.grey);
  result.reference_error = own.own_error / (3 * n);
  result.reference_noise = reference_error(kRelative);
  result.reference_lean = own.lean.z();
  const auto is_first = [&](const Image& image) { return image.data == renders[0].data; };
  result.same_renders = renders.size() > 1 && std::ranges::all_of(renders, is_first);
  return result;
}

bool is_mean_off(const ErrorSplit& split) {
  const int dof = static_cast<int>(split.relative.of_render.size()) - 1;
  const double off = std::abs(split.mean_ratio.value - 1);
  return dof >= 1 && off > 1e-3 && off > student_t_quantile(1 - 5e-4, dof) * split.mean_ratio.standard_error;
}

std::vector<std::string> suspicions(const ErrorSplit& split, bool unbiased) {
  constexpr double kLean = 5.5;  // two-sided probability 4e-8 for a normal number
  std::vector<std::string> found;
  const SplitError& e = split.relative;
  if (split.n_references == 2 && split.reference_error == 0) {
    found.push_back("both references are the same image, so errors include the reference's noise");
    return found;
  }
  if (split.same_renders && split.reference_error > 0)  // where there is noise
    found.push_back("the images of all seeds are the same: is the seed used? (a program's COVARY_SEED)");
  const auto half = [](double z) { return z > 0 ? "first" : "second"; };
  for (size_t s = 0; s < split.reference_lean_of_render.size(); ++s)
    if (const double z = split.reference_lean_of_render[s]; std::abs(z) > kLean)
      found.push_back(
          fmt::format("render {} leans to the {} reference more than the others (z = {:.1f}): do they share "
                      "samples, by the same seed?",
                      s + 1, half(z), z));
  if (std::abs(split.reference_lean) > kLean)
    found.push_back(
        fmt::format("the renders lean to the {} reference (z = {:.1f}): they share samples, or the references "
                    "are not equally good",
                    half(split.reference_lean), split.reference_lean));
  if (e.error.high < 0)
    found.push_back(fmt::format("the error is negative, {:.3g}: do the renders share samples with both references?",
                                e.error.value));
  if (unbiased && e.squared_bias.low > 0.05 * e.error.value)
    found.push_back(
        fmt::format("{:.0f} % of the error is the same in all renders, although this method has no bias: is the "
                    "reference of the same scene, with the same settings?",
                    100 * e.squared_bias.value / e.error.value));
  if (const Estimate& mean = split.mean_ratio; is_mean_off(split))
    found.push_back(fmt::format(
        "the image mean is {:+.2f} % off the reference's (95 %: {:+.2f} % to {:+.2f} %): "
        "something is {}",
        100 * (mean.value - 1), 100 * (mean.low - 1), 100 * (mean.high - 1), mean.value > 1 ? "added" : "lost"));
  return found;
}

}  // namespace covary::lab
