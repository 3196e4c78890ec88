// SPDX-License-Identifier: Apache-2.0
#include "io/studio.h"

#include <array>
#include <cmath>
#include <vector>

#include "core/vec.h"

namespace covary {
namespace {

constexpr int kWidth = 256, kHeight = 128;
constexpr double kZenith = 0.6;  // radiance of the ceiling, before scaling

/// A soft light: peak * exp((cos(angle to d) - 1) / width).
struct SoftLight {
  double azimuth, elevation, peak, width;  ///< degrees; azimuth from the viewer to the right
};
constexpr std::array kLights = {SoftLight{-40, 50, 11, 0.035}, SoftLight{70, 20, 0.9, 0.12},
                                SoftLight{155, 35, 2.4, 0.05}};

struct Direction {
  double x, y, z;
};
Direction towards(double azimuth, double elevation) {
  const double a = azimuth * M_PI / 180, e = elevation * M_PI / 180;
  return {std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e)};
}

double smoothstep(double x) {
  const double t = std::min(std::max(x, 0.0), 1.0);
  return t * t * (3 - 2 * t);
}

/// Light from a direction without that of the horizon, and the share that the horizon has in it.
struct Parts {
  double lights, horizon;
};
Parts parts_at(const Direction& d) {
  if (d.y <= 0) return {0, 1};
  const double rise = smoothstep(d.y / 0.8);
  double sum = kZenith * rise;
  for (const SoftLight& light : kLights) {
    const Direction c = towards(light.azimuth, light.elevation);
    sum += light.peak * std::exp((d.x * c.x + d.y * c.y + d.z * c.z - 1) / light.width) * smoothstep(d.y / 0.1);
  }
  return {sum, 1 - rise};
}

}  // namespace

std::string studio_environment() {
  // environment_image.h: column i is centred at u = (i + 0.5) / width, u = atan2(x, -z) / 2 pi; row j at v = j /
  // (height - 1), v = acos(y) / pi.
  std::vector<Parts> parts;
  double from_lights = 0, from_horizon = 0;  // irradiance of the floor
  for (int j = 0; j < kHeight; ++j)
    for (int i = 0; i < kWidth; ++i) {
      const double theta = M_PI * j / (kHeight - 1), phi = 2 * M_PI * (i + 0.5) / kWidth;
      const Direction d{std::sin(phi) * std::sin(theta), std::cos(theta), -std::cos(phi) * std::sin(theta)};
      parts.push_back(parts_at(d));
      const double weight = std::max(d.y, 0.0) * std::sin(theta) * (M_PI / (kHeight - 1)) * (2 * M_PI / kWidth);
      from_lights += weight * parts.back().lights, from_horizon += weight * parts.back().horizon;
    }
  // The floor reflects what the horizon shows: rho (s lights + horizon kStudioHorizon) / pi = kStudioHorizon.
  const double scale = kStudioHorizon * (M_PI / kStudioFloor - from_horizon) / from_lights;
  std::string text = "PF\n" + std::to_string(kWidth) + " " + std::to_string(kHeight) + "\n-1.0\n";
  for (int j = kHeight - 1; j >= 0; --j)
    for (int i = 0; i < kWidth; ++i) {
      const Parts& p = parts[static_cast<size_t>(j) * kWidth + i];
      const auto value = static_cast<float>(scale * p.lights + kStudioHorizon * p.horizon);
      for (int c = 0; c < 3; ++c) text.append(reinterpret_cast<const char*>(&value), sizeof(value));
    }
  return text;
}

}  // namespace covary
