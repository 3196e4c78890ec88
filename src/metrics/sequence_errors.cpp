// SPDX-License-Identifier: Apache-2.0
#include "metrics/sequence_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "core/error.h"
#include "metrics/flip.h"
#include "metrics/metrics.h"

namespace covary {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kResolved = 4;        // a region's error is resolved if it exceeds 0 by this many standard errors
constexpr int kStillSide = 8;          // side of the blocks that are classified as unchanged or not
constexpr double kStillChange = 1e-3;  // largest relative squared change of an unchanged block

double square(double x) { return x * x; }

/// Contribution of a pixel to the errors of its region: a product, and its variance due to noise in the references.
struct PixelError {
  double error = 0, noise = 0;
};

/// Per channel, with a = F - R1 and b = F - R2, F - R = (a + b) / 2 and R1 - R2 = b - a, so that
/// ab = (F - R)^2 - (R1 - R2)^2 / 4. Its noise comes from the cross term (F - R)(R1 - R2), whose square estimates its
/// variance, and from the last term.
template <typename Difference>
PixelError pixel_error(double w, const Difference& difference) {
  PixelError result;
  double across = 0, own = 0;
  for (int c = 0; c < 3; ++c) {
    const auto [a, b] = difference(c);
    result.error += w * a * b / 3;
    across += w * (a + b) / 2 * (b - a) / 3;
    own += w * square(b - a) / 4 / 3;
  }
  result.noise = square(across) + square(own);
  return result;
}

/// First pixels of the regions along one side.
std::vector<int> region_starts(int size) {
  std::vector<int> starts;
  for (int start = 0; start + kRegionSide <= size; start += kRegionSide) starts.push_back(start);
  const int last = std::max(size - kRegionSide, 0);
  if (starts.empty() || starts.back() != last) starts.push_back(last);
  return starts;
}

RegionErrors regions_of(const std::vector<PixelError>& errors, int width, int height) {
  const std::vector<int> xs = region_starts(width), ys = region_starts(height);
  RegionErrors regions{static_cast<int>(xs.size()), static_cast<int>(ys.size()), {}, {}};
  for (const int y0 : ys)
    for (const int x0 : xs) {
      const int x1 = std::min(x0 + kRegionSide, width), y1 = std::min(y0 + kRegionSide, height);
      const double n = static_cast<double>(x1 - x0) * (y1 - y0);
      double error = 0, noise = 0;
      for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x) {
          const PixelError& pixel = errors[static_cast<size_t>(y) * width + x];
          error += pixel.error, noise += pixel.noise;
        }
      regions.error.push_back(error / n);
      regions.noise.push_back(noise / (n * n));  // noise is independent between pixels of the references
    }
  return regions;
}

double mean(const std::vector<PixelError>& errors, uint64_t n_left_out) {
  double sum = 0;
  for (const PixelError& pixel : errors) sum += pixel.error;
  return sum / static_cast<double>(errors.size() - n_left_out);
}

/// Whether the pixel is finite in the frame and in its references.
bool is_finite(const Image& frame, const std::vector<Image>& references, size_t p) {
  return pixel_is_finite(frame, p) && pixel_is_finite(references.front(), p) && pixel_is_finite(references.back(), p);
}

Image mean_of(const std::vector<Image>& references) {
  Image result = references.front();
  for (size_t i = 0; i < result.data.size(); ++i)
    result.data[i] = 0.5f * result.data[i] + 0.5f * references.back().data[i];
  return result;
}

/// Weighted mean over frames of the finite values.
double mean_of_frames(std::span<const FrameErrors> frames, const std::function<double(const FrameErrors&)>& value,
                      const std::function<double(const FrameErrors&)>& weight_of = {}) {
  double sum = 0, n = 0;
  for (const FrameErrors& frame : frames) {
    const double v = value(frame), w = weight_of ? weight_of(frame) : 1;
    if (std::isfinite(v) && std::isfinite(w)) sum += w * v, n += w;
  }
  return n > 0 ? sum / n : kNan;
}

void take_worst(const RegionErrors& tested, const RegionErrors& other, int frame, WorstRegion& worst) {
  for (size_t i = 0; i < tested.error.size(); ++i) {
    if (!(other.error[i] > kResolved * std::sqrt(other.noise[i])) || other.error[i] <= 0) {
      ++worst.left_out;
      continue;
    }
    const double ratio = tested.error[i] / other.error[i];
    if (ratio <= worst.ratio) continue;
    const int region = static_cast<int>(i);
    worst.ratio = ratio, worst.frame = frame;
    worst.column = region % tested.columns, worst.row = region / tested.columns;
  }
}

