// SPDX-License-Identifier: Apache-2.0
// Parameters of media and their errors.
#include <gtest/gtest.h>

#include "media/registry.h"
#include "support/describe.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::make_plugin;

auto make(const std::string& type, const test_support::NamedValues& values) {
  return make_plugin<Medium>(medium_plugins(), "medium", type, values);
}

TEST(Media, DefaultsAreMitsubas) {
  const auto medium = make("homogeneous", {}).object;
  EXPECT_EQ(medium->majorant(), Spectrum(1));
  EXPECT_EQ(medium->at({}).scattering, Spectrum(0.75f));
  EXPECT_TRUE(medium->sample_lights());
  EXPECT_FLOAT_EQ(medium->phase().pdf({0, 0, 1}, {0, 1, 0}), 1 / (4 * kPi));
}

TEST(Media, ScaleIsAFactorOnTheExtinction) {
  const auto medium =
      make("homogeneous", {{"sigma_t", ColourValue{{1, 2, 4}}}, {"albedo", ColourValue{{1, 0.5f, 0}}}, {"scale", 2.0}})
          .object;
  EXPECT_EQ(medium->at({}).extinction, Spectrum(2, 4, 8));
  EXPECT_EQ(medium->at({}).scattering, Spectrum(2, 2, 0));
}

TEST(Media, GlowIsProportionalToAbsorption) {
  EXPECT_FALSE(make("homogeneous", {}).object->emits());
  EXPECT_FALSE(make("homogeneous", {{"radiance", 0.0}}).object->emits());
  const auto medium = make("homogeneous", {{"sigma_t", 1.0},
                                           {"albedo", ColourValue{{0, 0.5f, 1}}},
                                           {"scale", 2.0},
                                           {"radiance", ColourValue{{3, 2, 1}}}})
                          .object;
  ASSERT_TRUE(medium->emits());
  EXPECT_EQ(medium->emission({}, medium->at({})), Spectrum(6, 2, 0));
  EXPECT_TRUE(contains(make("homogeneous", {{"radiance", ColourValue{{-1, 0, 0}}}}).errors,
                       "has values that are negative or not finite"));
}

TEST(Media, OneWithoutBoundsIsNotCut) {
  float near = 0, far = 7;
  EXPECT_TRUE(make("homogeneous", {}).object->clip({{5, 5, 5}, {1, 0, 0}}, near, far));
  EXPECT_EQ(far, 7);
}

TEST(Media, AHeterogeneousOneLiesInTheBoxOfItsVolume) {
  const auto medium = make("heterogeneous", {}).object;  // the unit cube
  float near = 0, far = 7;
  EXPECT_TRUE(medium->clip({{-1, 0.5f, 0.5f}, {1, 0, 0}}, near, far));
  EXPECT_EQ(near, 1);
  EXPECT_EQ(far, 2);
  near = 0, far = 0.5f;
  EXPECT_FALSE(medium->clip({{-1, 0.5f, 0.5f}, {1, 0, 0}}, near, far));
  near = 0, far = 7;
  EXPECT_FALSE(medium->clip({{-1, 1.5f, 0.5f}, {1, 0, 0}}, near, far));
}

TEST(Media, ValuesOutsideTheirRangesAreErrors) {
  EXPECT_EQ(make("homogeneous", {{"sigma_t", -1.0}}).errors,
            "test.xml:2:1: parameter 'sigma_t' of medium 'homogeneous' has values that are negative or not finite");
  EXPECT_EQ(make("homogeneous", {{"albedo", 1.5}}).errors,
            "test.xml:2:1: parameter 'albedo' of medium 'homogeneous' has values outside [0, 1]");
  EXPECT_TRUE(contains(make("homogeneous", {{"scale", -1.0}}).errors, "it must be at least 0"));
  EXPECT_TRUE(contains(make("heterogeneous", {{"sigma_t", 1e6}}).errors,
                       "makes a ray collide 1.73e+06 times on the way through the box; at most 1000000 are accepted"));
  EXPECT_EQ(make("homogeneous", {{"sigma_t", 1e6}}).errors, "");
  EXPECT_TRUE(contains(make("homogeneous", {{"density", 1.0}}).errors, "unknown parameter 'density'"));
}

}  // namespace
}  // namespace covary
