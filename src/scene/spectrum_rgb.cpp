// SPDX-License-Identifier: Apache-2.0
// Spectra to linear RGB: X = k ∫ S(λ) x̄(λ) W(λ) dλ, likewise Y and Z, with W = 1 for emission and W = D65 for
// reflectances and indices. Sums use 1000 equidistant wavelengths, and the result is clamped, as in Mitsuba 3's RGB
// modes, so that both programs give the same colours.
#include <algorithm>

#include "scene/cie_tables.h"
#include "scene/parameters.h"

namespace covary {
namespace {

constexpr int kSteps = 1000;
/// Normalises S = 1 to Y = 1 (the sum below is over 1000 points, not 999 intervals: 0.1 % less).
constexpr double kNormalisationY = 1 / 106.7502593994140625;
/// Normalises S = 1 under D65 to Y = 1.
constexpr double kNormalisationD65 = 1 / 98.99741751876255;

/// The table's row at `wavelength`, linearly interpolated.
cie::Row table_at(double wavelength) {
  const double t = (wavelength - cie::kFirst) / cie::kStep;
  const int i = std::clamp(static_cast<int>(t), 0, cie::kSamples - 2);
  const double w = t - i;
  const cie::Row &a = cie::kTable[i], &b = cie::kTable[i + 1];
  return {a.x + w * (b.x - a.x), a.y + w * (b.y - a.y), a.z + w * (b.z - a.z), a.d65 + w * (b.d65 - a.d65)};
}

/// CIE XYZ to linear Rec. 709 RGB (ITU-R BT.709 primaries, D65 white).
Spectrum xyz_to_rgb(double x, double y, double z) {
  return {static_cast<float>(3.240479 * x - 1.537150 * y - 0.498535 * z),
          static_cast<float>(-0.969256 * x + 1.875991 * y + 0.041556 * z),
          static_cast<float>(0.055648 * x - 0.204043 * y + 1.057311 * z)};
}

}  // namespace

Spectrum spectrum_to_rgb(const SampledSpectrum& spectrum, SpectrumRole role) {
  const auto& samples = spectrum.samples;
  if (samples.empty()) return Spectrum(0);
  if (samples.size() == 1) {
    const float value = samples[0].second;
    return role == SpectrumRole::kEmission ? xyz_to_rgb(1, 1, 1) * value : Spectrum(value);
  }

  double x = 0, y = 0, z = 0;
  size_t interval = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double wavelength = cie::kFirst + (cie::kLast - cie::kFirst) * i / (kSteps - 1);
    if (wavelength < samples.front().first || wavelength > samples.back().first) continue;
    while (interval + 2 < samples.size() && samples[interval + 1].first <= wavelength) ++interval;
    const auto &a = samples[interval], &b = samples[interval + 1];
    const double t = (wavelength - a.first) / (static_cast<double>(b.first) - a.first);
    const cie::Row row = table_at(wavelength);
    const double value = (a.second + t * (static_cast<double>(b.second) - a.second)) *
                         (role == SpectrumRole::kEmission ? 1 : row.d65 * kNormalisationD65);
    x += value * row.x, y += value * row.y, z += value * row.z;
  }
  const double scale = (cie::kLast - cie::kFirst) * kNormalisationY / kSteps;
  Spectrum rgb = xyz_to_rgb(x * scale, y * scale, z * scale);
  const float highest = role == SpectrumRole::kReflectance ? 1.0f : kInfinity;
  for (int c = 0; c < 3; ++c) rgb[c] = std::clamp(rgb[c], 0.0f, highest);
  return rgb;
}

}  // namespace covary
