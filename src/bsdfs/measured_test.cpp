// SPDX-License-Identifier: Apache-2.0
// Files written by tests/references/make_measured_files.py.
#include <cmath>
#include <fstream>
#include <sstream>

#include "support/files.h"
#include "support/model_checks.h"
#include "support/tensor_text.h"

namespace covary::testing {
namespace {

using test_support::float_field;
using test_support::tensor_text;
using test_support::TensorField;
using test_support::test_file;

Json measured(const std::string& file) { return {{"type", "measured"}, {"filename", file}}; }
const std::string kFolder = COVARY_SOURCE_DIR "/tests/references/";
const std::string kFiles[] = {kFolder + "measured_isotropic.bsdf", kFolder + "measured_half.bsdf",
                              kFolder + "measured_quarter.bsdf"};

TEST(Measured, SamplesFollowTheDensity) {
  for (const std::string& file : kFiles) expect_sound(measured(file), {3, 40, 75});
  expect_rejected(measured(kFiles[0]), Planted::Bug::kDensity);
}

TEST(Measured, LightPathsGetTheAdjoint) {
  for (const std::string& file : kFiles) EXPECT_GT(expect_adjoint(measured(file), {10, 45, 70}), 200);
}

TEST(Measured, ReflectsNoMoreThanArrives) {
  for (const std::string& file : kFiles)
    for (const float theta : {5.0f, 50.0f, 80.0f}) expect_albedo_within(measured(file), theta, 0.3, 1);
}

TEST(Measured, AlbedoOfTheAuxiliaryImageIsWhatIsReflected) {
  const Vec3 wo = normalize(Vec3{-1, -1, 2});
  const Bound closure(measured(kFiles[0]), wo);
  double variance = 0;
  const Spectrum drawn = statistics::sampled_albedo(*closure, wo, 100000, 1, &variance);
  const Spectrum told = closure.bsdf().albedo(flat_hit());
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(told[c], drawn[c], 0.02f);
}

/// Sectors that were not measured mirror those that were.
TEST(Measured, PartsOfATurnAreMirrored) {
  const auto value = [](const std::string& file, Vec3 wo, Vec3 wi) {
    return Bound(measured(file), wo)->eval(wo, wi).value.g;
  };
  const Vec3 wo = direction(35, -2.2f), wi = direction(50, 1.3f);
  const auto turned = [](const Vec3& w, float x, float y) { return Vec3{w.x * x, w.y * y, w.z}; };
  const float half = value(kFiles[1], wo, wi), quarter = value(kFiles[2], wo, wi);
  EXPECT_EQ(half, value(kFiles[1], turned(wo, -1, -1), turned(wi, -1, -1)));
  EXPECT_EQ(quarter, value(kFiles[2], turned(wo, -1, 1), turned(wi, -1, 1)));
  EXPECT_EQ(quarter, value(kFiles[2], turned(wo, 1, -1), turned(wi, 1, -1)));
  EXPECT_NE(quarter, value(kFiles[2], wo, turned(wi, -1, 1)));
  // An isotropic material depends on the difference of azimuths only.
  EXPECT_NEAR(value(kFiles[0], direction(35, 0.4f), direction(50, 3)),
              value(kFiles[0], direction(35, -2.6f), direction(50, 0)), 1e-5f);
}

/// Fields of a small isotropic material with constant spectra `value` that exclude D / (4 sigma).
std::vector<TensorField> plain_fields(float value) {
  const std::vector<float> ones(8, 1);
  return {float_field("phi_i", {1}, {0}),
          float_field("theta_i", {2}, {0, 1.5f}),
          float_field("ndf", {2, 2}, {1, 1, 1, 1}),
          float_field("sigma", {2, 2}, {1, 1, 1, 1}),
          float_field("vndf", {1, 2, 2, 2}, ones),
          float_field("luminance", {1, 2, 2, 2}, ones),
          float_field("rgb", {1, 2, 3, 2, 2}, std::vector<float>(24, value)),
          {"jacobian", {1}, std::string(1, '\0'), 1}};
}
std::string write(const std::vector<TensorField>& fields) {
  const std::string path = test_file("m.bsdf");
  std::ofstream(path, std::ios::binary) << tensor_text(fields);
  return path;
}
std::string errors(std::vector<TensorField> fields, size_t i, const TensorField& other) {
  fields[i] = other;
  return bsdf_errors(measured(write(fields)));
}

TEST(Measured, WithoutNormalsSpectraAreTheValue) {
  const Vec3 wo = direction(30, 0), wi = direction(60, 1);
  EXPECT_FLOAT_EQ(Bound(measured(write(plain_fields(0.25f))), wo)->eval(wo, wi).value.b, 0.25f);
  EXPECT_EQ(Bound(measured(write(plain_fields(-0.25f))), wo)->eval(wo, wi).value.b, 0);
  const Vec3 below = direction(100, 1);
  EXPECT_EQ(Bound(measured(write(plain_fields(1))), wo)->eval(wo, below).value.b, 0);
  EXPECT_EQ(Bound(measured(write(plain_fields(1))), below)->eval(below, wi).pdf_solid_angle, 0);
}

/// A spectral file has the colour that spectrum_to_rgb() gives its spectra.
TEST(Measured, SpectraBecomeColours) {
  const std::vector<float> wavelengths = {380, 450, 520, 600, 700}, spectrum = {0.2f, 0.3f, 0.9f, 0.5f, 0.4f};
  auto fields = plain_fields(0);
  fields.push_back(float_field("wavelengths", {5}, wavelengths));
  std::vector<float> slices;  // two camera angles, of which each holds all wavelengths
  for (int slice = 0; slice < 2; ++slice)
    for (const float value : spectrum) slices.insert(slices.end(), 4, value);
  fields[6] = float_field("spectra", {1, 2, 5, 2, 2}, slices);
  SampledSpectrum expected;
  for (size_t i = 0; i < 5; ++i) expected.samples.emplace_back(wavelengths[i], spectrum[i]);
  const Spectrum rgb = spectrum_to_rgb(expected, SpectrumRole::kReflectance);
  const Vec3 wo = direction(30, 0), wi = direction(60, 1);
  const Spectrum found = Bound(measured(write(fields)), wo)->eval(wo, wi).value;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], rgb[c], 1e-4f);
}

