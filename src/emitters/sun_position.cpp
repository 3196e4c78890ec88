// SPDX-License-Identifier: Apache-2.0
#include "emitters/sun_position.h"

#include <cmath>
#include <numbers>

namespace covary {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// Radius of the Earth over the distance of the sun.
constexpr double kParallax = 6371.01 / 149597890;

/// Days from noon of 1 January 2000 to the beginning of a day.
double days_since_2000(int year, int month, int day) {
  // Fliegel and Van Flandern 1968, whose divisions round towards zero.
  const int january = (month - 14) / 12;
  const int julian = 1461 * (year + 4800 + january) / 4 + 367 * (month - 2 - 12 * january) / 12 -
                     3 * ((year + 4900 + january) / 100) / 4 + day - 32075;
  return julian - 0.5 - 2451545;
}

}  // namespace

Vec3 sun_position(const SunTime& time) {
  const double hours = time.hour - time.timezone + (time.minute + time.second / 60) / 60;
  const double days = days_since_2000(time.year, time.month, time.day) + hours / 24;

  // [BlancoMuriel2001]: where the sun stands before the stars,
  const double omega = 2.1429 - 0.0010394594 * days;
  const double longitude = 4.8950630 + 0.017202791698 * days, anomaly = 6.2400600 + 0.0172019699 * days;
  const double ecliptic = longitude + 0.03341607 * std::sin(anomaly) + 0.00034894 * std::sin(2 * anomaly) - 0.0001134 -
                          0.0000203 * std::sin(omega);
  const double obliquity = 0.4090928 - 6.2140e-9 * days + 0.0000396 * std::cos(omega);
  const double ascension = std::atan2(std::cos(obliquity) * std::sin(ecliptic), std::cos(ecliptic));
  const double declination = std::asin(std::sin(obliquity) * std::sin(ecliptic));

  // and how the Earth has turned.
  const double sidereal = ((6.6974243242 + 0.0657098283 * days + hours) * 15 + time.longitude) * kDegree;
  const double turn = sidereal - ascension, latitude = time.latitude * kDegree;
  const double zenith = std::acos(std::cos(latitude) * std::cos(turn) * std::cos(declination) +
                                  std::sin(declination) * std::sin(latitude));
  const double from_north =
      std::atan2(-std::sin(turn), std::tan(declination) * std::cos(latitude) - std::sin(latitude) * std::cos(turn));
  const double seen = zenith + kParallax * std::sin(zenith);
  return {static_cast<float>(-std::sin(seen) * std::cos(from_north)),
          static_cast<float>(-std::sin(seen) * std::sin(from_north)), static_cast<float>(std::cos(seen))};
}

}  // namespace covary
