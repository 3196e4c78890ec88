// SPDX-License-Identifier: Apache-2.0
// Films: adding samples, merging, and the round trip through a file.
#include "film/film.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "core/random.h"
#include "film/film_file.h"
#include "film/merge.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of, test_support::test_file;

/// Sums of `n` pseudo-random samples in [0, 4) for each group.
std::vector<Spectrum> sums(const Film& film, uint64_t seed, int x, int y, uint32_t n) {
  std::vector<Spectrum> result(film.groups());
  for (int g = 0; g < film.groups(); ++g)
    for (uint32_t s = 0; s < n; ++s) {
      const PathRandom random(Sampling::kIndependent, seed, g, y * 1000 + x, s);
      const Vec2 u = random.get_2d(0, Event::kPixel);
      result[g] += Spectrum(4 * u.x, 4 * u.y, 4 * random.get_1d(0, Event::kLens));
    }
  return result;
}

void add_samples(Film& film, uint64_t seed, uint32_t n) {
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) film.add(x, y, n, sums(film, seed, x, y, n));
}

Film test_film(int groups, uint64_t seed, uint32_t n) {
  Film film(40, 30, {5, 7, 17, 19}, groups);
  film.attributes = {{film_key::kSeed, std::to_string(seed)}, {film_key::kSampling, "crn"},
                     {film_key::kSceneHash, "abc"},           {film_key::kSettings, "path depth=5"},
                     {film_key::kComplete, "true"},           {film_key::kCommand, "covary render 'a b.xml'"}};
  add_samples(film, seed, n);
  return film;
}

bool same_bits(const Film& a, const Film& b) {
  return a.counts() == b.counts() && a.data().size() == b.data().size() &&
         std::equal(a.data().begin(), a.data().end(), b.data().begin(),
                    [](float u, float v) { return std::bit_cast<uint32_t>(u) == std::bit_cast<uint32_t>(v); });
}

TEST(Film, SetsAPixelExactly) {
  Film film(2, 1, {0, 0, 2, 1}, 1);
  const Spectrum value(0.1f, -1e-30f, 3e38f);  // times 49 it would not be a float
  film.set(1, 0, 49, value);
  EXPECT_EQ(film.mean(1, 0), value);
  EXPECT_EQ(film.count(1, 0), 49u);
  EXPECT_EQ(film.count(0, 0), 0u);
  EXPECT_TRUE(contains(message_of([&] { film.set(1, 0, 49, value); }), "only a pixel without samples"));
}

TEST(Film, AddsUpToTheMean) {
  Film film(2, 1, {0, 0, 2, 1}, 2);
  film.add(1, 0, 2, std::vector{Spectrum(2, 4, 6), Spectrum(0, 0, 2)});
  film.add(1, 0, 1, std::vector{Spectrum(4, 2, 0), Spectrum(3, 3, 3)});
  EXPECT_EQ(film.count(0, 0), 0u);
  EXPECT_EQ(film.count(1, 0), 6u);
  EXPECT_EQ(film.group_mean(1, 0, 0), Spectrum(2, 2, 2));
  EXPECT_EQ(film.group_mean(1, 0, 1), Spectrum(1, 1, static_cast<float>(5.0 / 3)));
  EXPECT_EQ(film.mean(1, 0), Spectrum(1.5f, 1.5f, static_cast<float>((2 + 5.0f / 3) / 2)));
  EXPECT_EQ(film.mean_image().rgb(1, 0), film.mean(1, 0));
  EXPECT_EQ(film.group_image(1).rgb(1, 0), film.group_mean(1, 0, 1));
  EXPECT_EQ(film.mean_count(), 3);
}

TEST(Film, RejectsImpossibleSizes) {
  EXPECT_TRUE(contains(message_of([] { Film(0, 5, {0, 0, 1, 1}, 1); }), "film of 0 x 5 pixels"));
  EXPECT_TRUE(contains(message_of([] { Film(4, 4, {2, 0, 3, 1}, 1); }), "3 x 1 pixels at (2, 0)"));
  EXPECT_TRUE(contains(message_of([] { Film(4, 4, {0, 0, 4, 4}, 0); }), "0 groups; accepted are 1 to 1024"));
  Film film(1, 1, {0, 0, 1, 1}, 1);
  film.add(0, 0, 0xffffffffu, std::vector{Spectrum(1)});
  EXPECT_TRUE(
      contains(message_of([&] { film.add(0, 0, 1, std::vector{Spectrum(1)}); }), "4294967296 samples at pixel"));
}

TEST(Film, FileRoundTripIsBitExact) {
  for (int groups : {1, 2, 12, 120}) {
    Film film = test_film(groups, 3, 5);
    film.data()[7] = -0.0f;
    film.data()[8] = 1e-42f;  // denormal
    for (const char* name : {"Albedo", "N", "P"}) {
      film.aovs[name] = Image(17, 19, 3);
      for (size_t i = 0; i < film.aovs[name].data.size(); ++i) film.aovs[name].data[i] = 0.1f * i + name[0];
    }
    const std::string path = test_file("film.exr");
    write_film(path, film);
    const Film read = read_film(path);
    EXPECT_TRUE(same_bits(film, read)) << groups;
    EXPECT_EQ(read.groups(), groups);
    EXPECT_EQ(read.crop(), film.crop());
    EXPECT_EQ(read.frame_width(), 40);
    EXPECT_EQ(read.frame_height(), 30);
    EXPECT_EQ(read.attributes, film.attributes);
    ASSERT_EQ(read.aovs.size(), 3u);
    for (const char* name : {"Albedo", "N", "P"}) EXPECT_EQ(read.aovs.at(name).data, film.aovs.at(name).data);
  }
}