/// Means over frames. The references of all frames may share a seed, so averaging is not taken to reduce their noise.
RegionErrors mean_of(std::span<const RegionErrors* const> frames) {
  RegionErrors result;
  double n = 0;
  for (const RegionErrors* frame : frames) {
    if (frame->empty()) continue;
    if (n++ == 0) {
      result = *frame;
      continue;
    }
    for (size_t i = 0; i < result.error.size(); ++i)
      result.error[i] += frame->error[i], result.noise[i] += frame->noise[i];
  }
  for (size_t i = 0; i < result.error.size(); ++i) result.error[i] /= n, result.noise[i] /= n;
  return result;
}

WorstRegion nothing_found() { return {-std::numeric_limits<double>::infinity(), -1, 0, 0, 0}; }
WorstRegion found(WorstRegion worst) {
  if (!std::isfinite(worst.ratio)) worst.ratio = kNan;
  return worst;
}

}  // namespace

void SequenceErrors::add(Image frame, std::vector<Image> references, bool low_dynamic_range,
                         std::vector<Image> denominators) {
  COVARY_CHECK(references.size() == 1 || references.size() == 2, "one or two references");
  for (const Image* image : {&references.front(), &references.back(), frames_.empty() ? &frame : &before_})
    if (image->width != frame.width || image->height != frame.height)
      throw Error(ErrorCode::kInput,
                  fmt::format("a frame of {} x {} pixels; its reference or the frame before has {} x "
                              "{}",
                              frame.width, frame.height, image->width, image->height));
  FrameErrors errors;
  for (const Image& image : denominators)
    COVARY_CHECK(image.width == frame.width && image.height == frame.height, "denominators have the frame's size");
  Weights weights(frame.data.size() / 3);
  std::vector<PixelError> of_pixels(weights.size());
  for (size_t p = 0; p < of_pixels.size(); ++p) {
    weights[p] = relative_weight(references, denominators, p);
    if (!is_finite(frame, references, p) || !std::isfinite(weights[p])) {
      ++errors.n_non_finite;
      continue;
    }
    of_pixels[p] = pixel_error(weights[p], [&](int c) {
      const double f = frame.data[3 * p + c];
      return std::pair(f - references.front().data[3 * p + c], f - references.back().data[3 * p + c]);
    });
  }
  errors.relmse = mean(of_pixels, errors.n_non_finite);
  errors.regions = regions_of(of_pixels, frame.width, frame.height);
  errors.temporal = errors.temporal_flip = errors.still_relmse = kNan;
  if (!frames_.empty()) {
    add_changes(frame, references, weights, low_dynamic_range, errors);
    add_still(frame, references, weights, errors);
  }
  frames_.push_back(std::move(errors));
  before_ = std::move(frame), references_before_ = std::move(references), weights_before_ = std::move(weights);
}

void SequenceErrors::add_changes(const Image& frame, const std::vector<Image>& references, const Weights& weights,
                                 bool low_dynamic_range, FrameErrors& errors) const {
  Image f = frame, f_before = before_, r = mean_of(references), r_before = mean_of(references_before_);
  std::vector<PixelError> of_pixels(frame.data.size() / 3);
  uint64_t left_out = 0;
  for (size_t p = 0; p < of_pixels.size(); ++p) {
    if (!is_finite(frame, references, p) || !is_finite(before_, references_before_, p) ||
        !std::isfinite(weights[p] + weights_before_[p])) {
      ++left_out;
      for (Image* image : {&f, &f_before, &r, &r_before}) std::fill_n(image->data.begin() + 3 * p, 3, 0.0f);
      continue;
    }
    const double w = std::min(weights[p], weights_before_[p]);
    of_pixels[p] = pixel_error(w, [&](int c) {
      const size_t i = 3 * p + c;
      const double change = static_cast<double>(frame.data[i]) - before_.data[i];
      return std::pair(change - (static_cast<double>(references.front().data[i]) - references_before_.front().data[i]),
                       change - (static_cast<double>(references.back().data[i]) - references_before_.back().data[i]));
    });
  }
  errors.temporal = mean(of_pixels, left_out);
  errors.temporal_regions = regions_of(of_pixels, frame.width, frame.height);
  // The same exposures for both, so that they are comparable.
  const FlipExposures exposures = low_dynamic_range ? FlipExposures() : flip_exposures(r);
  const auto flip = [&](const Image& image, const Image& before) {
    return low_dynamic_range ? flip_ldr(image, before) : flip_hdr(image, before, exposures);
  };
  const Image of_frame = flip(f, f_before), of_reference = flip(r, r_before);
  double sum = 0;
  for (size_t p = 0; p < of_frame.data.size(); ++p)
    sum += std::abs(static_cast<double>(of_frame.data[p]) - of_reference.data[p]);
  errors.temporal_flip = sum / static_cast<double>(of_frame.data.size() - left_out);
}

