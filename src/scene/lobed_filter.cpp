// SPDX-License-Identifier: Apache-2.0
#include "scene/lobed_filter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>

#include "core/trigonometry.h"

namespace covary {

LobedFilter::LobedFilter(std::string text, float radius, int lobes, double b, double c)
    : text_(std::move(text)), radius_(radius), lobes_(lobes), b_(b), c_(c) {
  constexpr int kSteps = 16;  // per cell
  const double width = 2.0 * radius / kCells;
  double integral = 0;
  for (int i = 0; i < kCells; ++i) {
    double largest = 0;
    for (int k = 0; k <= kSteps; ++k) {
      const double x = shape((i + static_cast<double>(k) / kSteps) * width - radius);
      // The largest magnitude: no weight is then larger than those of cells around it.
      largest = std::max(largest, std::abs(x));
      integral += x * (k == 0 || k == kSteps ? 0.5 : 1) * width / kSteps;
    }
    sums_[i + 1] = sums_[i] + largest;
  }
  scale_ = 1 / integral;
  for (double& sum : sums_) sum /= sums_[kCells];
  sums_[kCells] = 1;
}

double LobedFilter::shape(double x) const {
  const double d = std::abs(x);
  if (!(d < radius_)) return 0;
  if (lobes_ > 0) {
    if (d < 1e-4) return 1;
    const auto sinc = [](double t) { return sincos_turns(static_cast<float>(t / 2)).sin / (M_PI * t); };
    return sinc(d) * sinc(d / lobes_);
  }
  if (d < 1) return ((12 - 9 * b_ - 6 * c_) * d * d * d + (-18 + 12 * b_ + 6 * c_) * d * d + (6 - 2 * b_)) / 6;
  return ((-b_ - 6 * c_) * d * d * d + (6 * b_ + 30 * c_) * d * d + (-12 * b_ - 48 * c_) * d + (8 * b_ + 24 * c_)) / 6;
}

double LobedFilter::value(double distance) const { return shape(distance) * scale_; }

LobedFilter::Sample LobedFilter::sample(float u) const {
  const double at = std::clamp(static_cast<double>(u), 0.0, 1.0);
  const auto next = std::upper_bound(sums_.begin() + 1, sums_.end() - 1, at);
  const auto cell = static_cast<double>(next - sums_.begin() - 1);
  const double mass = *next - next[-1], width = 2.0 * radius_ / kCells;
  const auto offset = static_cast<float>((cell + (mass > 0 ? (at - next[-1]) / mass : 0.5)) * width - radius_);
  return {offset, mass > 0 ? static_cast<float>(value(offset) * width / mass) : 0};
}

const LobedFilter& LobedFilter::shared(const std::string& text, float radius, int lobes, double b, double c) {
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<const LobedFilter>> known;
  const std::lock_guard lock(mutex);
  std::unique_ptr<const LobedFilter>& filter = known[text];
  if (!filter) filter.reset(new LobedFilter(text, radius, lobes, b, c));
  return *filter;
}

const LobedFilter& LobedFilter::mitchell(float b, float c) {
  return shared(fmt::format("mitchell B={} C={}", b, c), 2, 0, b, c);
}
const LobedFilter& LobedFilter::catmull_rom() { return shared("catmullrom", 2, 0, 0, 0.5); }
const LobedFilter& LobedFilter::lanczos(int lobes) {
  return shared(fmt::format("lanczos lobes={}", lobes), static_cast<float>(lobes), lobes, 0, 0);
}

}  // namespace covary
