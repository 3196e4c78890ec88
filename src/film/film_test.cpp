// SPDX-License-Identifier: Apache-2.0
// Films: adding samples, merging, file round trips.
#include "film/film.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "core/random.h"
#include "film/film_file.h"
#include "film/image_file.h"
#include "film/merge.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of, test_support::test_file;

/// A pseudo-random sample in [0, 4).
Spectrum sample_at(uint64_t seed, int x, int y, uint32_t s) {
  const PathRandom random(Sampling::kIndependent, seed, 0, y * 1000 + x, s);
  const Vec2 u = random.get_2d(0, Event::kPixel);
  return Spectrum(4 * u.x, 4 * u.y, 4 * random.get_1d(0, Event::kLens));
}

/// Adds samples 0 … n * groups - 1 of a seed.
void add_samples(Film& film, uint64_t seed, uint32_t n) {
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x)
      for (uint32_t s = 0; s < n * film.groups(); ++s) film.add(x, y, sample_at(seed, x, y, s));
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
  const Spectrum value(0.1f, -1e-30f, 3e38f);  // times 49, it would overflow float
  film.set(1, 0, 49, value);
  EXPECT_EQ(film.mean(1, 0), value);
  EXPECT_EQ(film.count(1, 0), 49u);
  EXPECT_EQ(film.count(0, 0), 0u);
  EXPECT_TRUE(contains(message_of([&] { film.set(1, 0, 49, value); }), "only a pixel without samples"));
}

TEST(Film, AddsUpToTheMean) {
  Film film(2, 1, {0, 0, 2, 1}, 2);
  for (const Spectrum& sample : {Spectrum(2, 4, 6), Spectrum(0, 0, 2), Spectrum(0), Spectrum(0), Spectrum(4, 2, 0)})
    film.add(1, 0, sample);
  EXPECT_EQ(film.count(0, 0), 0u);
  EXPECT_EQ(film.count(1, 0), 5u);
  EXPECT_EQ(film.group_mean(1, 0, 0), Spectrum(2, 2, 2));
  EXPECT_EQ(film.group_mean(1, 0, 1), Spectrum(0, 0, 1));
  EXPECT_EQ(film.mean(1, 0), Spectrum(6.0f / 5, 6.0f / 5, 8.0f / 5)) << "three samples and two";
  film.add(1, 0, Spectrum(3, 3, 3));
  EXPECT_EQ(film.group_mean(1, 0, 1), Spectrum(1, 1, static_cast<float>(5.0 / 3)));
  EXPECT_EQ(film.mean(1, 0), Spectrum(1.5f, 1.5f, static_cast<float>((2 + 5.0f / 3) / 2)));
  EXPECT_EQ(film.mean_image().rgb(1, 0), film.mean(1, 0));
  EXPECT_EQ(film.mean_count(), 3);
}

TEST(Film, AddsSumsToGroupsOfEqualSizes) {
  Film film(1, 1, {0, 0, 1, 1}, 2);
  film.add_sums(0, 0, 2, std::vector{Spectrum(2, 4, 6), Spectrum(0, 0, 2)});
  film.add_sums(0, 0, 1, std::vector{Spectrum(4, 2, 0), Spectrum(3, 3, 3)});
  EXPECT_EQ(film.count(0, 0), 6u);
  EXPECT_EQ(film.group_mean(0, 0, 0), Spectrum(2, 2, 2));
  EXPECT_EQ(film.group_mean(0, 0, 1), Spectrum(1, 1, static_cast<float>(5.0 / 3)));
  film.add(0, 0, Spectrum(1));
  EXPECT_TRUE(contains(message_of([&] {
                         film.add_sums(0, 0, 1, std::vector{Spectrum(1), Spectrum(1)});
                       }),
                       "groups of equal sizes"));
}

TEST(Film, HoldsFewerSamplesThanGroups) {
  Film film(1, 1, {0, 0, 1, 1}, 4);
  EXPECT_EQ(film.mean(0, 0), Spectrum(0));
  film.add(0, 0, Spectrum(3));
  film.add(0, 0, Spectrum(5));
  EXPECT_EQ(film.mean(0, 0), Spectrum(4)) << "groups without samples do not count";
  EXPECT_EQ(film.group_mean(0, 0, 2), Spectrum(0));
}

// After some thousand of these samples, 99.9 % of them move the mean by less than half a float spacing. Rounding to
// nearest would lose all of those, and the mean would be too large by 4e-4.
TEST(Film, ALargeMeanForgetsNoSmallDifferences) {
  Film film(1, 1, {0, 0, 1, 1}, 1);
  double sum = 0;
  constexpr uint32_t kSamples = 1u << 17;
  for (uint32_t s = 0; s < kSamples; ++s) {
    const float value = s % 1000 == 999 ? 1.1f : 1.0f;
    sum += value;
    film.add(0, 0, Spectrum(value));
  }
  EXPECT_NEAR(film.mean(0, 0).r, sum / kSamples, 4e-6);
}

