// SPDX-License-Identifier: Apache-2.0
#include "metrics/metrics.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "core/known_names.h"
#include "metrics/flip.h"

namespace covary {
namespace {

double weight_of(double denominator) { return 1 / (denominator * denominator + kRelativeOffset); }

/// A pixel of the image and its references, in double.
struct Pixel {
  std::array<double, 3> f, r1, r2, r;          // r: mean of the references
  double weight = 0;                           // of squared errors in relMSE
  std::array<double, 3> channel_weights = {};  // likewise, by each channel's own value
  Pixel(const ComparedRows::Band& band, size_t p) {
    for (size_t c = 0; c < 3; ++c) {
      f[c] = band.image->data[p * 3 + c];
      r1[c] = band.references.front()->data[p * 3 + c];
      r2[c] = band.references.back()->data[p * 3 + c];
      r[c] = 0.5 * (r1[c] + r2[c]);
    }
    for (const float* values : band.denominators) add_denominator(values + 3 * p, band.denominators.size());
    if (band.denominators.empty()) add_denominator(r.data(), 1);
  }
  template <typename Value>
  void add_denominator(const Value* d, size_t n) {
    double grey = 0;
    for (size_t c = 0; c < 3; ++c) {
      grey += double{d[c]} / 3;
      channel_weights[c] += weight_of(d[c]) / static_cast<double>(n);
    }
    weight += weight_of(grey) / static_cast<double>(n);
  }
  /// What the noise of two references adds to squared_error(): the mean over channels of (F - R)(R1 - R2). Its square
  /// has the variance of squared_error() as its expectation.
  double noise() const {
    double sum = 0;
    for (size_t c = 0; c < 3; ++c) sum += (f[c] - r[c]) * (r1[c] - r2[c]);
    return sum / 3;
  }
  /// Mean over channels of (F - R1)(F - R2); of the squared difference if there is one reference.
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
      return p.squared_error() * p.weight;
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

/// Error for the map, clamped to the largest float.
float map_value(double error) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(error, -kLargest, kLargest));
}

/// Whether all values of a pixel are finite.
bool is_finite(const ComparedRows::Band& band, size_t p) {
  for (const float* d : band.denominators)
    if (!std::isfinite(d[3 * p] + d[3 * p + 1] + d[3 * p + 2])) return false;
  return pixel_is_finite(*band.image, p) && pixel_is_finite(*band.references.front(), p) &&
         pixel_is_finite(*band.references.back(), p);
}

/// Relative squared error of each channel, by its own reference value; 0 for pixels left out.
std::array<double, 3> channel_errors(const ComparedRows::Band& band, size_t p) {
  std::array<double, 3> errors{};
  if (!is_finite(band, p)) return errors;
  const Pixel pixel(band, p);
  for (size_t c = 0; c < 3; ++c)
    errors[c] = (pixel.f[c] - pixel.r1[c]) * (pixel.f[c] - pixel.r2[c]) * pixel.channel_weights[c];
  return errors;
}

/// Calls f(band, first row) for all bands, in order.
template <typename F>
void for_each_band(ComparedRows& rows, const F& f) {
  for (int y = 0; y < rows.height(); y += rows.band_rows())
    f(rows.rows(y, std::min(rows.band_rows(), rows.height() - y)), y);
}

/// A relative error and its index (3 per pixel), which breaks ties.
using RankedError = std::pair<double, uint64_t>;

/// What kRelMseTrimmed drops, and the factor that makes the mean over pixels the mean of the rest.
struct TrimmedErrors {
  std::optional<RankedError> smallest_dropped;  ///< of equal errors, later pixels are dropped first
  double scale = 1;
};

TrimmedErrors trimmed_errors(ComparedRows& rows) {
  const auto n_values = [](uint64_t n_pixels) {
    return static_cast<size_t>(kTrimmedPart * 3 * static_cast<double>(n_pixels));
  };
  const size_t most = n_values(static_cast<uint64_t>(rows.width()) * rows.height());
  std::vector<RankedError> largest;
  const auto keep = [&](size_t n) {
    if (largest.size() <= n) return;
    std::nth_element(largest.begin(), largest.begin() + static_cast<ptrdiff_t>(n), largest.end(), std::greater<>());
    largest.resize(n);
  };
  uint64_t n_finite = 0, i = 0;
  for_each_band(rows, [&](const ComparedRows::Band& band, int) {
    for (size_t p = 0; p < band.image->data.size() / 3; ++p) {
      n_finite += is_finite(band, p) ? 1 : 0;
      for (const double error : channel_errors(band, p)) largest.emplace_back(error, i++);
      if (largest.size() > 2 * most + 1024) keep(most);
    }
  });
  const size_t n_dropped = n_values(n_finite);
  TrimmedErrors result;
  result.scale = static_cast<double>(n_finite) / (3 * static_cast<double>(n_finite) - static_cast<double>(n_dropped));
  keep(n_dropped);
  if (n_dropped > 0) result.smallest_dropped = *std::min_element(largest.begin(), largest.end());
  return result;
}

/// FLIP uses neighbourhoods, so excluded pixels are made equal in both images. The reference is the mean of the
/// references.
std::pair<Image, Image> flip_inputs(const ComparedRows::Band& band) {
  std::pair<Image, Image> images(*band.image, *band.references.front());
  auto& [f, r] = images;
  for (size_t p = 0; p < f.data.size() / 3; ++p) {
    const bool finite = is_finite(band, p);
    for (size_t i = p * 3; i < p * 3 + 3; ++i) {
      r.data[i] = 0.5f * r.data[i] + 0.5f * band.references.back()->data[i];  // their sum may overflow
      if (!finite) f.data[i] = r.data[i] = 0;
    }
  }
  return images;
}

/// Per-pixel errors of one metric, including what they need to know of the whole image.
class ErrorOfPixels {
 public:
  ErrorOfPixels(Metric metric, ComparedRows& rows, bool low_dynamic_range) : metric_(metric), rows_(rows) {
    if (metric == Metric::kFlip && !low_dynamic_range)
      exposures_ = flip_exposures([&](const std::function<void(const Image&)>& give) {
        for_each_band(rows, [&](const ComparedRows::Band& band, int) { give(flip_inputs(band).second); });
      });
    if (metric == Metric::kRelMseTrimmed) trimmed_ = trimmed_errors(rows);
  }