TEST(Measured, WrongFilesAreNamed) {
  const auto plain = plain_fields(1);
  expect_contains(bsdf_errors({{"type", "measured"}}), "bsdf 'measured': the string 'filename' is missing");
  expect_contains(bsdf_errors(measured(kFolder + "bsdfs.json")), "cannot be used: ");
  expect_contains(bsdf_errors(measured(kFolder + "bsdfs.json")), "is not a tensor file");
  auto spectral = plain;
  spectral.push_back(float_field("wavelengths", {1}, {500}));
  expect_contains(bsdf_errors(measured(write(spectral))), "not a list of increasing wavelengths");
  expect_contains(bsdf_errors(measured(write({float_field("M", {1}, {1})}))), "holds a polarised measurement");
  expect_contains(bsdf_errors(measured(write({plain[0], plain[1]}))), "has no field 'ndf'");
  expect_contains(errors(plain, 2, float_field("ndf", {4}, {1, 1, 1, 1})),
                  "has the shape [4] in field 'ndf'; expected [2 or more, 2 or more]");
  expect_contains(errors(plain, 4, float_field("vndf", {2, 2, 2, 1}, std::vector<float>(8, 1))),
                  "has the shape [2, 2, 2, 1] in field 'vndf'; expected [1, 2, 2 or more, 2 or more]");
  expect_contains(errors(plain, 5, float_field("luminance", {1, 2, 2, 2}, std::vector<float>(8, 0))),
                  "'luminance' is zero everywhere in slice 0");
  expect_contains(errors(plain, 6, float_field("rgb", {1, 2, 2, 2, 2}, std::vector<float>(16, 1))),
                  "expected [1, 2, 3, 2, 2]");
  expect_contains(errors(plain, 1, float_field("theta_i", {2}, {1, 1})),
                  "'theta_i' that is not a list of increasing angles");
  auto third = plain;
  third[0] = float_field("phi_i", {3}, {-2.1f, -1, 0});
  for (size_t i = 4; i <= 6; ++i) {
    third[i].shape[0] = 3;
    third[i].values += third[i].values + third[i].values;
  }
  expect_contains(bsdf_errors(measured(write(third))), "expected a whole, half or quarter turn");
}

/// 2,000 files with one byte changed: each loads or is rejected with a message; those that load can be sampled.
TEST(Measured, DamagedFilesDoNoHarm) {
  std::ifstream stream(kFiles[0], std::ios::binary);
  std::stringstream whole;
  whole << stream.rdbuf();
  const Vec3 wo = direction(30, 0.3f);
  int loaded = 0;
  for (int i = 0; i < 2000; ++i) {
    const PathRandom random(Sampling::kIndependent, 1, 0, 0, i);
    const Vec2 u = random.get_2d(0, Event::kDirection);
    std::string bytes = whole.str();
    // Most changes hit the list of fields.
    const size_t place = static_cast<size_t>(u.x * static_cast<float>(i % 4 ? 400 : bytes.size()));
    bytes[place] = static_cast<char>(u.y * 256);
    const std::string path = test_file("d.bsdf");
    std::ofstream(path, std::ios::binary) << bytes;
    if (!bsdf_errors(measured(path)).empty()) continue;
    ++loaded;
    const BsdfSample s = Bound(measured(path), wo)->sample(wo, 0, u);
    EXPECT_TRUE(!s.valid() || std::isfinite(s.weight.g)) << i;
  }
  EXPECT_GT(loaded, 300);
}

}  // namespace
}  // namespace covary::testing