TEST(Film, CountsPixelsWithNegativeValues) {
  Image image(4, 2, 3);
  EXPECT_EQ(count_negative_pixels(image), 0u);
  image.pixel(1, 0)[0] = image.pixel(1, 0)[2] = -1;
  image.pixel(3, 1)[2] = -1e-30f;
  image.pixel(2, 1)[1] = -0.0f;
  EXPECT_EQ(count_negative_pixels(image), 2u);
  EXPECT_EQ(count_negative_pixels(Image()), 0u);
}

TEST(Film, RejectsImpossibleSizes) {
  EXPECT_TRUE(contains(message_of([] { Film(0, 5, {0, 0, 1, 1}, 1); }), "film of 0 x 5 pixels"));
  EXPECT_TRUE(contains(message_of([] { Film(4, 4, {2, 0, 3, 1}, 1); }), "3 x 1 pixels at (2, 0)"));
  EXPECT_TRUE(contains(message_of([] { Film(4, 4, {0, 0, 4, 4}, 0); }), "0 groups; expected 1 to 1024"));
  Film film(1, 1, {0, 0, 1, 1}, 1);
  film.counts()[0] = 0xffffffffu;
  EXPECT_TRUE(contains(message_of([&] { film.add(0, 0, Spectrum(1)); }), "4294967296 samples at pixel"));
}

