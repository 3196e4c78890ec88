// SPDX-License-Identifier: Apache-2.0
#include "film/exposure.h"

#include <algorithm>
#include <cmath>

namespace covary {
namespace {

constexpr double kBurnt = 1.001, kBlack = 0.0015;
constexpr double kDarkestMedian = 0.09;  // one stop below middle grey
constexpr int kMaxHalfStops = 60;

}  // namespace

double exposure_for_display(const Image& linear) {
  std::vector<double> logs;  // base 2, of the lit pixels
  double sum = 0;
  for (size_t i = 0; i + 2 < linear.data.size(); i += 3) {
    const double l = luminance(Spectrum(linear.data[i], linear.data[i + 1], linear.data[i + 2]));
    if (!(l > 0) || !std::isfinite(l)) continue;
    logs.push_back(std::log2(l));
    sum += logs.back();
  }
  if (logs.empty()) return 0;
  std::sort(logs.begin(), logs.end());
  const auto n_lost = [&](double stops) {  // black, burnt
    const auto black = std::lower_bound(logs.begin(), logs.end(), std::log2(kBlack) - stops);
    const auto burnt = std::upper_bound(logs.begin(), logs.end(), std::log2(kBurnt) - stops);
    return (black - logs.begin()) + (logs.end() - burnt);
  };
  const auto is_good = [&](double stops) {
    return static_cast<double>(n_lost(stops)) <= 0.1 * static_cast<double>(logs.size());
  };
  const double darkest = std::min(0.0, std::log2(kDarkestMedian) - logs[logs.size() / 2]);
  for (int half = 0; half <= kMaxHalfStops && -half / 2.0 >= darkest; ++half)
    if (is_good(-half / 2.0)) return half == 0 ? 0 : -half / 2.0;
  const bool is_dark = darkest == 0;
  const double wanted = is_dark ? std::log2(0.18) - sum / static_cast<double>(logs.size()) : 0;
  double best = 0;
  auto fewest = n_lost(0);
  for (int half = -kMaxHalfStops; half <= kMaxHalfStops; ++half) {
    const double stops = half / 2.0;
    if (stops < darkest) continue;
    const auto lost = n_lost(stops);
    if (lost < fewest || (lost == fewest && std::abs(stops - wanted) < std::abs(best - wanted)))
      best = stops, fewest = lost;
  }
  return best;
}

Image exposed(Image image, double stops) {
  const auto factor = static_cast<float>(std::exp2(stops));
  for (float& value : image.data) value *= factor;
  return image;
}

}  // namespace covary
