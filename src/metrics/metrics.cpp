// SPDX-License-Identifier: Apache-2.0
#include "metrics/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "metrics/flip.h"

namespace covary {
namespace {

void check_sizes(const Image& image, std::span<const Image> references) {
  COVARY_CHECK(references.size() == 1 || references.size() == 2, "one or two references");
  for (const Image& r : references)
    if (r.width != image.width || r.height != image.height)
      throw Error(ErrorCode::kInput, fmt::format("the image has {} x {} pixels, the reference {} x {}", image.width,
                                                 image.height, r.width, r.height));
  for (const Image& r : references) COVARY_CHECK(r.channels == 3 && image.channels == 3, "3 channels");
}

/// One pixel of a render and of its references, in double.
struct Pixel {
  std::array<double, 3> f, r1, r2, r;  // r: mean of the references
  double grey = 0;                     // mean of r over the channels
  Pixel(const Image& image, std::span<const Image> references, size_t p) {
    for (size_t c = 0; c < 3; ++c) {
      f[c] = image.data[p * 3 + c];
      r1[c] = references.front().data[p * 3 + c];
      r2[c] = references.back().data[p * 3 + c];
      r[c] = 0.5 * (r1[c] + r2[c]);
      grey += r[c] / 3;
    }
  }
  /// Mean over the channels of (F - R1)(F - R2); the squared difference when there is one reference.
  double squared_error() const {
    double sum = 0;
    for (size_t c = 0; c < 3; ++c) sum += (f[c] - r1[c]) * (f[c] - r2[c]);
    return sum / 3;
  }
};

double pixel_error(Metric metric, const Pixel& p) {
  double sum = 0;
  switch (metric) {
    case Metric::kRelMse:
      return p.squared_error() / (p.grey * p.grey + kRelativeOffset);
    case Metric::kMse:
      return p.squared_error();
    case Metric::kMae:
      for (size_t c = 0; c < 3; ++c) sum += std::abs(p.f[c] - p.r[c]) / 3;
      return sum;
    case Metric::kMape:
      for (size_t c = 0; c < 3; ++c) sum += std::abs(p.f[c] - p.r[c]) / (std::abs(p.r[c]) + kRelativeOffset) / 3;
      return sum;
    case Metric::kAbove5: {
      double brightness = 0;
      for (size_t c = 0; c < 3; ++c) sum += std::abs(p.f[c] - p.r[c]), brightness += std::abs(p.r[c]);
      return sum > kPerceptible * brightness ? 1 : 0;
    }
    case Metric::kFlip:
    case Metric::kRelMseTrimmed:
      break;
  }
  throw Error(ErrorCode::kInternal, "not a sum over single pixels");
}

/// A value of an error map: of errors that are too large for a float, the largest.
float map_value(double error) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(error, -kLargest, kLargest));
}

/// Relative squared errors of single values, by the value's own reference; 0 where pixels are left out.
std::vector<double> channel_errors(const Image& image, std::span<const Image> references,
                                   const std::vector<char>& finite) {
  std::vector<double> errors(3 * finite.size());
  for (size_t p = 0; p < finite.size(); ++p) {
    if (!finite[p]) continue;
    const Pixel pixel(image, references, p);
    for (size_t c = 0; c < 3; ++c)
      errors[3 * p + c] =
          (pixel.f[c] - pixel.r1[c]) * (pixel.f[c] - pixel.r2[c]) / (pixel.r[c] * pixel.r[c] + kRelativeOffset);
  }
  return errors;
}

/// kRelMseTrimmed of each pixel: the largest values do not count.
std::vector<double> trimmed_errors(const Image& image, std::span<const Image> references,
                                   const std::vector<char>& finite, uint64_t n_pixels) {
  std::vector<double> errors = channel_errors(image, references, finite);
  const auto n_dropped = static_cast<size_t>(kTrimmedPart * 3 * static_cast<double>(n_pixels));
  std::vector<size_t> order(errors.size());
  std::iota(order.begin(), order.end(), size_t{0});
  // Equal values: those of later pixels are dropped first.
  std::nth_element(order.begin(), order.end() - static_cast<ptrdiff_t>(n_dropped), order.end(),
                   [&](size_t a, size_t b) { return errors[a] != errors[b] ? errors[a] < errors[b] : a < b; });
  for (size_t i = order.size() - n_dropped; i < order.size(); ++i) errors[order[i]] = 0;
  std::vector<double> result(finite.size());
  const double scale =
      static_cast<double>(n_pixels) / (3 * static_cast<double>(n_pixels) - static_cast<double>(n_dropped));
  for (size_t p = 0; p < finite.size(); ++p)
    result[p] = (errors[3 * p] + errors[3 * p + 1] + errors[3 * p + 2]) * scale;
  return result;
}