TEST(Film, FileRoundTripIsBitExact) {
  for (int groups : {1, 2, 12, 120}) {
    Film film = test_film(groups, 3, 5);
    film.data()[7] = -0.0f;
    film.data()[8] = 1e-42f;  // denormal
    for (const char* name : {"Albedo", "Depth", "Motion", "N", "P"}) {
      film.aovs[name] = Image(17, 19, name == std::string("Depth") ? 1 : 3);
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
    ASSERT_EQ(read.aovs.size(), 5u);
    for (const char* name : {"Albedo", "Depth", "Motion", "N", "P"})
      EXPECT_EQ(read.aovs.at(name).data, film.aovs.at(name).data);
  }
}

TEST(Film, AFileMayShowMoreThanItsSamples) {
  for (const int groups : {1, 3}) {
    Film film = test_film(groups, 1, 2);
    film.aovs["Albedo"] = Image(17, 19, 3);
    film.shown = Image(17, 19, 3);
    film.shown.data[5] = 7;
    const std::string path = test_file("film.exr");
    write_film(path, film);
    EXPECT_EQ(read_image(path).image.data, film.shown.data);
    const Film read = read_film(path);
    EXPECT_TRUE(same_bits(film, read)) << "its samples are in the groups";
    EXPECT_TRUE(read.shown.data.empty());
    EXPECT_EQ(read.attributes, film.attributes);
    EXPECT_EQ(read.aovs.size(), 1u);
  }
}

TEST(Film, AFileTellsStandardErrorsThatAreNotRead) {
  const Film film = test_film(3, 1, 2);
  Image std_error(17, 19, 3);
  std_error.data[5] = 7;
  const std::string path = test_file("film.exr");
  write_film(path, film, std_error);
  EXPECT_EQ(read_image(path, "StdError").image.data, std_error.data);
  const Film read = read_film(path);
  EXPECT_TRUE(same_bits(film, read));
  EXPECT_TRUE(read.aovs.empty());
}

TEST(Film, AFileTellsHowCountsDiffer) {
  const std::string path = test_file("film.exr");
  Film film = test_film(3, 1, 2);
  write_film(path, film);
  EXPECT_EQ(inspect_image(path).attributes.count("covary:samples_most"), 0u);
  film.add(4, 5, Spectrum(1));
  write_film(path, film);
  const ImageInfo info = inspect_image(path);
  EXPECT_EQ(info.attributes.at("covary:samples_fewest"), "6");
  EXPECT_EQ(info.attributes.at("covary:samples_most"), "7");
  const Film read = read_film(path);
  EXPECT_TRUE(same_bits(film, read));
  EXPECT_EQ(read.attributes, film.attributes);
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

// Where means are exactly representable, merging equals adding the second film's samples after the first's, bit for
// bit, even with groups of unequal sizes. All means are exact here: a group's samples are equal within a film, and
// multiples of 2520, which every number up to 10 divides.
TEST(Film, MergeIsExactWhereMeansAre) {
  Film both(3, 1, {0, 0, 3, 1}, 2), a = both, b = both;
  a.attributes[film_key::kSeed] = "1";
  b.attributes[film_key::kSeed] = "2";
  for (int x = 0; x < 3; ++x) {
    for (int s = 0; s < 5 + x; ++s)
      for (Film* film : {&a, &both}) film->add(x, 0, s % 2 ? Spectrum(2520, 0, 7560) : Spectrum(5040, 2520, 0));
    for (int s = 0; s < 9 - x; ++s)
      for (Film* film : {&b, &both}) film->add(x, 0, s % 2 ? Spectrum(0, 25200, 2520) : Spectrum(0, 5040, 12600));
  }
  const std::vector films{a, b};
  EXPECT_TRUE(same_bits(merge_films(films, std::vector<std::string>{"a", "b"}), both));
}

// In general a merge differs from accumulation by rounding errors. Each is at most 2^-24 of the mean, and the one of
// sample k has weight k / n in a mean of n, so that they add up to at most (n + 1) / 2 times that: here 11 for the 21
// samples, and for the merged ones 8.5 and 3, weighted by 16 and 5, plus one. All values have the same sign.
TEST(Film, MergeEqualsAccumulationUpToRounding) {
  Film both = test_film(12, 1, 16);
  const std::vector films{test_film(12, 1, 16), test_film(12, 2, 5)};
  add_samples(both, 2, 5);
  const Film merged = merge_films(films, std::vector<std::string>{"a", "b"});
  EXPECT_EQ(merged.counts(), both.counts());
  EXPECT_EQ(merged.count(0, 0), 12u * 21);
  for (size_t i = 0; i < both.data().size(); ++i)
    ASSERT_NEAR(merged.data()[i], both.data()[i], 20 * 0x1p-24 * both.data()[i]) << i;
  EXPECT_EQ(merged.attributes.at(film_key::kSeed), "1,2");
  EXPECT_EQ(merged.attributes.at(film_key::kSceneHash), "abc");
  EXPECT_EQ(merged.attributes.at(film_key::kComplete), "true");
}

// Groups of pixels with common random numbers must contain the same samples.
TEST(Film, MergeKeepsCommonRandomNumbersTogether) {
  Film a(2, 1, {0, 0, 2, 1}, 4), b = a;
  a.attributes = {{film_key::kSeed, "1"}, {film_key::kSampling, "crn"}};
  b.attributes = {{film_key::kSeed, "2"}, {film_key::kSampling, "crn"}};
  for (int s = 0; s < 6; ++s)
    for (int x = 0; x < 2; ++x)
      for (Film* film : {&a, &b}) film->add(x, 0, Spectrum(static_cast<float>(s)));
  const auto message = [&] {
    return message_of([&] { merge_films(std::vector{a, b}, std::vector<std::string>{"a", "b"}); });
  };
  EXPECT_EQ(message(), "no error") << "all groups move by two";
  a.add(1, 0, Spectrum(6));
  EXPECT_TRUE(contains(message(), "modulo their 4 groups, here 2 and 3 before b is added"));
  for (Film* film : {&a, &b}) film->attributes[film_key::kSampling] = "independent";
  EXPECT_EQ(message(), "no error");
}

TEST(Film, MergeDoesNotDependOnTheOrder) {
  std::vector<Film> films;
  for (int i = 0; i < 4; ++i) {
    films.push_back(test_film(2, 10 + i, 3 + i * i));
    films.back().aovs["N"] = Image(17, 19, 3);
    films.back().aovs["Depth"] = Image(17, 19, 1);
    for (const char* name : {"Depth", "N"})
      for (float& v : films.back().aovs[name].data) v = 0.1f * (i + 1);
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
    for (const char* name : {"Depth", "N"}) ASSERT_EQ(merged.aovs.at(name).data, other.aovs.at(name).data);
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
  b.attributes.erase(std::string(film_key::kSeed));
  EXPECT_TRUE(contains(message(b),
                       "b.exr: it has no seed, by which films with the same samples are told from others; "
                       "give each its own, in Python by film_from_groups(…, seed=1)"));
  b = test_film(3, 2, 3);
  EXPECT_TRUE(contains(message(b), "number of groups differs: '2' in a.exr, '3' in b.exr"));
  b = test_film(2, 2, 3), b.aovs["N"] = Image(17, 19, 3);
  EXPECT_TRUE(contains(message(b), "auxiliary images differs"));
  b = Film(40, 30, {5, 7, 17, 18}, 2), b.attributes = test_film(2, 2, 3).attributes;
  EXPECT_TRUE(contains(message(b), "17 x 19 at (5, 7) of 40 x 30"));
}

}  // namespace
}  // namespace covary