  /// Reads a band; for FLIP, also the rows around it.
  const ComparedRows::Band& move_to(int first_row, int n_rows) {
    const int halo = metric_ == Metric::kFlip ? kFlipHalo : 0;
    const int first = std::max(first_row - halo, 0), end = std::min(first_row + n_rows + halo, rows_.height());
    band_ = rows_.rows(first, end - first);
    offset_ = static_cast<size_t>(first_row - first) * rows_.width();
    first_value_ = 3 * static_cast<uint64_t>(first) * rows_.width();
    if (metric_ == Metric::kFlip) {
      const auto [f, r] = flip_inputs(band_);
      flip_ = exposures_ ? flip_hdr(f, r, *exposures_) : flip_ldr(f, r);
    }
    return band_;
  }
  /// Index in the band of pixel p of the requested rows.
  size_t in_band(size_t p) const { return offset_ + p; }

  /// Part of the square of MetricResult::reference_error, for a finite pixel of the band.
  double squared_noise(size_t p) const {
    if (metric_ != Metric::kRelMse && metric_ != Metric::kMse) return 0;
    const Pixel pixel(band_, p);
    const double noise = pixel.noise() * (metric_ == Metric::kRelMse ? pixel.weight : 1);
    return noise * noise;
  }

  /// For a finite pixel of the band.
  double error(size_t p) const {
    if (metric_ == Metric::kFlip) return flip_.data[p];
    if (metric_ != Metric::kRelMseTrimmed) return pixel_error(metric_, Pixel(band_, p));
    double sum = 0;
    const std::array<double, 3> errors = channel_errors(band_, p);
    for (size_t c = 0; c < 3; ++c)
      if (!trimmed_.smallest_dropped || RankedError(errors[c], first_value_ + 3 * p + c) < *trimmed_.smallest_dropped)
        sum += errors[c];
    return sum * trimmed_.scale;
  }

 private:
  Metric metric_;
  ComparedRows& rows_;
  std::optional<FlipExposures> exposures_;
  TrimmedErrors trimmed_;
  ComparedRows::Band band_;
  size_t offset_ = 0;
  uint64_t first_value_ = 0;
  Image flip_;
};

}  // namespace

