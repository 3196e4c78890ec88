// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/vec.h"

namespace covary {

struct SunTime {
  double latitude, longitude;  ///< degrees, to the north and to the east
  double timezone;             ///< hours ahead of universal time
  int year, month, day;        ///< of the Gregorian calendar
  double hour, minute, second;
};

/// Where the sun stands, as a unit vector: z up, x to the south, y to the west, as Mitsuba has it; z < 0 at night.
/// Within 0.01 degrees for the years 1999 to 2015 [BlancoMuriel2001], and little more around them.
Vec3 sun_position(const SunTime& time);

}  // namespace covary
