// SPDX-License-Identifier: Apache-2.0
// Light films: sums of splats, normalisation, and bits that do not depend on threads and interruptions.
#include "film/splat_layer.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "core/random.h"
#include "film/film_file.h"
#include "film/merge.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of, test_support::test_file;

constexpr CropWindow kCrop{5, 3, 37, 41};

Film light_film(int groups, uint64_t seed = 1) {
  Film film(60, 50, kCrop, groups);
  film.attributes = {{film_key::kSeed, std::to_string(seed)},
                     {film_key::kSampling, "independent"},
                     {film_key::kSceneHash, "abc"},
                     {film_key::kSettings, "bdpt depth=5"}};
  return film;
}

struct Splat {
  int x, y;
  Spectrum value;
};

/// Up to three splats of a light path, half of them on a few pixels; values span six powers of ten, so that summing in
/// another order changes bits. Some lie outside the crop.
std::vector<Splat> splats_of(uint64_t path, uint64_t seed) {
  const PathRandom random(Sampling::kIndependent, seed, 0, 0, path);
  std::vector<Splat> splats(static_cast<size_t>(random.get_1d(0, Event::kLobe) * 4));
  uint32_t vertex = 1;
  for (Splat& splat : splats) {
    const Vec2 u = random.get_2d(vertex, Event::kPixel), v = random.get_2d(vertex, Event::kLens);
    const float spread = random.get_1d(vertex, Event::kLobe) < 0.5f ? 3 : 60;
    splat = {static_cast<int>(u.x * spread) + 4, static_cast<int>(u.y * spread),
             Spectrum(v.x, v.y, 1) * std::pow(10.0f, 6 * random.get_1d(vertex, Event::kRoulette))};
    ++vertex;
  }
  return splats;
}

void trace_bundle(SplatLayer& layer, uint32_t bundle, uint64_t seed) {
  for (uint64_t path = uint64_t{bundle} * kBundlePaths; path < (uint64_t{bundle} + 1) * kBundlePaths; ++path)
    for (const Splat& splat : splats_of(path, seed)) layer.add(path, splat.x, splat.y, splat.value);
}

/// Traces light paths until the film has `target` bundles, or for `rounds` rounds.
SplatCounts trace(Film& film, uint32_t target, int threads = 1, int rounds = 1000, uint64_t seed = 1) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
  SplatLayer layer(film);
  for (int i = 0; i < rounds && layer.begin_round(target); ++i) {
    parallel_for(layer.end_bundle() - layer.first_bundle(),
                 [&](uint32_t b) { trace_bundle(layer, layer.first_bundle() + b, seed); });
    layer.finish_round();
  }
  return layer.counts();
}

bool same_bits(const Film& a, const Film& b) {
  return a.counts() == b.counts() &&
         std::equal(a.data().begin(), a.data().end(), b.data().begin(), b.data().end(),
                    [](float u, float v) { return std::bit_cast<uint32_t>(u) == std::bit_cast<uint32_t>(v); });
}

constexpr uint32_t kTarget = 2400;  // bundles: three rounds, the last one short

TEST(SplatLayer, SumsInPathOrderAndDividesByTheNumberOfLightPaths) {
  for (const int groups : {1, 12}) {
    Film film = light_film(groups);
    trace(film, kTarget);
    EXPECT_EQ(light_paths(film), kTarget * kBundlePaths);
    std::vector<double> sums(film.data().size());
    std::vector<float> reversed(film.data().size());
    for (uint64_t path = light_paths(film); path-- > 0;)
      for (const Splat& splat : splats_of(path, 1)) {
        const int x = splat.x - kCrop.x, y = splat.y - kCrop.y;
        if (x < 0 || y < 0 || x >= kCrop.width || y >= kCrop.height) continue;
        const size_t at = ((size_t{1} * y * kCrop.width + x) * groups + path / kBundlePaths % groups) * 3;
        for (int c = 0; c < 3; ++c) sums[at + c] += splat.value[c], reversed[at + c] += splat.value[c];
      }
    const double paths_per_group = static_cast<double>(light_paths(film)) / groups;
    size_t n_other_bits = 0, n_lit = 0;
    for (size_t i = 0; i < sums.size(); ++i) {
      EXPECT_NEAR(film.data()[i], sums[i] / paths_per_group, 1e-6 * film.data()[i]);
      n_lit += sums[i] > 0;
      n_other_bits += film.data()[i] != reversed[i] / static_cast<float>(paths_per_group);
    }
    EXPECT_GT(n_lit, 1000u);
    EXPECT_GT(n_other_bits, n_lit / 2);  // the values are such that the order matters
  }
}

TEST(SplatLayer, BitsDoNotDependOnThreads) {
  for (const int groups : {1, 12}) {
    Film one = light_film(groups), two = light_film(groups), seven = light_film(groups);
    trace(one, kTarget, 1);
    trace(two, kTarget, 2);
    trace(seven, kTarget, 7);
    EXPECT_TRUE(same_bits(one, two));
    EXPECT_TRUE(same_bits(one, seven));
    Film other = light_film(groups);
    trace(other, kTarget, 1, 1000, 2);
    EXPECT_FALSE(same_bits(one, other));
  }
}

