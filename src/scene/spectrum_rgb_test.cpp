// SPDX-License-Identifier: Apache-2.0
// Expected values: Mitsuba 3.9.1, variant scalar_rgb, from a diffuse reflectance, a conductor's eta and a point light's
// intensity given as <spectrum>.
#include <gtest/gtest.h>

#include "scene/parameters.h"

namespace covary {
namespace {

void expect_rgb(const SampledSpectrum& spectrum, SpectrumRole role, float r, float g, float b) {
  const Spectrum rgb = spectrum_to_rgb(spectrum, role);
  EXPECT_NEAR(rgb.r, r, 2e-6f * (1 + r));
  EXPECT_NEAR(rgb.g, g, 2e-6f * (1 + g));
  EXPECT_NEAR(rgb.b, b, 2e-6f * (1 + b));
}

TEST(SpectrumToRgb, AgreesWithMitsubaOnALine) {
  const SampledSpectrum line{{{400, 0.5f}, {700, 0.7f}}};
  expect_rgb(line, SpectrumRole::kReflectance, 0.658501f, 0.595169f, 0.524663f);
  expect_rgb(line, SpectrumRole::kIndex, 0.658501f, 0.595169f, 0.524663f);
  expect_rgb(line, SpectrumRole::kEmission, 0.787908f, 0.565704f, 0.474461f);
}

TEST(SpectrumToRgb, AgreesWithMitsubaOnSeveralSamples) {
  const SampledSpectrum curve{{{450, 0.1f}, {500, 0.9f}, {550, 0.2f}, {650, 0.8f}}};
  expect_rgb(curve, SpectrumRole::kReflectance, 0.397444f, 0.486263f, 0.196f);
  expect_rgb(curve, SpectrumRole::kEmission, 0.506379f, 0.456802f, 0.163569f);
}

TEST(SpectrumToRgb, ClampsReflectancesToOneButNotIndices) {
  const SampledSpectrum bright{{{300, 2}, {900, 3}}};
  expect_rgb(bright, SpectrumRole::kReflectance, 1, 1, 1);
  expect_rgb(bright, SpectrumRole::kIndex, 2.5681f, 2.40229f, 2.23204f);
  expect_rgb(bright, SpectrumRole::kEmission, 3.08293f, 2.28163f, 2.02683f);
}

TEST(SpectrumToRgb, ClampsNegativeComponents) {
  const SampledSpectrum narrow{{{600, 1}, {601, 1}}};
  expect_rgb(narrow, SpectrumRole::kReflectance, 0.0198287f, 0.00112661f, 0);
  expect_rgb(narrow, SpectrumRole::kEmission, 0.0218159f, 0.00123951f, 0);
}

TEST(SpectrumToRgb, TakesAConstantAsGreyReflectanceAndWhiteOfIlluminantE) {
  const SampledSpectrum constant{{{0, 0.5f}}};
  expect_rgb(constant, SpectrumRole::kReflectance, 0.5f, 0.5f, 0.5f);
  expect_rgb(constant, SpectrumRole::kIndex, 0.5f, 0.5f, 0.5f);
  expect_rgb(constant, SpectrumRole::kEmission, 0.602397f, 0.474146f, 0.454458f);
}

TEST(SpectrumToRgb, IsZeroWhereNothingIsGiven) {
  expect_rgb({}, SpectrumRole::kReflectance, 0, 0, 0);
  expect_rgb({{{100, 1}, {300, 1}}}, SpectrumRole::kEmission, 0, 0, 0);
}

}  // namespace
}  // namespace covary
