// SPDX-License-Identifier: Apache-2.0
// Radiance of a clear sky [HosekWilkie2012] and of the sun's disk [HosekWilkie2013], in RGB as in Mitsuba. z is up;
// below the horizon all is black. The coefficients are the authors' (data/pack.py).
#pragma once

#include <array>

#include "core/spectrum.h"
#include "core/vec.h"

namespace covary {

/// Half of the angular diameter of the sun that the model was fitted to, in radians.
inline constexpr double kSunHalfAngle = 0.5 * 0.5358 * 3.14159265358979323846 / 180;

/// W / (m² sr nm), scaled so that a constant spectrum of 1 has luminance 1.
class SkyModel {
 public:
  /// `turbidity` in [1, 10]; `albedo` of the ground, each channel in [0, 1]; `sun` unit, z > 0.
  SkyModel(float turbidity, const Spectrum& albedo, const Vec3& sun);
  /// Radiance in unit direction `w`; not negative.
  Spectrum radiance(const Vec3& w) const;

 private:
  Vec3 sun_;
  /// [HosekWilkie2012] A to I, and the mean radiance.
  std::array<std::array<float, 10>, 3> channels_;
};

class SunModel {
 public:
  /// `half_angle` (radians, in (0, pi/2)): angular radius of the disk, over which the same irradiance is spread;
  /// `limb_darkening`: the disk is brighter at its centre.
  SunModel(float turbidity, const Vec3& sun, float half_angle, bool limb_darkening);
  /// Radiance in unit direction `w` within the disk, if above the horizon; not negative.
  Spectrum radiance(const Vec3& w) const;
  bool on_disk(const Vec3& w) const { return dot(w - sun_, w - sun_) <= largest_chord2_; }
  /// 1 − cos of the disk's half angle.
  float one_minus_cos() const { return one_minus_cos_; }

 private:
  Vec3 sun_;
  float turbidity_;
  float one_minus_cos_, largest_chord2_;
  double sin2_, spread_;  // of the half angle; factor on radiance
  bool limb_darkening_;
  Spectrum mean_;  // without limb darkening
};

struct SunTime {
  double latitude, longitude;  ///< degrees, to the north and to the east
  double timezone;             ///< hours ahead of UTC
  int year, month, day;        ///< Gregorian calendar
  double hour, minute, second;
};

/// Direction of the sun, a unit vector: z up, x south, y west, as in Mitsuba; z < 0 at night. Accurate to 0.01 degrees
/// for the years 1999 to 2015 [BlancoMuriel2001], slightly worse around them.
Vec3 sun_position(const SunTime& time);

}  // namespace covary
