// SPDX-License-Identifier: Apache-2.0
#include "emitters/environment_image.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"
#include "statistics/chi2.h"

namespace covary {
namespace {

/// Random colours, a quarter of the texels black, and one "sun" texel with most of the light.
TexelImage test_image(int width, int height, float sun) {
  TexelImage image;
  image.width = width, image.height = height, image.channels = 3;
  for (int i = 0; i < width * height; ++i) {
    const bool black = mix64(i) % 4 == 0;
    for (int c = 0; c < 3; ++c)
      image.floats.push_back(black ? 0 : static_cast<float>(mix64(3 * i + c + 100) >> 40) * 0x1p-24f);
  }
  for (int c = 0; c < 3; ++c)
    image.floats[3 * (width * (height / 3) + width / 4) + c] += sun * static_cast<float>(3 - c);
  return image;
}

struct Case {
  const char* name;
  int width, height;
  float sun;
  bool compensated;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class EnvironmentSampling : public testing::TestWithParam<Case> {
 protected:
  EnvironmentImage environment() const {
    return EnvironmentImage(test_image(GetParam().width, GetParam().height, GetParam().sun), 1, GetParam().compensated);
  }
};

// Only last bits may differ, where compilers fuse other operations in a vectorised loop.
TEST_P(EnvironmentSampling, SamplesTakenTogetherAreTheSame) {
  const EnvironmentImage environment = this->environment();
  for (int first = 0; first < 4096; first += 50) {
    EnvironmentSamples samples;
    samples.size = 50;  // not whole vectors
    Vec2 u[50];
    for (int i = 0; i < samples.size; ++i) {
      u[i] = PathRandom(Sampling::kIndependent, 7, 0, 0, static_cast<uint64_t>(first + i))
                 .get_2d(0, Event::kLightPosition);
      samples.u_x[i] = u[i].x, samples.u_y[i] = u[i].y;
    }
    environment.sample(samples);
    for (int i = 0; i < samples.size; ++i) {
      const EnvironmentImage::Sample expected = environment.sample(u[i]);
      const auto expect_same = [](float value, float other) {
        EXPECT_NEAR(value, other, 1e-4f * std::abs(other) + 1e-6f);
      };
      expect_same(samples.wi_x[i], expected.d.x), expect_same(samples.wi_y[i], expected.d.y);
      expect_same(samples.wi_z[i], expected.d.z);
      expect_same(samples.pdf_solid_angle[i], expected.pdf_solid_angle);
      expect_same(samples.r[i], expected.value.r), expect_same(samples.g[i], expected.value.g);
      expect_same(samples.b[i], expected.value.b);
    }
  }
}

// N = 400 000, alpha = 5e-7: detects an rms error of 2.3 % of the density with power 0.99 (statistics/chi2.h).
TEST_P(EnvironmentSampling, DirectionsFollowTheirDensity) {
  const EnvironmentImage environment = this->environment();
  const auto sample = [&](const PathRandom& random) -> std::optional<Vec3> {
    return environment.sample(random.get_2d(0, Event::kLightPosition)).d;
  };
  const auto result = statistics::chi2_sphere(
      sample, [&](const Vec3& d) { return environment.lookup(d).pdf_solid_angle; }, {.name = GetParam().name});
  EXPECT_TRUE(result.accepted) << result.message;
  // Planted bug: density per unit (u, v) area used as per unit solid angle, renormalised to the right total mass.
  const auto wrong = statistics::chi2_sphere(sample,
                                             [&](const Vec3& d) {
                                               return environment.lookup(d).pdf_solid_angle *
                                                      std::sqrt(d.x * d.x + d.z * d.z) / result.mass * 1.2;
                                             },
                                             {.name = GetParam().name, .n_samples = 50000});
  EXPECT_FALSE(wrong.accepted);
}

TEST_P(EnvironmentSampling, SampleAgreesWithLookup) {
  const EnvironmentImage environment = this->environment();
  for (int i = 0; i < 5000; ++i) {
    const PathRandom random(Sampling::kIndependent, 2, 0, 0, i);
    const EnvironmentImage::Sample s = environment.sample(random.get_2d(0, Event::kLightPosition));
    ASSERT_GT(s.pdf_solid_angle, 0);
    ASSERT_NEAR(length(s.d), 1, 1e-6);
    // Single precision in direction is about 1e-6 texels, over which the value changes by up to the largest one nearby.
    const EnvironmentImage::Lookup found = environment.lookup(s.d);
    const float slope = 1e-5f * (1 + 3 * GetParam().sun);
    ASSERT_NEAR(luminance(found.value), luminance(s.value), slope + 1e-5f * luminance(s.value));
    const float to_pdf = s.pdf_solid_angle / std::max(luminance(s.value), 1e-6f);
    ASSERT_NEAR(found.pdf_solid_angle, s.pdf_solid_angle, slope * to_pdf + 1e-3f * s.pdf_solid_angle);
  }
}

TEST_P(EnvironmentSampling, IntegralIsThatOfTheLookups) {
  const EnvironmentImage environment = this->environment();
  for (int c = 0; c < 3; ++c) {
    const double integral =
        statistics::integrate_sphere([&](const Vec3& d) { return environment.lookup(d).value[c]; }, 1e-4);
    EXPECT_NEAR(environment.integral()[c], integral, 2e-3 * integral);
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, EnvironmentSampling,
                         testing::Values(Case{"sun_24x12", 24, 12, 300, false}, Case{"odd_7x5", 7, 5, 0, false},
                                         Case{"one_pixel", 1, 1, 1, false}, Case{"two_rows", 3, 2, 0, false},
                                         Case{"compensated", 12, 6, 5, true}),
                         [](const auto& test) { return std::string(test.param.name); });

// Value over density is nearly the same for every sample, however bright the sun. The remaining variation is that of
// the sine within a row, largest at the poles.
TEST(EnvironmentImage, ValueOverDensityIsNearlyConstant) {
  const EnvironmentImage environment(test_image(24, 12, 300), 1, false);
  const double expected = luminance(environment.integral());
  statistics::Moments ratio;
  for (int i = 0; i < 20000; ++i) {
    const PathRandom random(Sampling::kIndependent, 2, 0, 0, i);
    const EnvironmentImage::Sample s = environment.sample(random.get_2d(0, Event::kLightPosition));
    ratio.add(luminance(s.value) / s.pdf_solid_angle / expected);
  }
  EXPECT_NEAR(ratio.mean(), 1, 5 * std::sqrt(ratio.variance_of_mean()));
  EXPECT_LT(std::sqrt(ratio.sample_variance()), 0.07);
}

TEST(EnvironmentImage, DensityIsPositiveWhereverLightComesFrom) {
  const EnvironmentImage environment(test_image(9, 5, 0), 1, false);
  for (int i = 0; i < 20000; ++i) {
    const PathRandom random(Sampling::kIndependent, 4, 0, 0, i);
    const Vec2 u = random.get_2d(0, Event::kDirection);
    const EnvironmentImage::Lookup found = environment.lookup(statistics::direction_from_square(u.x, u.y));
    ASSERT_EQ(luminance(found.value) > 0, found.pdf_solid_angle > 0);
  }
}

TEST(EnvironmentImage, CompensationLeavesOutWhatIsDarkerThanTheMean) {
  TexelImage image = test_image(8, 5, 0);
  std::fill(image.floats.begin(), image.floats.end(), 1.0f);
  for (int c = 0; c < 3; ++c) image.floats[3 * (2 * 8 + 4) + c] = 50;
  const EnvironmentImage environment(image, 1, true);
  EXPECT_EQ(environment.lookup(normalize(Vec3{0.1f, 1, 0})).pdf_solid_angle, 0);
  int n_bright = 0;
  for (int i = 0; i < 1000; ++i) {
    const PathRandom random(Sampling::kIndependent, 2, 0, 0, i);
    n_bright += luminance(environment.sample(random.get_2d(0, Event::kLightPosition)).value) > 1.5f;
  }
  EXPECT_GT(n_bright, 950);
  // For a constant map, compensation changes nothing.
  std::fill(image.floats.begin(), image.floats.end(), 1.0f);
  EXPECT_GT(EnvironmentImage(image, 1, true).lookup({0, 0, 1}).pdf_solid_angle, 0);
}

TEST(EnvironmentImage, CanBeCompensatedLater) {
  const TexelImage image = test_image(12, 6, 5);
  const EnvironmentImage plain(image, 1, false), at_once(image, 1, true), later = plain.compensated();
  EXPECT_FALSE(plain.is_compensated());
  EXPECT_TRUE(later.is_compensated());
  for (int i = 0; i < 200; ++i) {
    const Vec2 u = PathRandom(Sampling::kIndependent, 2, 0, 0, i).get_2d(0, Event::kLightPosition);
    EXPECT_EQ(later.sample(u).d, at_once.sample(u).d);
    EXPECT_EQ(later.sample(u).pdf_solid_angle, at_once.sample(u).pdf_solid_angle);
  }
}

TEST(EnvironmentImage, ABlackMapIsNeverSampled) {
  TexelImage image = test_image(4, 3, 0);
  std::fill(image.floats.begin(), image.floats.end(), 0.0f);
  const EnvironmentImage environment(image, 1, false);
  EXPECT_EQ(environment.sample({0.3f, 0.3f}).pdf_solid_angle, 0);
  EXPECT_EQ(environment.lookup({0, 1, 0}).pdf_solid_angle, 0);
  EXPECT_EQ(environment.integral(), Spectrum(0));
}

TEST(EnvironmentImage, EveryRandomNumberGivesAUnitDirection) {
  const EnvironmentImage environment(test_image(24, 12, 300), 1, false);
  for (const float x : {0.0f, 0.5f, kOneMinusEpsilon})
    for (const float y : {0.0f, 0.5f, kOneMinusEpsilon}) {
      const EnvironmentImage::Sample s = environment.sample({x, y});
      EXPECT_NEAR(length(s.d), 1, 1e-6);
      EXPECT_TRUE(std::isfinite(s.pdf_solid_angle));
    }
  for (const Vec3& d : {Vec3{0, 1, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}, Vec3{-0.0f, 0, 1}})
    EXPECT_TRUE(std::isfinite(environment.lookup(d).pdf_solid_angle));
}

}  // namespace
}  // namespace covary