void SequenceErrors::add_still(const Image& frame, const std::vector<Image>& references, const Weights& weights,
                               FrameErrors& errors) const {
  double sum = 0, n = 0;
  for (int y0 = 0; y0 + kStillSide <= frame.height; y0 += kStillSide)
    for (int x0 = 0; x0 + kStillSide <= frame.width; x0 += kStillSide) {
      double change = 0, error = 0;
      bool finite = true;
      for (int y = y0; y < y0 + kStillSide; ++y)
        for (int x = x0; x < x0 + kStillSide; ++x) {
          const size_t p = static_cast<size_t>(y) * frame.width + x;
          finite = finite && is_finite(frame, references, p) && is_finite(before_, references_before_, p) &&
                   std::isfinite(weights[p] + weights_before_[p]);
          const double w = weights[p], w_change = std::min(w, weights_before_[p]);
          for (size_t i = 3 * p; i < 3 * p + 3; ++i) {
            const double r1 = references.front().data[i], r2 = references.back().data[i], f = frame.data[i];
            change += w_change * (r1 - references_before_.front().data[i]) * (r2 - references_before_.back().data[i]);
            error += w * (f - r1) * (f - r2);
          }
        }
      if (finite && change <= kStillChange * 3 * square(kStillSide)) sum += error / 3, n += square(kStillSide);
    }
  errors.still_part = n / (static_cast<double>(frame.width) * frame.height);
  if (n > 0) errors.still_relmse = sum / n;
}

std::vector<FrameErrors> mean_over_renders(std::span<const std::vector<FrameErrors>> renders) {
  std::vector<FrameErrors> result(renders.empty() ? 0 : renders[0].size());
  for (size_t f = 0; f < result.size(); ++f) {
    std::vector<FrameErrors> of_frame;
    std::vector<const RegionErrors*> regions, temporal_regions;
    for (const std::vector<FrameErrors>& frames : renders) of_frame.push_back(frames[f]);
    for (const FrameErrors& frame : of_frame)
      regions.push_back(&frame.regions), temporal_regions.push_back(&frame.temporal_regions);
    const SequenceSummary mean = summary_of(of_frame);
    result[f] = {mean.relmse, mean.temporal,    mean.temporal_flip,       mean.still_relmse, of_frame[0].still_part,
                 0,           mean_of(regions), mean_of(temporal_regions)};
    for (const FrameErrors& frame : of_frame) result[f].n_non_finite += frame.n_non_finite;
  }
  return result;
}

SequenceSummary summary_of(std::span<const FrameErrors> frames) {
  const auto part = [](const FrameErrors& f) { return f.still_part; };
  return {mean_of_frames(frames, [](const FrameErrors& f) { return f.relmse; }),
          mean_of_frames(frames, [](const FrameErrors& f) { return f.temporal; }),
          mean_of_frames(frames, [](const FrameErrors& f) { return f.temporal_flip; }),
          mean_of_frames(
              frames, [](const FrameErrors& f) { return f.still_relmse; }, part),
          mean_of_frames(frames.subspan(std::min<size_t>(1, frames.size())), part)};
}

WorstRegion worst_region_of_means(std::span<const RegionErrors* const> tested,
                                  std::span<const RegionErrors* const> other) {
  WorstRegion worst = nothing_found();
  take_worst(mean_of(tested), mean_of(other), -1, worst);
  return found(worst);
}

WorstRegion worst_region_of_frames(std::span<const RegionErrors* const> tested,
                                   std::span<const RegionErrors* const> other) {
  WorstRegion worst = nothing_found();
  for (size_t f = 0; f < tested.size(); ++f) take_worst(*tested[f], *other[f], static_cast<int>(f), worst);
  return found(worst);
}

WorstRegions worst_regions(std::span<const FrameErrors> tested, std::span<const FrameErrors> other) {
  COVARY_CHECK(tested.size() == other.size(), "equally many frames");
  std::vector<const RegionErrors*> a, b, a_changes, b_changes;
  for (const FrameErrors& frame : tested) a.push_back(&frame.regions), a_changes.push_back(&frame.temporal_regions);
  for (const FrameErrors& frame : other) b.push_back(&frame.regions), b_changes.push_back(&frame.temporal_regions);
  return {worst_region_of_means(a, b), worst_region_of_frames(a, b), worst_region_of_means(a_changes, b_changes),
          worst_region_of_frames(a_changes, b_changes)};
}

}  // namespace covary