double relative_weight(std::span<const Image> references, std::span<const Image> denominators, size_t p) {
  double grey = 0, sum = 0;
  for (size_t i = 3 * p; i < 3 * p + 3; ++i)
    grey += (static_cast<double>(references.front().data[i]) + references.back().data[i]) / 6;
  if (denominators.empty()) return weight_of(grey);
  for (const Image& image : denominators) {
    const float* d = &image.data[3 * p];
    sum += weight_of((static_cast<double>(d[0]) + d[1] + d[2]) / 3);
  }
  return sum / static_cast<double>(denominators.size());
}

bool pixel_is_finite(const Image& image, size_t p) {
  const float* v = image.data.data() + p * 3;
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

const std::vector<MetricInfo>& metrics() {
  static const std::vector<MetricInfo> all{
      {Metric::kRelMse, "relmse", "1/(3N) sum ||F - R||^2 / (R'^2 + 0.01), R' = mean of R's RGB",
       "1/(3N) sum (F - R1).(F - R2) / (D'^2 + 0.01), D' = mean of RGB of the denoised references"},
      {Metric::kRelMseTrimmed, "relmse-trimmed",
       "mean over pixels and channels of (F - R)^2 / (R^2 + 0.01), without the largest 0.1 %",
       "mean over pixels and channels of (F - R1)(F - R2) / (D^2 + 0.01), D = denoised references, without the largest "
       "0.1 %"},
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
  throw Error(ErrorCode::kUsage,
              fmt::format("unknown metric '{}'", name) +
                  hint_and_list(name, names, fmt::format("expected one of {}", fmt::join(names, ", "))));
}

MetricResult compute_metric(Metric metric, ComparedRows& rows, bool low_dynamic_range, bool with_map) {
  MetricResult result;
  if (with_map) result.map = Image(rows.width(), rows.height(), 1);
  ErrorOfPixels errors(metric, rows, low_dynamic_range);
  double sum = 0, image_sum = 0, squared_noise = 0;
  size_t n_references = 1;
  std::array<double, 2> reference_sums{};
  float* map = result.map.data.data();
  for (int y = 0; y < rows.height(); y += rows.band_rows()) {
    const int n_rows = std::min(rows.band_rows(), rows.height() - y);
    const ComparedRows::Band& band = errors.move_to(y, n_rows);
    const size_t n_pixels = static_cast<size_t>(n_rows) * static_cast<size_t>(rows.width());
    for (size_t i = 0; i < n_pixels; ++i) {
      const size_t p = errors.in_band(i);
      const bool finite = is_finite(band, p);
      ++(finite ? result.n_pixels : result.n_non_finite);
      const double error = finite ? errors.error(p) : std::numeric_limits<double>::quiet_NaN();
      if (with_map) *map++ = finite ? map_value(error) : std::numeric_limits<float>::quiet_NaN();
      if (!finite) continue;
      sum += error;
      squared_noise += errors.squared_noise(p);
      for (size_t k = 3 * p; k < 3 * p + 3; ++k) {
        image_sum += band.image->data[k];
        for (size_t r = 0; r < band.references.size(); ++r) reference_sums[r] += band.references[r]->data[k];
      }
      n_references = band.references.size();
    }
  }
  if (result.n_pixels == 0)
    throw Error(ErrorCode::kInput,
                fmt::format("none of the {} pixels is finite in the image and the reference", result.n_non_finite));
  const auto n = static_cast<double>(result.n_pixels);
  result.value = sum / n;
  result.reference_error = std::sqrt(squared_noise) / n;
  result.mean = image_sum / (3 * n);
  for (size_t r = 0; r < n_references; ++r)
    result.reference_mean += reference_sums[r] / (3 * n) / static_cast<double>(n_references);
  return result;
}

MetricResult compute_metric(Metric metric, const Image& image, std::span<const Image> references,
                            bool low_dynamic_range, std::span<const Image> denominators) {
  WholeImages rows(image, references);
  rows.set_denominators(denominators);
  return compute_metric(metric, rows, low_dynamic_range, true);
}

}  // namespace covary