TEST(Film, ResumedThroughAFileGivesTheSameBits) {
  Film whole = test_film(3, 1, 7);
  Film part = test_film(3, 1, 7);
  add_samples(whole, 2, 9);
  write_film(test_file("part.exr"), part);
  Film resumed = read_film(test_file("part.exr"));
  add_samples(resumed, 2, 9);
  EXPECT_TRUE(same_bits(whole, resumed));
}

// Where the means are exactly representable (here: small integers over powers of two), merging is adding, bit for bit.
TEST(Film, MergeIsExactWhereMeansAre) {
  Film both(3, 1, {0, 0, 3, 1}, 2), a = both, b = both;
  a.attributes[film_key::kSeed] = "1";
  b.attributes[film_key::kSeed] = "2";
  for (int x = 0; x < 3; ++x) {
    const std::vector first{Spectrum(3.0f + x, 5, 7), Spectrum(1, 0, 11)};
    const std::vector second{Spectrum(13, 2.0f + x, 9), Spectrum(4, 6, 8)};
    a.add(x, 0, 4, first), both.add(x, 0, 4, first);
    b.add(x, 0, 4, second), both.add(x, 0, 4, second);
  }
  const std::vector films{a, b};
  EXPECT_TRUE(same_bits(merge_films(films, std::vector<std::string>{"a", "b"}), both));
}

// In general a merge differs from accumulating by the rounding of the second film's mean, and both round the result
// once: each is at most 2^-24 relative, and all values here have one sign, so 3 * 2^-24 of the result bounds the sum.
TEST(Film, MergeEqualsAccumulationUpToRounding) {
  Film both = test_film(12, 1, 16);
  const std::vector films{test_film(12, 1, 16), test_film(12, 2, 5)};
  add_samples(both, 2, 5);
  const Film merged = merge_films(films, std::vector<std::string>{"a", "b"});
  EXPECT_EQ(merged.counts(), both.counts());
  EXPECT_EQ(merged.count(0, 0), 12u * 21);
  for (size_t i = 0; i < both.data().size(); ++i)
    ASSERT_NEAR(merged.data()[i], both.data()[i], 3 * 0x1p-24 * both.data()[i]) << i;
  EXPECT_EQ(merged.attributes.at(film_key::kSeed), "1,2");
  EXPECT_EQ(merged.attributes.at(film_key::kSceneHash), "abc");
  EXPECT_EQ(merged.attributes.at(film_key::kComplete), "true");
}

TEST(Film, MergeDoesNotDependOnTheOrder) {
  std::vector<Film> films;
  for (int i = 0; i < 4; ++i) {
    films.push_back(test_film(2, 10 + i, 3 + i * i));
    films.back().aovs["N"] = Image(17, 19, 3);
    for (float& v : films.back().aovs["N"].data) v = 0.1f * (i + 1);
  }
  films[2].attributes[film_key::kComplete] = "false";
  const std::vector<std::string> names{"a", "b", "c", "d"};
  const Film merged = merge_films(films, names);
  EXPECT_EQ(merged.attributes.at(film_key::kComplete), "false");
  std::vector<int> order{0, 1, 2, 3};
  while (std::next_permutation(order.begin(), order.end())) {
    std::vector<Film> permuted;
    for (int i : order) permuted.push_back(films[i]);
    const Film other = merge_films(permuted, names);
    ASSERT_TRUE(same_bits(merged, other));
    ASSERT_EQ(merged.aovs.at("N").data, other.aovs.at("N").data);
    ASSERT_EQ(merged.attributes, other.attributes);
  }
}

TEST(Film, MergeRejectsWhatDoesNotBelongTogether) {
  const Film a = test_film(2, 1, 3);
  const auto message = [&](const Film& b) {
    const std::vector films{a, b};
    return message_of([&] { merge_films(films, std::vector<std::string>{"a.exr", "b.exr"}); });
  };
  EXPECT_TRUE(contains(message(a), "a.exr and b.exr have the same seed 1 and so the same samples"));
  Film b = test_film(2, 2, 3);
  EXPECT_EQ(message(b), "no error");
  b.attributes[film_key::kSampling] = "independent";
  EXPECT_TRUE(contains(message(b), "sampling differs: 'crn' in a.exr, 'independent' in b.exr"));
  b = test_film(2, 2, 3), b.attributes[film_key::kSceneHash] = "abd";
  EXPECT_TRUE(contains(message(b), "scene_hash differs"));
  b = test_film(2, 2, 3), b.attributes[film_key::kSettings] = "path depth=6";
  EXPECT_TRUE(contains(message(b), "settings differs"));
  b = test_film(2, 2, 3), b.attributes[film_key::kSeed] = "two";
  EXPECT_TRUE(contains(message(b), "b.exr: attribute seed is 'two'"));
  b = test_film(3, 2, 3);
  EXPECT_TRUE(contains(message(b), "number of groups differs: '2' in a.exr, '3' in b.exr"));
  b = test_film(2, 2, 3), b.aovs["N"] = Image(17, 19, 3);
  EXPECT_TRUE(contains(message(b), "auxiliary images differs"));
  b = Film(40, 30, {5, 7, 17, 18}, 2), b.attributes = test_film(2, 2, 3).attributes;
  EXPECT_TRUE(contains(message(b), "17 x 19 at (5, 7) of 40 x 30"));
}

}  // namespace
}  // namespace covary
