// SPDX-License-Identifier: Apache-2.0
#include "passes/splat_filter.h"

#include <cmath>

#include "core/error.h"

namespace covary {
namespace {

constexpr double kFarthest = 1 << 24;  // pixels from the frame's corner: too far from any frame

}  // namespace

SplatFilter::SplatFilter(const FilterSettings& filter) : filter_(filter) {
  if (filter.kind == FilterKind::kGaussian)
    scale_ = 1 / (filter.stddev * std::sqrt(2 * M_PI) * std::erf(filter.radius / (filter.stddev * std::sqrt(2.0))));
}

double SplatFilter::density(double distance) const {
  const double radius = filter_.radius;
  switch (filter_.kind) {
    case FilterKind::kBox:
      return 1 / (2 * radius);
    case FilterKind::kTent:
      return std::max(0.0, 1 - std::abs(distance) / radius) / radius;
    case FilterKind::kGaussian:
      return scale_ * std::exp(-distance * distance / (2.0 * filter_.stddev * filter_.stddev));
    case FilterKind::kLobed:
      return filter_.lobed->value(distance);
  }
  throw Error(ErrorCode::kInternal, "unknown reconstruction filter");
}

SplatFilter::Choice SplatFilter::choose(double position, double u) const {
  if (!(std::abs(position) < kFarthest)) return {};
  // Centres within the radius; of two at both ends, only the lower: a box of one pixel includes its upper left corner.
  const int first = static_cast<int>(std::floor(position - filter_.radius - 0.5)) + 1;
  const int last = static_cast<int>(std::floor(position + filter_.radius - 0.5));
  double sum = 0;
  for (int pixel = first; pixel <= last; ++pixel) sum += std::abs(density(pixel + 0.5 - position));
  if (!(sum > 0)) return {};
  double left = u * sum;
  int chosen = first;
  for (; chosen < last; ++chosen) {
    left -= std::abs(density(chosen + 0.5 - position));
    if (left < 0) break;
  }
  return {chosen, static_cast<float>(density(chosen + 0.5 - position) < 0 ? -sum : sum)};
}

SplatPixel SplatFilter::pixel(Vec2 film, Vec2 u) const {
  const Choice x = choose(film.x, u.x), y = choose(film.y, u.y);
  return {x.pixel, y.pixel, x.weight * y.weight};
}

}  // namespace covary
