// SPDX-License-Identifier: Apache-2.0
#include "emitters/sky_model.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "core/error.h"
#include "emitters/embedded.h"

namespace covary {
namespace {

constexpr double kPiD = std::numbers::pi;
constexpr int kTurbidities = 10, kControls = 6, kParameters = 9, kWavelengths = 11, kSegments = 45, kPowers = 4,
              kLimbPowers = 6;

struct Coefficients {
  float sky[3][2][kTurbidities][kControls][kParameters];
  float mean[3][2][kTurbidities][kControls];
  float sun[kWavelengths][kTurbidities][kSegments][kPowers];
  float limb[kWavelengths][kLimbPowers];
};

const Coefficients& coefficients() {
  static const Coefficients read = [] {
    Coefficients c;
    const std::string_view bytes = emitters_files::hosek_wilkie_f32;
    COVARY_CHECK(bytes.size() == sizeof(c), "coefficients of the sky");
    std::memcpy(&c, bytes.data(), sizeof(c));
    return c;
  }();
  return read;
}

/// Normalises Y of the constant spectrum 1 to 1.
constexpr double kNormalisationY = 1 / 106.7502593994140625;
/// Conversion between the units of the sun's spectra and of the sky's colours.
constexpr double kSunScale = 467.069280386;

/// Linear Rec. 709 RGB contribution of the wavelengths 320, 360, … 720 nm: CIE 1931 response divided by their number.
constexpr double kColours[kWavelengths][3] = {
    {0, 0, 0},
    {1.02504675e-05, -8.48827328e-06, 5.88423305e-05},
    {0.00108517621, -0.000937053264, 0.00658673489},
    {0.0202062745, -0.0201658056, 0.169261259},
    {-0.0280962963, 0.0183530527, 0.0760452},
    {-0.0841237957, 0.115807322, -0.00532864599},
    {0.0359142026, 0.117322766, -0.0150742306},
    {0.224699665, 0.0140218039, -0.00625417987},
    {0.107490848, -0.00962095512, -0.000978330871},
    {0.0114023321, -0.00122184147, -7.87340036e-05},
    {0.00070780111, -7.69115922e-05, -4.75375201e-06},
};

/// Linear interpolation between integer turbidities 1 to 10.
struct TurbidityPlace {
  int low;
  double weight;  // of low + 1
  explicit TurbidityPlace(float turbidity)
      : low(std::clamp(static_cast<int>(turbidity) - 1, 0, kTurbidities - 2)), weight(turbidity - 1 - low) {}
};

Spectrum not_negative(const double (&rgb)[3], double scale) {
  Spectrum result;
  for (int c = 0; c < 3; ++c) result[c] = static_cast<float>(std::max(rgb[c] * scale, 0.0));
  return result;
}

/// Radiance of the sun's disk where its elevation is `elevation` (radians), at angle psi from its centre; in RGB as in
/// Mitsuba, W / (m² sr nm), possibly negative.
void sun_radiance(float turbidity, double elevation, double cos_psi, double (&rgb)[3]) {
  const Coefficients& data = coefficients();
  const TurbidityPlace t(turbidity);
  // [HosekWilkie2013]: segments of equal length in the cube root of elevation, each a cubic polynomial.
  const int segment = std::clamp(static_cast<int>(std::cbrt(2 * elevation / kPiD) * kSegments), 0, kSegments - 1);
  const double x = elevation - kPiD / 2 * std::pow(static_cast<double>(segment) / kSegments, 3);
  for (double& channel : rgb) channel = 0;
  for (int wavelength = 0; wavelength < kWavelengths; ++wavelength) {
    double value = 0, limb = 0;
    for (int k = 0; k < kPowers; ++k)
      value = value * x + (1 - t.weight) * data.sun[wavelength][t.low][segment][k] +
              t.weight * data.sun[wavelength][t.low + 1][segment][k];
    for (int j = kLimbPowers - 1; j >= 0; --j) limb = limb * cos_psi + data.limb[wavelength][j];
    for (int c = 0; c < 3; ++c) rgb[c] += kColours[wavelength][c] * value * limb;
  }
}

/// Mean radiance over a disk at `elevation`, above the horizon.
std::array<double, 3> mean_over_disk(float turbidity, double elevation) {
  constexpr int kRings = 64, kTurns = 32;
  const double cap = 1 - std::cos(kSunHalfAngle);
  std::array<double, 3> sum{};
  for (int i = 0; i < kRings; ++i) {
    const double cos_gamma = 1 - cap * (i + 0.5) / kRings, sin_gamma = std::sqrt(1 - cos_gamma * cos_gamma);
    const double cos_psi = std::sqrt(std::max(0.0, 1 - std::pow(sin_gamma / std::sin(kSunHalfAngle), 2)));
    for (int j = 0; j < kTurns; ++j) {
      const double sine =
          std::sin(elevation) * cos_gamma + std::cos(elevation) * sin_gamma * std::cos(2 * kPiD * (j + 0.5) / kTurns);
      double rgb[3];
      sun_radiance(turbidity, std::asin(std::clamp(sine, -1.0, 1.0)), cos_psi, rgb);
      for (int c = 0; c < 3; ++c) sum[c] += rgb[c] / (kRings * kTurns);
    }
  }
  return sum;
}

}  // namespace

SkyModel::SkyModel(float turbidity, const Spectrum& albedo, const Vec3& sun) : sun_(sun) {
  const Coefficients& data = coefficients();
  const TurbidityPlace t(turbidity);
  // [HosekWilkie2012]: a quintic Bézier curve in the cube root of the sun's elevation.
  const double elevation = std::asin(std::clamp(sun.z, 0.0f, 1.0f));
  const double x = std::min(std::cbrt(2 * elevation / kPiD), 1.0);
  constexpr double kBinomials[kControls] = {1, 5, 10, 10, 5, 1};
  for (int c = 0; c < 3; ++c) {
    const auto curve = [&](const auto& of) {
      double sum = 0;
      for (int i = 0; i < kControls; ++i)
        for (int a = 0; a < 2; ++a)
          for (int k = 0; k < 2; ++k)
            sum += kBinomials[i] * std::pow(x, i) * std::pow(1 - x, kControls - 1 - i) *
                   (a ? albedo[c] : 1.0 - albedo[c]) * (k ? t.weight : 1 - t.weight) * of(data, c, a, t.low + k, i);
      return static_cast<float>(sum);
    };
    for (int p = 0; p < kParameters; ++p)
      channels_[c][p] =
          curve([p](const Coefficients& d, int channel, int a, int k, int i) { return d.sky[channel][a][k][i][p]; });
    channels_[c][kParameters] =
        curve([](const Coefficients& d, int channel, int a, int k, int i) { return d.mean[channel][a][k][i]; });
  }
}

Spectrum SkyModel::radiance(const Vec3& w) const {
  if (!(w.z >= 0)) return Spectrum(0);
  const float gamma = 2 * std::asin(std::min(0.5f * length(w - sun_), 1.0f));
  const float cosine = dot(w, sun_), cos2 = cosine * cosine;
  Spectrum result;
  for (int channel = 0; channel < 3; ++channel) {
    const auto& [a, b, c, d, e, f, g, i, h, mean] = channels_[channel];  // order of the data
    // [HosekWilkie2012], extended Perez formula.
    const float chi = (1 + cos2) / std::pow(1 + h * h - 2 * h * cosine, 1.5f);
    const float value = (1 + a * std::exp(b / (w.z + 0.01f))) *
                        (c + d * std::exp(e * gamma) + f * cos2 + g * chi + i * std::sqrt(w.z)) * mean;
    result[channel] = std::max(value * static_cast<float>(kNormalisationY), 0.0f);
  }
  return result;
}

SunModel::SunModel(float turbidity, const Vec3& sun, float half_angle, bool limb_darkening)
    : sun_(sun),
      turbidity_(turbidity),
      one_minus_cos_(2 * sqr(std::sin(half_angle / 2))),
      largest_chord2_(2 * one_minus_cos_),
      sin2_(sqr(std::sin(static_cast<double>(half_angle)))),
      spread_((1 - std::cos(kSunHalfAngle)) / one_minus_cos_ * kSunScale * kNormalisationY),
      limb_darkening_(limb_darkening) {
  // As tabulated by Mitsuba: linear between elevations of 2, 5, … 89 degrees, constant beyond.
  const double degrees = std::asin(std::clamp(sun.z, 0.0f, 1.0f)) * 180 / kPiD;
  const double place = std::clamp((degrees - 2) / 3, 0.0, 29.0);
  const int low = std::min(static_cast<int>(place), 28);
  const auto at = [&](int i) { return mean_over_disk(turbidity, (2 + 3 * i) * kPiD / 180); };
  const std::array<double, 3> a = at(low), b = at(low + 1);
  double mean[3];
  for (int c = 0; c < 3; ++c) mean[c] = a[c] + (place - low) * (b[c] - a[c]);
  mean_ = not_negative(mean, spread_);
}

Spectrum SunModel::radiance(const Vec3& w) const {
  if (!(w.z >= 0)) return Spectrum(0);
  if (!limb_darkening_) return mean_;
  const Vec3 across = cross(w, sun_);
  const double cos_psi = std::sqrt(std::max(0.0, 1 - dot(across, across) / sin2_));
  double rgb[3];
  sun_radiance(turbidity_, std::asin(std::clamp(w.z, 0.0f, 1.0f)), cos_psi, rgb);
  return not_negative(rgb, spread_);
}

namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// Earth's radius over the distance of the sun.
constexpr double kParallax = 6371.01 / 149597890;

/// Days from noon of 1 January 2000 to the start of the day.
double days_since_2000(int year, int month, int day) {
  // Fliegel and Van Flandern 1968; divisions truncate towards zero.
  const int january = (month - 14) / 12;
  const int julian = 1461 * (year + 4800 + january) / 4 + 367 * (month - 2 - 12 * january) / 12 -
                     3 * ((year + 4900 + january) / 100) / 4 + day - 32075;
  return julian - 0.5 - 2451545;
}

}  // namespace

Vec3 sun_position(const SunTime& time) {
  const double hours = time.hour - time.timezone + (time.minute + time.second / 60) / 60;
  const double days = days_since_2000(time.year, time.month, time.day) + hours / 24;

  // [BlancoMuriel2001]: the sun's position relative to the stars,
  const double omega = 2.1429 - 0.0010394594 * days;
  const double longitude = 4.8950630 + 0.017202791698 * days, anomaly = 6.2400600 + 0.0172019699 * days;
  const double ecliptic = longitude + 0.03341607 * std::sin(anomaly) + 0.00034894 * std::sin(2 * anomaly) - 0.0001134 -
                          0.0000203 * std::sin(omega);
  const double obliquity = 0.4090928 - 6.2140e-9 * days + 0.0000396 * std::cos(omega);
  const double ascension = std::atan2(std::cos(obliquity) * std::sin(ecliptic), std::cos(ecliptic));
  const double declination = std::asin(std::sin(obliquity) * std::sin(ecliptic));

  // and the Earth's rotation.
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
