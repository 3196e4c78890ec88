// SPDX-License-Identifier: Apache-2.0
// White balance of pbrt-v4 (color.h, film.h, spectrum.cpp): von Kries adaptation in the Bradford space of cones, from
// the white of daylight of a temperature to that of Rec. 709.
#include <array>
#include <cmath>

#include "formats/xml_values.h"
#include "pbrt/pbrt_objects.h"
#include "scene/cie_tables.h"

namespace covary {
namespace {

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;

Vector operator*(const Matrix& m, const Vector& v) {
  Vector result{};
  for (size_t i = 0; i < 3; ++i)
    for (size_t k = 0; k < 3; ++k) result[i] += m[i][k] * v[k];
  return result;
}
Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix result{};
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j)
      for (size_t k = 0; k < 3; ++k) result[i][j] += a[i][k] * b[k][j];
  return result;
}

constexpr Matrix kConesOfXyz{{{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
constexpr Matrix kXyzOfCones{
    {{0.986993, -0.147054, 0.159963}, {0.432305, 0.51836, 0.0492912}, {-0.00852866, 0.0400428, 0.968487}}};
constexpr Matrix kXyzOfRgb{
    {{0.412453, 0.357580, 0.180423}, {0.212671, 0.715160, 0.072169}, {0.019334, 0.119193, 0.950227}}};
constexpr Matrix kRgbOfXyz{
    {{3.240479, -1.537150, -0.498535}, {-0.969256, 1.875991, 0.041556}, {0.055648, -0.204043, 1.057311}}};

/// XYZ with Y = 1 of a chromaticity.
Vector xyz_of(double x, double y) { return {x / y, 1, (1 - x - y) / y}; }

Vector black_body(double temperature) {
  Vector xyz{};
  const SampledSpectrum spectrum = blackbody_spectrum(temperature, 1);
  for (int i = 0; i < cie::kSamples; ++i) {
    const cie::Row& row = cie::kTable[i];
    const double value = spectrum.samples[static_cast<size_t>(i * cie::kStep)].second;  // in steps of 1 nm, like these
    xyz[0] += value * row.x, xyz[1] += value * row.y, xyz[2] += value * row.z;
  }
  return {xyz[0] / xyz[1], 1, xyz[2] / xyz[1]};
}

/// CIE daylight; below 4000 K, where it is not defined, a black body. The CIE's temperatures are of an older constant
/// of Planck's law.
Vector daylight(double temperature) {
  const double t = temperature * 1.4388 / 1.4380;
  if (t < 4000) return black_body(t);
  const double x = t <= 7000 ? -4.6070e9 / (t * t * t) + 2.9678e6 / (t * t) + 0.09911e3 / t + 0.244063
                             : -2.0064e9 / (t * t * t) + 1.9018e6 / (t * t) + 0.24748e3 / t + 0.237040;
  return xyz_of(x, -3 * x * x + 2.870 * x - 0.275);
}

}  // namespace

std::array<std::array<double, 3>, 3> pbrt_white_balance(double temperature) {
  const Vector from = kConesOfXyz * daylight(temperature), to = kConesOfXyz * xyz_of(0.3127, 0.3290);
  Matrix gains{};
  for (size_t i = 0; i < 3; ++i) gains[i][i] = to[i] / from[i];
  return kRgbOfXyz * (kXyzOfCones * (gains * (kConesOfXyz * kXyzOfRgb)));
}

}  // namespace covary