/// FLIP looks at neighbourhoods: pixels that are left out become equal in both images.
Image flip_map(const Image& image, std::span<const Image> references, const std::vector<char>& finite,
               bool low_dynamic_range) {
  Image f = image, r = references.front();
  for (size_t p = 0; p < finite.size(); ++p)
    for (size_t i = p * 3; i < p * 3 + 3; ++i) {
      r.data[i] = 0.5f * r.data[i] + 0.5f * references.back().data[i];  // their sum may be infinite
      if (!finite[p]) f.data[i] = r.data[i] = 0;
    }
  return low_dynamic_range ? flip_ldr(f, r) : flip_hdr(f, r);
}

}  // namespace

bool pixel_is_finite(const Image& image, size_t p) {
  const float* v = image.data.data() + p * 3;
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

const std::vector<MetricInfo>& metrics() {
  static const std::vector<MetricInfo> all{
      {Metric::kRelMse, "relmse", "1/(3N) sum ||F - R||^2 / (R'^2 + 0.01), R' = mean of R's RGB",
       "1/(3N) sum (F - R1).(F - R2) / (R'^2 + 0.01), R' = mean of (R1 + R2)/2's RGB"},
      {Metric::kRelMseTrimmed, "relmse-trimmed",
       "mean over pixels and channels of (F - R)^2 / (R^2 + 0.01), without the largest 0.1 %",
       "mean over pixels and channels of (F - R1)(F - R2) / (R^2 + 0.01), R = (R1 + R2)/2, without the largest 0.1 %"},
      {Metric::kMse, "mse", "1/(3N) sum ||F - R||^2", "1/(3N) sum (F - R1).(F - R2)"},
      {Metric::kMae, "mae", "1/(3N) sum |F - R|", "1/(3N) sum |F - (R1 + R2)/2|"},
      {Metric::kMape, "mape", "1/(3N) sum |F - R| / (|R| + 0.01)",
       "1/(3N) sum |F - R| / (|R| + 0.01), R = (R1 + R2)/2"},
      {Metric::kFlip, "flip", "1/N sum FLIP, 67 pixels per degree",
       "1/N sum FLIP against (R1 + R2)/2, 67 pixels per degree"},
      {Metric::kAbove5, "above5", "share of pixels with sum |F - R| > 0.05 sum |R| over RGB",
       "share of pixels with sum |F - R| > 0.05 sum |R| over RGB, R = (R1 + R2)/2"},
  };
  return all;
}

const MetricInfo& find_metric(const std::string& name) {
  std::vector<std::string> names;
  for (const MetricInfo& info : metrics()) {
    if (info.name == name) return info;
    names.push_back(info.name);
  }
  throw Error(ErrorCode::kUsage, fmt::format("unknown metric '{}'{}; accepted are {}", name, did_you_mean(name, names),
                                             fmt::join(names, ", ")));
}

MetricResult compute_metric(Metric metric, const Image& image, std::span<const Image> references,
                            bool low_dynamic_range) {
  check_sizes(image, references);
  const size_t n_pixels = static_cast<size_t>(image.width) * image.height;
  MetricResult result;
  std::vector<char> finite(n_pixels);
  for (size_t p = 0; p < n_pixels; ++p) {
    finite[p] =
        pixel_is_finite(image, p) && pixel_is_finite(references.front(), p) && pixel_is_finite(references.back(), p);
    ++(finite[p] ? result.n_pixels : result.n_non_finite);
  }
  if (result.n_pixels == 0)
    throw Error(ErrorCode::kInput,
                fmt::format("none of the {} pixels is finite in the image and the reference", n_pixels));

  if (metric == Metric::kFlip)
    result.map = flip_map(image, references, finite, low_dynamic_range);
  else
    result.map = Image(image.width, image.height, 1);
  std::vector<double> trimmed;
  if (metric == Metric::kRelMseTrimmed) trimmed = trimmed_errors(image, references, finite, result.n_pixels);
  double sum = 0;
  for (size_t p = 0; p < n_pixels; ++p) {
    if (!finite[p]) {
      result.map.data[p] = std::numeric_limits<float>::quiet_NaN();
      continue;
    }
    const double error = metric == Metric::kFlip ? result.map.data[p]
                         : !trimmed.empty()      ? trimmed[p]
                                                 : pixel_error(metric, Pixel(image, references, p));
    result.map.data[p] = map_value(error);
    sum += error;
  }
  result.value = sum / static_cast<double>(result.n_pixels);
  return result;
}

}  // namespace covary
