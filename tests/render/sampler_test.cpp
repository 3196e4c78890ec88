// SPDX-License-Identifier: Apache-2.0
// Renders with Sobol' points: the same expected image with less noise, uncorrelated groups, and random numbers that
// follow from a sample's address.
#include "unbiased_images.h"

namespace covary {
namespace {

Film sobol(const TestScene& scene, uint32_t spp, uint64_t seed, int groups,
           Sampling sampling = Sampling::kIndependent) {
  return render(scene, spp, seed, sampling, groups, Sampler::kSobol);
}

// 16 seeds, t-tests of 16 blocks and of the whole image, alpha = 5e-7. Planted bug: an image that is 5 % too bright.
TEST(Samplers, SobolPointsGiveTheSameExpectedImage) {
  const TestScene scene = load_text(everything());
  const auto independent = [&](uint64_t seed) { return render(scene, 12, seed + 100).mean_image(); };
  for (const int groups : {1, 4})
    for (const Sampling sampling : {Sampling::kIndependent, Sampling::kCrn}) {
      const auto image = [&](uint64_t seed) { return sobol(scene, 12, seed, groups, sampling).mean_image(); };
      const Differences blocks = differences(image, independent);
      EXPECT_EQ(n_biased(blocks), 0) << groups << " groups, detects " << detectable(blocks);
    }
  const auto brighter = [&](uint64_t seed) {
    Image image = sobol(scene, 12, seed, 1).mean_image();
    for (float& value : image.data) value *= 1.05f;
    return image;
  };
  EXPECT_GT(n_biased(differences(brighter, independent)), 0);
}

/// Sum over pixels of the squared difference between two renders with different seeds: twice the variance.
double squared_difference(const Film& a, const Film& b) {
  double sum = 0;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      for (int c = 0; c < 3; ++c) sum += sqr(a.mean(x, y)[c] - b.mean(x, y)[c]);
  return sum;
}

TEST(Samplers, SobolPointsHaveLessNoise) {
  const TestScene scene = load_text(everything());
  const double independent = squared_difference(render(scene, 64, 1), render(scene, 64, 2));
  EXPECT_LT(squared_difference(sobol(scene, 64, 1, 1), sobol(scene, 64, 2, 1)), 0.8 * independent);
}

// The mean of (a_g - b_g)(a_h - b_h) over pixels of two independent renders a, b is twice the covariance of groups g
// and h. 1,024 pixels, alpha = 5e-7: detects a correlation of 0.23. Planted bug: one group used twice.
TEST(Samplers, GroupsAreUncorrelated) {
  const TestScene scene = load_text(everything());
  constexpr int kGroups = 6;
  const Film a = sobol(scene, 8 * kGroups, 1, kGroups), b = sobol(scene, 8 * kGroups, 2, kGroups);
  const auto difference = [&](int x, int y, int g) {
    const Spectrum d = a.group_mean(x, y, g) - b.group_mean(x, y, g);
    return mean(d) / (0.01 + mean(a.mean(x, y) + b.mean(x, y)));
  };
  for (int g = 0; g < kGroups; ++g)
    for (int h = 0; h <= g; ++h) {
      statistics::Moments products;
      for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) products.add(difference(x, y, g) * difference(x, y, h));
      const auto result = statistics::z_test(products.mean(), products.variance_of_mean(), 0);
      EXPECT_EQ(result.accepted, g != h) << g << ", " << h << ": " << result.message;
    }
}

TEST(Samplers, ASampleIsThatOfItsAddress) {
  const TestScene scene = load_text(everything());
  PassSettings settings;
  settings.seed = 3, settings.filter = scene.loaded.filter, settings.sampler = Sampler::kSobol;
  settings.groups = 5, settings.spp = 23;
  Film film = new_film(scene, 5);
  render_pass(scene.scene(), scene.integrator(), settings, film);
  for (const auto& [x, y] : {std::pair{3, 4}, {17, 20}}) {
    Film alone(kSide, kSide, {x, y, 1, 1}, 5);
    for (uint64_t s = 0; s < 23; ++s)
      alone.add(0, 0, replay_sample(scene.scene(), scene.integrator(), settings, x, y, s).value);
    for (int g = 0; g < 5; ++g) EXPECT_EQ(alone.group_mean(0, 0, g), film.group_mean(x, y, g));
  }
}

TEST(Samplers, PixelsOfAMapOfCountsAreThoseOfUniformFilms) {
  const TestScene scene = load_text(everything());
  PassSettings settings;
  settings.seed = 7, settings.filter = scene.loaded.filter, settings.sampler = Sampler::kSobol, settings.groups = 3;
  Film film = new_film(scene, 3);
  std::vector<uint32_t> counts(film.counts().size());
  for (size_t i = 0; i < counts.size(); ++i) counts[i] = static_cast<uint32_t>(mix64(i) % 12);
  settings.spp = SampleTarget(counts);
  render_pass(scene.scene(), scene.integrator(), settings, film);
  const Film uniform = sobol(scene, 7, 7, 3);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      if (film.count(x, y) == 7) {
        ASSERT_EQ(film.mean(x, y), uniform.mean(x, y));
      }
}

}  // namespace
}  // namespace covary
