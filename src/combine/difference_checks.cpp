// SPDX-License-Identifier: Apache-2.0
#include "combine/difference_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "film/groups.h"

namespace covary {
namespace {

// Beyond any pixel filter, but within the reach of denoisers. Measured correlations of signs of differences at this
// distance: at most 0.02 for the noise of any sampler; 0.16 to 0.51 for Open Image Denoise; 0.08 to 0.26 for our own
// filters.
constexpr int kDistance = 6;
constexpr double kMaxCorrelation = 0.07;
// Of neighbours: at most 0.01 for a box filter, 0.19 for a tent, 0.25 for Mitsuba's Gaussian.
constexpr double kMaxOfNeighbours = 0.1;
constexpr double kMaxExcess = 0.05;  // of the fraction of pixels in which one render is brighter, above one half
constexpr double kSigmas = 6;
constexpr double kMostlyBrighter = 0.9;
constexpr long kMaxPixels = 1000000;
constexpr int kMaxPairs = 12;

/// Sign of the difference of groups t and t + 1 in a pixel; 0 if undecided.
int sign_of_difference(const GroupedImage& image, int x, int y, int t) {
  const uint32_t count = image.count(x, y);
  if (group_size(count, image.groups, t) != group_size(count, image.groups, t + 1)) return 0;
  const float* p = image.pixel(x, y) + 3 * t;
  const float difference = (p[0] + p[1] + p[2]) - (p[3] + p[4] + p[5]);
  return difference > 0 ? 1 : difference < 0 ? -1 : 0;
}

}  // namespace

double DifferenceChecks::Pair::excess_brighter() const {
  return differ > 0 ? std::abs(static_cast<double>(brighter) / static_cast<double>(differ) - 0.5) : 0;
}

/// Correlation of the signs beyond what their mean implies.
double DifferenceChecks::Pair::correlation(const Signs& signs) const {
  if (signs.n == 0) return 0;
  const double mean = 2 * excess_brighter();
  return 2 * static_cast<double>(signs.same) / static_cast<double>(signs.n) - 1 - mean * mean;
}

DifferenceChecks::DifferenceChecks(int width, int height, int groups)
    : pairs_(std::clamp(groups - 1, 0, kMaxPairs)),
      // Uses one row in `step_`, an odd number.
      step_(static_cast<int>(std::max(1L, long{width} * height / kMaxPixels)) | 1) {}

void DifferenceChecks::add_rows(const GroupedImage& image) {
  std::vector<int> signs(image.width);
  for (size_t t = 0; t < pairs_.size(); ++t)
    for (int y = 0; y < image.height; y += step_) {
      Pair& pair = pairs_[t];
      for (int x = 0; x < image.width; ++x) {
        signs[x] = sign_of_difference(image, x, y, static_cast<int>(t));
        pair.differ += signs[x] != 0;
        pair.brighter += signs[x] > 0;
        for (const auto& [distance, of] : {std::pair{kDistance, &pair.far}, {1, &pair.next}}) {
          if (x < distance || signs[x] == 0 || signs[x - distance] == 0) continue;
          ++of->n;
          of->same += signs[x] == signs[x - distance];
        }
      }
    }
}

void DifferenceChecks::report(const ImageNames& names, std::vector<Finding>& findings) const {
  for (size_t t = 0; t < pairs_.size(); ++t) {
    const Pair& pair = pairs_[t];
    const double brighter = 0.5 + pair.excess_brighter(), correlation = pair.correlation(pair.far);
    const double deviation = 0.5 / std::sqrt(static_cast<double>(std::max(1L, pair.differ)));
    const bool is_brighter = brighter - 0.5 > std::max(kMaxExcess, kSigmas * deviation);
    const bool is_correlated =
        correlation > std::max(kMaxCorrelation, kSigmas / std::sqrt(static_cast<double>(std::max(1L, pair.far.n))));
    if (is_correlated && brighter < kMostlyBrighter)
      findings.push_back(
          {Finding::Severity::kError,
           fmt::format("differences of {} and {} are correlated {} pixels apart (signs by {:.2f}; noise by 0): "
                       "they were denoised before, their pixels share random numbers, or they show different scenes, "
                       "lights or exposures (one is brighter in {:.0f} % of the pixels); render both without a "
                       "denoiser ({}), differing only in the seed ({})",
                       names.render(t), names.render(t + 1), kDistance, correlation, 100 * brighter,
                       names.how_to(RenderSetting::kNoDenoiser), names.how_to(RenderSetting::kSeed))});
    else if (is_brighter)
      findings.push_back(
          {Finding::Severity::kError,
           fmt::format("one of {} and {} is brighter in {:.0f} % of the pixels that differ; if only their "
                       "seeds differed, it would be one half: exposure, lights or numbers of samples differ, or their "
                       "pixels share random numbers; change only the seed ({})",
                       names.render(t), names.render(t + 1), 100 * brighter, names.how_to(RenderSetting::kSeed))});
    else
      continue;
    return;  // one such pair is enough
  }
  warn_of_filter(names, findings);
}

void DifferenceChecks::warn_of_filter(const ImageNames& names, std::vector<Finding>& findings) const {
  if (pairs_.empty()) return;
  const Pair& pair = pairs_[0];
  const double correlation = pair.correlation(pair.next);
  const double deviation = 1 / std::sqrt(static_cast<double>(std::max(1L, pair.next.n)));
  if (correlation <= std::max(kMaxOfNeighbours, kSigmas * deviation)) return;
  findings.push_back(
      {Finding::Severity::kWarning,
       fmt::format("differences of {} and {} are correlated between neighbouring pixels (signs by {:.2f}; noise by 0): "
                   "the pixel filter is wider than a pixel, which leaves blotches in denoised pictures; render with a "
                   "box filter: in Mitsuba <rfilter type=\"box\"/>, in pbrt PixelFilter \"box\" \"float xradius\" 0.5 "
                   "\"float yradius\" 0.5",
                   names.render(0), names.render(1), correlation)});
}

}  // namespace covary