TEST(SplatLayer, InterruptionsLeaveNoTrace) {
  Film whole = light_film(12);
  trace(whole, kTarget);
  // One round; half a round, abandoned; the film written and read; the rest.
  Film part = light_film(12);
  trace(part, kTarget, 2, 1);
  const Film after_one_round = part;
  {
    SplatLayer layer(part);
    ASSERT_TRUE(layer.begin_round(kTarget));
    for (uint32_t b = layer.first_bundle(); b < layer.first_bundle() + 300; ++b) trace_bundle(layer, b, 1);
  }
  EXPECT_TRUE(same_bits(part, after_one_round));
  const std::string path = test_file("light.exr");
  write_film(path, part);
  Film resumed = read_film(path);
  EXPECT_EQ(resumed.attributes.at(film_key::kLightPaths), "256");
  trace(resumed, kTarget, 7);
  EXPECT_TRUE(same_bits(whole, resumed));
  EXPECT_FALSE(SplatLayer(resumed).begin_round(kTarget));  // complete
  // Restarting a round discards what it had.
  Film again = light_film(12);
  SplatLayer layer(again);
  while (layer.begin_round(kTarget)) {
    trace_bundle(layer, layer.first_bundle(), 5);
    layer.begin_round(kTarget);
    for (uint32_t b = layer.first_bundle(); b < layer.end_bundle(); ++b) trace_bundle(layer, b, 1);
    layer.finish_round();
  }
  EXPECT_TRUE(same_bits(whole, again));
}

TEST(SplatLayer, FilmsOfTwoSeedsMergeByTheirLightPaths) {
  Film a = light_film(12, 1), b = light_film(12, 2);
  trace(a, 1200, 2, 1000, 1);
  trace(b, 2400, 2, 1000, 2);
  const Film films[] = {a, b};
  const std::string names[] = {"a", "b"};
  const Film merged = merge_films(films, names);
  EXPECT_EQ(light_paths(merged), 3600u * kBundlePaths);
  for (size_t i = 0; i < merged.data().size(); ++i)
    EXPECT_NEAR(merged.data()[i], (a.data()[i] + 2.0 * b.data()[i]) / 3, 1e-6 * merged.data()[i]);
  Film camera = light_film(12, 3);
  const Film mixed[] = {a, camera};
  EXPECT_TRUE(contains(message_of([&] { merge_films(mixed, names); }, ErrorCode::kInput),
                       "a holds light paths, b holds camera samples; merge each kind alone"));
  Film sum = light_film(12, 4);
  sum.attributes[film_key::kLight] = "added";
  const Film images[] = {camera, sum};
  EXPECT_TRUE(contains(message_of([&] { merge_films(images, names); }),
                       "a holds camera samples, b holds camera samples with a light film added"));
}

TEST(SplatLayer, BadSplatsAreCountedAndLeftOut) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const int threads : {1, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    Film film = light_film(2);
    SplatLayer layer(film);
    ASSERT_TRUE(layer.begin_round(4));
    parallel_for(4u, [&](uint32_t b) {
      for (uint64_t i = 0; i < kBundlePaths; ++i) {
        const uint64_t path = b * kBundlePaths + i;
        layer.add(path, 6, 4, Spectrum(2));
        if (i == 17) layer.add(path, 7, 4, Spectrum(1, -1, 1));
        if (i == 18) layer.add(path, 7, 4, Spectrum(nan, 1, 1));
        layer.add(path, 4, 4, Spectrum(nan));  // outside the crop
      }
    });
    layer.finish_round();
    EXPECT_EQ(film.mean(1, 1), Spectrum(2));
    EXPECT_EQ(film.mean(2, 1), Spectrum(0));
    EXPECT_EQ(layer.counts().n_splats, 4u * kBundlePaths);
    EXPECT_EQ(layer.counts().n_negative, 4u);
    EXPECT_EQ(layer.counts().n_not_finite, 4u);
    ASSERT_EQ(layer.counts().bad_splats.size(), 8u);
    EXPECT_EQ(layer.counts().bad_splats[0].path, 17u);
    EXPECT_EQ(layer.counts().bad_splats[7].path, 3u * kBundlePaths + 18);
    EXPECT_EQ(layer.counts().bad_splats[7].x, 7);
  }
}

TEST(SplatLayer, RefusesFilmsThatAreNotItsOwn) {
  Film camera = light_film(1);
  for (uint32_t& count : camera.counts()) count = 4;
  EXPECT_TRUE(contains(message_of([&] { SplatLayer layer(camera); }),
                       "a film with '' light paths per sample cannot be continued as a light film with 256"));
  Film uneven = light_film(1);
  uneven.counts()[3] = 4;
  EXPECT_TRUE(contains(message_of([&] { SplatLayer layer(uneven); }), "the pixels of a light film differ"));
}

}  // namespace
}  // namespace covary
