// SPDX-License-Identifier: Apache-2.0
// The waves of a training as an image. Samples are Gaussian around the pixel's value, with a standard deviation that
// decreases from wave to wave; 64 x 64 pixels, fixed seeds.
#include "passes/training_image.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace covary {
namespace {

constexpr int kSide = 64;

float normal(uint64_t i) {
  const auto number = [](uint64_t key) { return (static_cast<double>(mix64(key) >> 11) + 0.5) * 0x1p-53; };
  return static_cast<float>(std::sqrt(-2 * std::log(number(2 * i))) * std::cos(2 * M_PI * number(2 * i + 1)));
}

Film new_film(int side = kSide) { return {side, side, {0, 0, side, side}, 2}; }

/// Adds n samples with mean 5 and this standard deviation to each pixel.
void add_samples(Film& film, uint32_t n, float deviation, uint64_t seed) {
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x)
      for (uint32_t s = 0; s < n; ++s) {
        const uint64_t pixel = static_cast<uint64_t>(y) * kSide + static_cast<uint64_t>(x);
        const uint64_t key = ((seed << 8 | film.count(x, y)) << 12 | pixel) * 3;
        film.add(x, y, {5 + deviation * normal(key), 5 + deviation * normal(key + 1), 5 + deviation * normal(key + 2)});
      }
}

double mean_square_error(const Image& image) {
  double sum = 0;
  for (const float value : image.data) sum += (value - 5.0) * (value - 5.0);
  return sum / static_cast<double>(image.data.size());
}

/// Waves of 2, 2 and 4 samples with deviations 4, 4 and 1.
TrainingImage three_waves(WaveWeights weights, uint64_t seed = 1) {
  Film film = new_film();
  WaveCombination waves(weights);
  add_samples(film, 2, 4, seed), waves.add(film, {});
  add_samples(film, 2, 4, seed), waves.add(film, {});
  add_samples(film, 4, 1, seed), waves.add(film, {});
  return waves.result();
}

TEST(TrainingImage, WeighsWavesByTheInverseOfTheirVariance) {
  const TrainingImage image = three_waves(WaveWeights::kVariance);
  // 4 samples of variance 16 are worth 1/4 of one of variance 1.
  EXPECT_NEAR(image.samples[0], 4.25, 0.03);
  EXPECT_NEAR(image.samples[1], 4.25, 0.03);
  EXPECT_NEAR(mean_square_error(image.mean), 1 / 4.25, 0.01);
}

TEST(TrainingImage, OrIsTheMeanOfAllSamples) {
  const TrainingImage image = three_waves(WaveWeights::kSamples);
  EXPECT_EQ(image.samples, (std::array<double, 2>{8, 8}));
  EXPECT_NEAR(mean_square_error(image.mean), (4 * 16 + 4) / 64.0, 0.05);
}

// The pixel's own samples do not affect its weights: rare bright samples in the pixels of one colour leave the others
// unchanged and affect only the weights of these.
TEST(TrainingImage, WeightsAreThoseOfOtherPixels) {
  const auto image = [](bool bright) {
    Film film = new_film();
    WaveCombination waves(WaveWeights::kVariance);
    add_samples(film, 2, 1, 1);
    if (bright)
      for (int y = 0; y < kSide; ++y)
        for (int x = y % 2; x < kSide; x += 4) film.data()[static_cast<size_t>(y * kSide + x) * 6] += 100;
    waves.add(film, {});
    add_samples(film, 2, 1, 1), waves.add(film, {});
    return waves.result();
  };
  const TrainingImage plain = image(false), bright = image(true);
  // The first wave now gets less weight in odd pixels.
  EXPECT_NEAR(plain.samples[0], bright.samples[0], 1e-9);
  EXPECT_NEAR(plain.samples[1], 4, 0.3);
  EXPECT_NEAR(bright.samples[1], 2, 0.1);
  EXPECT_EQ(plain.mean.rgb(3, 3).g, bright.mean.rgb(3, 3).g);
}

TEST(TrainingImage, CountsAtMostAsManySamplesAsItHas) {
  Film film = new_film();
  WaveCombination waves(WaveWeights::kVariance);
  add_samples(film, 2, 1, 1), waves.add(film, {});
  add_samples(film, 2, 9, 1), waves.add(film, {});
  EXPECT_EQ(waves.result().samples, (std::array<double, 2>{4, 4}));
}

TEST(TrainingImage, ErrorsCountByTheImportanceOfTheirPixel) {
  std::vector<Spectrum> importance(kSide * kSide, Spectrum(0));
  for (size_t p = 0; p < importance.size(); ++p)
    if (p % kSide < kSide / 2) importance[p] = Spectrum(1);
  Film film = new_film();
  WaveCombination waves(WaveWeights::kVariance);
  add_samples(film, 2, 1, 1), waves.add(film, importance);
  add_samples(film, 2, 1, 1);
  for (int y = 0; y < kSide; ++y)  // noise where importance is zero
    for (int x = kSide / 2; x < kSide; ++x) film.data()[static_cast<size_t>(y * kSide + x) * 6] += 50 * normal(x + y);
  waves.add(film, importance);
  EXPECT_NEAR(waves.result().samples[0], 4, 0.3);
}

TEST(TrainingImage, CountsSingleSamplesWithTheNextWave) {
  Film film = new_film();
  WaveCombination waves(WaveWeights::kVariance);
  add_samples(film, 1, 1, 1), waves.add(film, {});
  EXPECT_TRUE(waves.result().mean.data.empty());
  add_samples(film, 1, 1, 1), waves.add(film, {});
  EXPECT_EQ(waves.result().samples[0], 2);
  add_samples(film, 1, 1, 1), waves.add(film, {});
  EXPECT_EQ(waves.result().samples[0], 3);
}

TEST(TrainingImage, OfFewPixelsIsTheMeanOfAllSamples) {
  Film film = new_film(1);
  WaveCombination waves(WaveWeights::kVariance);
  add_samples(film, 2, 4, 1), waves.add(film, {});
  add_samples(film, 4, 1, 1), waves.add(film, {});
  const TrainingImage image = waves.result();
  EXPECT_EQ(image.samples[0], 6);
  EXPECT_NEAR(image.mean.rgb(0, 0).r, film.mean(0, 0).r, 1e-5);
}

TEST(TrainingImage, JoinsAFilm) {
  Film film = new_film(2);
  add_samples(film, 4, 0, 1);
  const TrainingImage image{Image(2, 2, 3), {4, 12}};
  EXPECT_FLOAT_EQ(with_training(film, image).rgb(0, 0).r, 2.5f);
  EXPECT_FLOAT_EQ(with_training(film, image).rgb(1, 0).g, 1.25f);
}

}  // namespace
}  // namespace covary
