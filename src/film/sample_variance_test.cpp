// SPDX-License-Identifier: Apache-2.0
// The sample variance that films keep: its value, bits that do not depend on how a film was made, files and merging.
#include "film/groups.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/random.h"
#include "film/exr.h"
#include "film/film.h"
#include "film/film_file.h"
#include "film/merge.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of, test_support::test_file;

/// A sample with rare large values.
Spectrum sample_at(uint64_t seed, int x, uint32_t s) {
  const PathRandom random(Sampling::kIndependent, seed, 0, static_cast<uint64_t>(x), s);
  const Vec2 u = random.get_2d(0, Event::kPixel);
  return {u.x, 100 + u.y, u.x < 0.1f ? 20 * u.y : 0.0f};
}

Film film_of(int groups, uint64_t seed, uint32_t first, uint32_t last) {
  Film film(3, 1, {0, 0, 3, 1}, groups);
  film.attributes = {{film_key::kSeed, std::to_string(seed)}};
  film.keep_sample_variance();
  for (int x = 0; x < 3; ++x)
    for (uint32_t s = first; s < last + static_cast<uint32_t>(x); ++s) film.add(x, 0, sample_at(seed, x, s));
  return film;
}

/// Two-pass variance, in double.
Spectrum direct_variance(const std::vector<Spectrum>& samples) {
  float result[3];
  for (int c = 0; c < 3; ++c) {
    double sum = 0, squares = 0;
    for (const Spectrum& s : samples) sum += s[c];
    for (const Spectrum& s : samples) squares += std::pow(s[c] - sum / static_cast<double>(samples.size()), 2);
    result[c] = static_cast<float>(squares / (static_cast<double>(samples.size()) - 1));
  }
  return {result[0], result[1], result[2]};
}

void expect_near(const Spectrum& value, const Spectrum& expected, double relative) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(value[c], expected[c], relative * (expected[c] + 1e-6)) << c;
}

TEST(SampleVariance, IsThatOfAllSamplesForAnyNumberOfGroups) {
  for (int groups : {1, 2, 12})
    for (uint32_t n : {2u, 5u, 12u, 40u, 6000u}) {
      const Film film = film_of(groups, 1, 0, n);
      for (int x = 0; x < 3; ++x) {
        std::vector<Spectrum> samples;
        for (uint32_t s = 0; s < n + static_cast<uint32_t>(x); ++s) samples.push_back(sample_at(1, x, s));
        expect_near(film.sample_variance(x, 0), direct_variance(samples), n < 4096 ? 1e-4 : 1e-3);
      }
    }
}

TEST(SampleVariance, WithoutItGroupsTell) {
  Film film(1, 1, {0, 0, 1, 1}, 2);
  for (const float value : {1.0f, 4.0f, 3.0f}) film.add(0, 0, Spectrum(value));
  // Means 2 (of two samples) and 4 (of one), together 8/3: 2 (2/3)^2 + (4/3)^2.
  EXPECT_NEAR(film.sample_variance(0, 0).r, 8.0 / 9 + 16.0 / 9, 1e-6);
  EXPECT_FALSE(film.keeps_sample_variance());
}

TEST(SampleVariance, IsZeroWhereNothingTells) {
  Film kept(1, 1, {0, 0, 1, 1}, 1), groups(1, 1, {0, 0, 1, 1}, 3);
  kept.keep_sample_variance();
  EXPECT_EQ(kept.sample_variance(0, 0), Spectrum(0));
  kept.add(0, 0, Spectrum(3));
  groups.add(0, 0, Spectrum(3));
  EXPECT_EQ(kept.sample_variance(0, 0), Spectrum(0));
  EXPECT_EQ(groups.sample_variance(0, 0), Spectrum(0));
  kept.add(0, 0, Spectrum(3));
  EXPECT_EQ(kept.sample_variance(0, 0), Spectrum(0)) << "equal samples";
}

TEST(SampleVariance, OfValuesTooLargeForSquaresStaysFinite) {
  Film film(1, 1, {0, 0, 1, 1}, 1);
  film.keep_sample_variance();
  for (int i = 0; i < 5000; ++i) film.add(0, 0, Spectrum(i % 2 ? 3e38f : 0.0f));
  EXPECT_LE(film.variance_in_groups()[0], std::numeric_limits<float>::max());
}

TEST(SampleVariance, HasTheSameBitsWhenContinuedThroughAFile) {
  for (int groups : {1, 5}) {
    const Film whole = film_of(groups, 2, 0, 5000);
    const std::string path = test_file("film.exr");
    write_film(path, film_of(groups, 2, 0, 37));
    Film film = read_film(path);
    ASSERT_TRUE(film.keeps_sample_variance());
    EXPECT_EQ(film.aovs.size(), 0u);
    for (int x = 0; x < 3; ++x)
      for (uint32_t s = film.count(x, 0); s < 5000 + static_cast<uint32_t>(x); ++s) film.add(x, 0, sample_at(2, x, s));
    EXPECT_EQ(film.data(), whole.data());
    EXPECT_EQ(film.variance_in_groups(), whole.variance_in_groups());
  }
}

TEST(SampleVariance, TheChecksumCoversIt) {
  const std::string path = test_file("film.exr");
  Film film = film_of(1, 2, 0, 9);
  const auto checksum = [&] {
    write_film(path, film);
    return ExrFile(path).attributes().at("covary:checksums");
  };
  const std::string before = checksum();
  film.variance_in_groups()[1] += 1;
  EXPECT_NE(checksum(), before);
  EXPECT_EQ(read_film(path).variance_in_groups(), film.variance_in_groups());
}

TEST(SampleVariance, MergedIsThatOfAllSamples) {
  for (int groups : {1, 4}) {
    const std::vector<Film> films = {film_of(groups, 1, 0, 9), film_of(groups, 2, 0, 30)};
    const std::vector<std::string> names = {"a", "b"};
    const Film merged = merge_films(films, names);
    for (int x = 0; x < 3; ++x) {
      std::vector<Spectrum> samples;
      for (uint32_t s = 0; s < 9 + static_cast<uint32_t>(x); ++s) samples.push_back(sample_at(1, x, s));
      for (uint32_t s = 0; s < 30 + static_cast<uint32_t>(x); ++s) samples.push_back(sample_at(2, x, s));
      // The squares of the middle channel are 10^5 times its variance.
      expect_near(merged.sample_variance(x, 0), direct_variance(samples), 0.02);
    }
  }
  Film without(3, 1, {0, 0, 3, 1}, 1);
  without.attributes = {{film_key::kSeed, "7"}};
  const std::vector<Film> films = {film_of(1, 1, 0, 9), without};
  const std::vector<std::string> names = {"a", "b"};
  EXPECT_TRUE(contains(message_of([&] { merge_films(films, names); }), "the variance of samples differs"));
}

TEST(SampleVariance, OnlyOfFilmsThatSeeEverySample) {
  Film film(1, 1, {0, 0, 1, 1}, 1);
  film.add(0, 0, Spectrum(1));
  EXPECT_TRUE(contains(message_of([&] { film.keep_sample_variance(); }), "all its samples"));
  Film kept(1, 1, {0, 0, 1, 1}, 1);
  kept.keep_sample_variance();
  EXPECT_THROW(kept.set(0, 0, 3, Spectrum(1)), Error);
  EXPECT_THROW(kept.add_sums(0, 0, 1, std::vector{Spectrum(1)}), Error);
}

}  // namespace
}  // namespace covary
