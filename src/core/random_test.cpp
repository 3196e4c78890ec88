// SPDX-License-Identifier: Apache-2.0
// Addressable random numbers: uniform along every coordinate of the address, independent between neighbouring
// addresses, and for common random numbers the pixel, and only the pixel, is left out.
#include "core/random.h"

#include <gtest/gtest.h>

#include <bit>
#include <functional>
#include <set>

#include "statistics/chi2.h"

namespace covary {
namespace {

using statistics::Chi2Result;

/// An address, and the generators under test as functions of it.
struct Address {
  Sampling sampling = Sampling::kIndependent;
  uint64_t seed = 7;
  uint32_t pass = 0;
  uint64_t pixel = 1000;
  uint64_t sample = 0;
  uint64_t subpath = 0;  // 0: camera, n: light subpath n - 1
  uint32_t vertex = 2;
  Event event = Event::kDirection;
};
using Generator = std::function<Vec2(const Address&)>;

PathRandom path(const Address& a) {
  const PathRandom random(a.sampling, a.seed, a.pass, a.pixel, a.sample);
  return a.subpath == 0 ? random.subpath(Subpath::kCamera)
                        : random.subpath(Subpath::kLight, static_cast<uint32_t>(a.subpath - 1));
}
Vec2 covary_numbers(const Address& a) { return path(a).get_2d(a.vertex, a.event); }

/// Planted bug: coordinates are combined as a sum of multiples, without hashing.
Vec2 additive_numbers(const Address& a) {
  const double k = a.seed * 0.618033988749895 + a.pass * 0.7548776662466927 + a.pixel * 0.5698402909980532 +
                   a.sample * 0.8191725133961645 + a.vertex * 0.6710436067037893 + double(a.event) * 0.2865123 +
                   a.subpath * 0.4503599627370496;
  const double l = k * 1.3247179572;
  return {float(k - std::floor(k)) * kOneMinusEpsilon, float(l - std::floor(l)) * kOneMinusEpsilon};
}

/// Ways to walk through addresses: one coordinate varies, the others are fixed.
struct Walk {
  const char* name;
  void (*step)(Address& a, uint64_t by);
};
const Walk kWalks[] = {
    {"seeds", [](Address& a, uint64_t by) { a.seed += by; }},
    {"passes", [](Address& a, uint64_t by) { a.pass += by; }},
    {"pixels", [](Address& a, uint64_t by) { a.pixel += by; }},
    {"rows", [](Address& a, uint64_t by) { a.pixel += 720 * by; }},
    {"samples", [](Address& a, uint64_t by) { a.sample += by; }},
    {"subpaths", [](Address& a, uint64_t by) { a.subpath += by; }},
    {"vertices", [](Address& a, uint64_t by) { a.vertex += by; }},
    {"events", [](Address& a, uint64_t by) { a.event = Event(uint32_t(a.event) + by); }},
};

/// Chi-square over 32 x 32 equal cells of n pairs.
Chi2Result test_pairs(const std::string& name, int n, const std::function<Vec2(int)>& pair) {
  std::vector<double> observed(1024), probabilities(1024, 1.0 / 1024);
  for (int i = 0; i < n; ++i) {
    const Vec2 p = pair(i);
    ++observed[int(p.x * 32) * 32 + int(p.y * 32)];
  }
  return statistics::chi2_discrete(observed, probabilities, {.name = name});
}

constexpr int kPairs = 200000;

Chi2Result test_uniform(const Generator& generator, const Walk& walk) {
  return test_pairs(walk.name, kPairs, [&](int i) {
    Address a;
    walk.step(a, i);
    return generator(a);
  });
}
/// Pairs of numbers whose addresses differ by one step of `walk`, over many samples, or over pixels if the walk is
/// along samples.
Chi2Result test_independent(const Generator& generator, const Walk& walk) {
  return test_pairs(walk.name, kPairs, [&](int i) {
    Address a;
    (walk.name == std::string("samples") ? a.pixel : a.sample) += 2 * i;
    Address b = a;
    walk.step(b, 1);
    return Vec2{generator(a).x, generator(b).x};
  });
}

// N = 200 000 pairs in 1024 cells, alpha = 5e-7 on either side (a sequence may also be too regular): detects, with
// power 0.99, a density wrong by 4.3 % rms. Planted bugs: numbers on a lattice, and numbers skewed upwards by 3 %.
TEST(PathRandom, IsUniformAlongEveryCoordinate) {
  const auto accepted = [](const Chi2Result& r) { return r.accepted && r.p_value < 1 - statistics::test_alpha(); };
  const Generator pushed = [](const Address& a) {
    const Vec2 u = covary_numbers(a);
    return Vec2{std::pow(u.x, 0.94f) * kOneMinusEpsilon, u.y};
  };
  for (const Walk& walk : kWalks) {
    if (walk.name == std::string("events")) continue;  // there are too few
    const Chi2Result result = test_uniform(covary_numbers, walk);
    EXPECT_TRUE(accepted(result)) << result.message;
    EXPECT_FALSE(accepted(test_uniform(additive_numbers, walk))) << walk.name;
    EXPECT_FALSE(accepted(test_uniform(pushed, walk))) << walk.name;
  }
}

TEST(PathRandom, NeighbouringAddressesAreIndependent) {
  for (const Walk& walk : kWalks) {
    const Chi2Result result = test_independent(covary_numbers, walk);
    EXPECT_TRUE(result.accepted) << result.message;
    EXPECT_FALSE(test_independent(additive_numbers, walk).accepted) << walk.name;
  }
}

// Correlation of N = 200 000 pairs, alpha = 5e-7: detects |r| = 0.0165 with power 0.99. Planted bug: a twentieth of the
// pairs share their numbers.
TEST(PathRandom, NeighbouringAddressesAreUncorrelated) {
  for (const Walk& walk : kWalks)
    for (const bool planted : {false, true}) {
      statistics::Moments product;
      for (int i = 0; i < kPairs; ++i) {
        Address a;
        (walk.name == std::string("samples") ? a.pixel : a.sample) += 2 * i;
        Address b = a;
        if (!planted || i % 20) walk.step(b, 1);
        // Mean 0 and variance 1 each.
        product.add(12 * (covary_numbers(a).y - 0.5) * (covary_numbers(b).y - 0.5));
      }
      const auto result = statistics::z_test(product.mean(), product.variance_of_mean(), 0);
      EXPECT_EQ(result.accepted, !planted) << walk.name << ": " << result.message;
    }
}

// The two numbers of one event, and numbers of two events. Planted bug: the same event read for both a choice and a
// sample.
TEST(PathRandom, EventsAreIndependent) {
  const auto test = [](Event first, Event second) {
    return test_pairs("events", kPairs, [&](int i) {
      const PathRandom random = path({.sample = uint64_t(i)});
      return Vec2{random.get_1d(1, first), random.get_2d(1, second).x};
    });
  };
  const Chi2Result right = test(Event::kLobe, Event::kDirection);
  EXPECT_TRUE(right.accepted) << right.message;
  EXPECT_FALSE(test(Event::kDirection, Event::kDirection).accepted);
}

// N = 400 000 in 256 cells of the lowest 8 of 24 bits, alpha = 5e-7: detects 2.3 % rms. Planted bug: 20-bit numbers.
TEST(PathRandom, LowBitsAreUniform) {
  for (const bool planted : {false, true}) {
    std::vector<double> observed(256), probabilities(256, 1.0 / 256);
    for (int i = 0; i < 400000; ++i) {
      const float u = path({.sample = uint64_t(i)}).get_1d(3, Event::kLobe);
      const float v = planted ? std::floor(u * 0x1p20f) * 0x1p-20f : u;
      ++observed[static_cast<uint32_t>(v * 0x1p24f) & 255];
    }
    EXPECT_EQ(statistics::chi2_discrete(observed, probabilities, {.name = "low bits"}).accepted, !planted);
  }
}

TEST(PathRandom, StaysBelowOne) {
  float lowest = 1, highest = 0;
  for (uint64_t i = 0; i < 20000000; i += 2) {
    const Vec2 u = path({.pixel = i}).get_2d(0, Event::kPixel);
    lowest = std::min({lowest, u.x, u.y}), highest = std::max({highest, u.x, u.y});
  }
  EXPECT_GE(lowest, 0);
  EXPECT_LT(highest, 1);
  EXPECT_LT(lowest, 0x1p-20f);
  EXPECT_GT(highest, 1 - 0x1p-20f);
}

TEST(PathRandom, CommonNumbersLeaveOutThePixelAndNothingElse) {
  const Address crn{.sampling = Sampling::kCrn};
  Address other = crn;
  other.pixel += 12345;
  EXPECT_EQ(covary_numbers(crn), covary_numbers(other));
  for (const Walk& walk : kWalks) {
    Address changed = crn;
    walk.step(changed, 1);
    const bool is_pixel = changed.pixel != crn.pixel;
    EXPECT_EQ(covary_numbers(crn) == covary_numbers(changed), is_pixel) << walk.name;
    Address independent;
    changed = independent;
    walk.step(changed, 1);
    EXPECT_NE(covary_numbers(independent), covary_numbers(changed)) << walk.name;
  }
  // Copies and repeated reads see the same numbers: there is no state.
  const PathRandom random = path(crn), copy = random;
  random.get_1d(9, Event::kLobe);
  EXPECT_EQ(random.get_2d(2, Event::kDirection), copy.get_2d(2, Event::kDirection));
}

// Sobol' numbers: the samples of a group share the sequence of an event; any other change of address gives another
// sequence. N and alpha as above; pairs vary over pixels. Planted bug: a step that does not change the address.
TEST(PathRandom, SequencesOfNeighbouringAddressesAreIndependent) {
  struct Point {
    Address address;
    uint32_t group = 3, index = 5;
  };
  const auto numbers = [](const Point& p) {
    const Address& a = p.address;
    const PathRandom random = PathRandom::sobol(a.sampling, a.seed, a.pass, a.pixel, p.group, p.index);
    return (a.subpath == 0 ? random : random.subpath(Subpath::kLight, uint32_t(a.subpath - 1)))
        .get_2d(a.vertex, a.event);
  };
  const auto test = [&](const std::string& name, const std::function<void(Point&)>& step) {
    return test_pairs(name, kPairs, [&](int i) {
      Point a;
      a.address.pixel += 10000 * i;
      Point b = a;
      step(b);
      return Vec2{numbers(a).x, numbers(b).x};
    });
  };
  for (const Walk& walk : kWalks)
    if (walk.name != std::string("samples")) {
      const Chi2Result result = test(walk.name, [&](Point& p) { walk.step(p.address, 1); });
      EXPECT_TRUE(result.accepted) << result.message;
    }
  EXPECT_TRUE(test("groups", [](Point& p) { ++p.group; }).accepted);
  EXPECT_FALSE(test("samples", [](Point& p) { ++p.index; }).accepted) << "points of a sequence keep their distance";
  EXPECT_FALSE(test("nothing", [](Point&) {}).accepted);
}

TEST(PathRandom, SamplesOfAGroupArePointsOfOneSequenceForEachEvent) {
  for (const Sampling sampling : {Sampling::kIndependent, Sampling::kCrn}) {
    std::set<int> columns, rows;
    for (uint32_t index = 0; index < 64; ++index) {
      const PathRandom random = PathRandom::sobol(sampling, 7, 1, 1000, 2, index);
      const Vec2 u = random.get_2d(2, Event::kDirection);
      EXPECT_EQ(u.x, random.get_1d(2, Event::kDirection));
      columns.insert(int(u.x * 64)), rows.insert(int(u.y * 64));
      const PathRandom elsewhere = PathRandom::sobol(sampling, 7, 1, 1001, 2, index);
      EXPECT_EQ(elsewhere == random, sampling == Sampling::kCrn) << "the pixel, and nothing else";
      EXPECT_FALSE(random == PathRandom(sampling, 7, 1, 1000, index));
    }
    EXPECT_EQ(columns.size(), 64u);
    EXPECT_EQ(rows.size(), 64u);
  }
}

// Resuming and merging films rely on these values.
TEST(PathRandom, AddressesKeepTheirNumbers) {
  const auto bits = [](float u) { return static_cast<uint32_t>(u * 0x1p24f); };
  const PathRandom random(Sampling::kIndependent, 7, 1, 1000, 3), crn(Sampling::kCrn, 7, 1, 1000, 3);
  EXPECT_EQ(bits(random.get_1d(0, Event::kPixel)), 5967396u);
  EXPECT_EQ(bits(random.get_2d(2, Event::kDirection).y), 7371280u);
  EXPECT_EQ(bits(crn.get_1d((1u << 20) + 4, Event::kLobe)), 2745078u);
  EXPECT_EQ(bits(random.subpath(Subpath::kCamera).get_1d(0, Event::kPixel)), 5967396u);
  EXPECT_EQ(bits(random.subpath(Subpath::kLight).get_1d(0, Event::kPixel)), 10187763u);
  EXPECT_EQ(bits(random.subpath(Subpath::kLight, 5).get_1d(0, Event::kPixel)), 6422205u);
  const PathRandom sobol = PathRandom::sobol(Sampling::kIndependent, 7, 1, 1000, 3, 12);
  EXPECT_EQ(bits(sobol.get_1d(0, Event::kPixel)), 7972066u);
  EXPECT_EQ(bits(sobol.get_2d(2, Event::kDirection).y), 7025476u);
  EXPECT_EQ(bits(sobol.subpath(Subpath::kLight).get_1d(0, Event::kPixel)), 9880291u);
}

// Of 10 000 pairs of 24-bit numbers from two seeds, 0.0006 are expected to be equal; from one seed, all are.
TEST(PathRandom, SeedsGiveDifferentNumbers) {
  int n_equal = 0;
  for (uint64_t i = 0; i < 10000; ++i)
    n_equal += covary_numbers({.seed = 1, .sample = i}).x == covary_numbers({.seed = 2, .sample = i}).x;
  EXPECT_LE(n_equal, 2);
}

// Flipping any input bit flips each output bit in half of N = 10 000 trials; 4096 comparisons share alpha = 5e-7: |z| >
// 6.4, which detects a probability off by 0.044 with power 0.99. Planted bug: one multiplication without shifts.
TEST(Mix64, EveryInputBitFlipsEveryOutputBit) {
  const auto worst_z = [](uint64_t (*mix)(uint64_t)) {
    double worst = 0;
    for (int in = 0; in < 64; ++in) {
      std::vector<int> flips(64);
      for (uint64_t i = 0; i < 10000; ++i) {
        const uint64_t x = combine64(in, i), change = mix(x) ^ mix(x ^ (uint64_t{1} << in));
        for (int out = 0; out < 64; ++out) flips[out] += (change >> out) & 1;
      }
      for (const int n : flips) worst = std::max(worst, std::abs(n - 5000) / 50.0);
    }
    return worst;
  };
  EXPECT_LT(worst_z(mix64), 6.4);
  EXPECT_GT(worst_z([](uint64_t z) -> uint64_t { return z * 0xbf58476d1ce4e5b9ull; }), 6.4);
  std::set<uint64_t> keys;
  for (uint64_t a = 0; a < 100; ++a)
    for (uint64_t b = 0; b < 100; ++b) keys.insert(combine64(a, b));
  EXPECT_EQ(keys.size(), 10000u);  // (a, b) and (b, a) differ, too
}

}  // namespace
}  // namespace covary
