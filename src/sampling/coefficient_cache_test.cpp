// SPDX-License-Identifier: Apache-2.0
#include "sampling/coefficient_cache.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <functional>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"

namespace covary {
namespace {

const Bounds3 kUnit{{0, 0, 0}, {1, 1, 1}};
const Vec3 kUp{0, 0, 1};

/// Vertices on the floor of a unit room with `n` lights. Each takes one light sample, uniformly chosen, and one
/// direction sample, which finds light (x coordinate · n) half of the time and nothing otherwise.
class Room {
 public:
  using Light = std::function<Spectrum(const Vec3& position, uint32_t light)>;  // f/p if only light samples find it
  Room(uint32_t n, Light light) : n_(n), light_(std::move(light)) {}

  std::vector<float> counts() const { return std::vector<float>(n_, 1.0f / static_cast<float>(n_)); }

  /// One vertex: its plain estimate, and its control with the table's coefficients.
  struct Vertex {
    CellKey key;
    Spectrum plain, control;
    ControlledSample samples[2];
    float r[2];
  };
  void sample(const CoefficientCache& cache, uint64_t number, Vertex& v) const {
    const PathRandom random(Sampling::kIndependent, 3, 0, 0, number);
    const Vec2 u = random.get_2d(1, Event::kLightPosition);
    const Vec3 position{u.x, u.y, 0};
    v.key = cache.key(position, kUp);
    const auto pick = [&](float x) { return std::min(static_cast<uint32_t>(x * static_cast<float>(n_)), n_ - 1); };
    const uint32_t chosen = pick(random.get_1d(1, Event::kLightChoice)), met = pick(u.x);
    // Where a direction finds a light, both techniques could have found it; otherwise only the one that did.
    const float probability = 1.0f / static_cast<float>(n_);
    const auto share = [&](uint32_t light) { return light == met ? probability / (probability + 0.5f) : 1.0f; };
    v.r[0] = 1 - share(chosen);
    v.samples[0] = {light_(position, chosen) * share(chosen), chosen, share(chosen), {&v.r[0], 1}};
    if (random.get_1d(1, Event::kLobe) < 0.5f) {
      v.r[1] = 1 - share(met);
      v.samples[1] = {light_(position, met) * share(met), met, share(met), {&v.r[1], 1}};
    } else {
      v.r[1] = 1;
      v.samples[1] = {Spectrum(0), ControlledSample::kNoLight, 0, {&v.r[1], 1}};
    }
    v.plain = v.samples[0].value + v.samples[1].value;
    v.control = Spectrum(0);
    const uint32_t cell = cache.table().find(v.key);
    if (cell == CoefficientTable::kNone) return;
    const CoefficientTable& table = cache.table();
    v.control = table.light_sum(cell) + table.dense(cell, 0);
    for (const ControlledSample& s : v.samples) {
      if (s.light != ControlledSample::kNoLight) v.control += table.light(cell, s.light) * -s.r_light;
      v.control += table.dense(cell, 0) * -s.r_dense[0];
    }
  }
  /// Tiles of 100 vertices, recorded in parallel and absorbed in order.
  void train(CoefficientCache& cache, uint32_t first_tile, uint32_t n_tiles) const {
    std::vector<SystemSums> sums(n_tiles, cache.new_sums());
    parallel_for(n_tiles, [&](uint32_t tile) {
      Vertex v;
      for (uint32_t i = 0; i < 100; ++i) {
        sample(cache, (first_tile + tile) * 100 + i, v);
        const uint32_t cell = sums[tile].cell(v.key);
        for (const ControlledSample& s : v.samples) sums[tile].add(cell, 1, s);
        if (cache.table().n_cells() > 0) sums[tile].add_held_out(cell, 1, v.plain, v.control);
      }
    });
    for (const SystemSums& tile : sums) cache.absorb(tile);
    cache.update();
  }
  /// Mean and second moment of plain and controlled estimates over fresh vertices.
  struct Moments {
    double plain = 0, controlled = 0, plain_squared = 0, controlled_squared = 0;
  };
  Moments measure(const CoefficientCache& cache, uint32_t n) const {
    Moments m;
    Vertex v;
    for (uint32_t i = 0; i < n; ++i) {
      sample(cache, 1000000 + i, v);
      const uint32_t cell = cache.table().find(v.key);
      const double plain = v.plain.g, scale = cell == CoefficientTable::kNone ? 0 : cache.table().scale(cell).g,
                   controlled = plain + scale * v.control.g;
      m.plain += plain / n, m.controlled += controlled / n;
      m.plain_squared += plain * plain / n, m.controlled_squared += controlled * controlled / n;
    }
    return m;
  }

 private:
  uint32_t n_;
  Light light_;
};

/// Brightness that depends on place and light, not on the technique.
Spectrum smooth_light(const Vec3& p, uint32_t light) {
  const float x = p.x * 4 - static_cast<float>(light % 4);
  return Spectrum(1, 2 / (1 + x * x), p.y) * (1 + static_cast<float>(light % 3));
}

CoefficientCache make_cache(const Room& room, const CacheSettings& settings) {
  return CoefficientCache(kUnit, room.counts(), 1, settings);
}

TEST(CoefficientCache, KnowsNothingBeforeItIsTrained) {
  const CoefficientCache cache(kUnit, {1}, 2, {});
  EXPECT_EQ(CoefficientTable::kNone, cache.table().find(cache.key({0.5f, 0.5f, 0.5f}, kUp)));
}

TEST(CoefficientCache, AnUpdateWithoutSamplesLeavesPlainSampling) {
  CoefficientCache cache(kUnit, {1}, 2, {});
  cache.update();
  EXPECT_EQ(CoefficientTable::kNone, cache.table().find(cache.key({0.5f, 0.5f, 0.5f}, kUp)));
}

TEST(CoefficientCache, ControlsTakeAwayNoiseAndKeepTheMean) {
  const Room room(5, smooth_light);
  CacheSettings settings;
  settings.resolution = 8;
  CoefficientCache cache = make_cache(room, settings);
  room.train(cache, 0, 50);
  room.train(cache, 50, 100);
  const Room::Moments m = room.measure(cache, 20000);
  EXPECT_NEAR(m.plain, m.controlled, 4 * std::sqrt(m.plain_squared / 20000));
  const double plain = m.plain_squared - m.plain * m.plain;
  EXPECT_LT(m.controlled_squared - m.controlled * m.controlled, 0.6 * plain);
}

/// Every cell's sum over all lights equals the sum of its coefficients for them.
TEST(CoefficientCache, SumOverLightsHoldsThoseOfTheParentToo) {
  const Room room(40, smooth_light);
  for (const bool pyramid : {true, false}) {
    CacheSettings settings;
    settings.resolution = 32, settings.pyramid = pyramid;
    CoefficientCache cache = make_cache(room, settings);
    room.train(cache, 0, 20);
    ASSERT_GT(cache.table().n_cells(), 500u);
    for (uint32_t cell = 0; cell < cache.table().n_cells(); ++cell) {
      Spectrum sum;
      for (uint32_t light = 0; light < 40; ++light) sum += cache.table().light(cell, light) * (1.0f / 40);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(sum[c], cache.table().light_sum(cell)[c], 1e-5f);
    }
  }
}

TEST(CoefficientCache, PlacesWithoutDataUseWiderCells) {
  const Room room(3, smooth_light);
  CacheSettings settings;
  settings.resolution = 16;
  CoefficientCache cache = make_cache(room, settings);
  room.train(cache, 0, 40);
  const uint32_t below_ceiling = cache.table().find(cache.key({0.5f, 0.5f, 1}, kUp));
  const uint32_t facing_down = cache.table().find(cache.key({0.5f, 0.5f, 0}, {0, 0, -1}));
  EXPECT_EQ(0u, facing_down) << "the root";
  EXPECT_EQ(0u, below_ceiling);
  EXPECT_NE(0u, cache.table().find(cache.key({0.5f, 0.5f, 0.2f}, kUp))) << "a wider cell reaches up";
  settings.pyramid = false;
  CoefficientCache alone = make_cache(room, settings);
  room.train(alone, 0, 40);
  EXPECT_EQ(CoefficientTable::kNone, alone.table().find(alone.key({0.5f, 0.5f, 1}, kUp)));
}

TEST(CoefficientCache, TellsNormalsApart) {
  const CellGrid by_normal(kUnit, 4, true), by_position(kUnit, 4, false);
  const Vec3 p{0.3f, 0.3f, 0.3f};
  for (const Vec3& n : {Vec3{1, 0, 0}, Vec3{-1, 0.9f, 0}, Vec3{0, 1, -0.9f}, Vec3{0, -1, 0}, Vec3{0, 0, -1}}) {
    EXPECT_FALSE(by_normal.key(p, kUp) == by_normal.key(p, n));
    EXPECT_EQ(by_position.key(p, kUp), by_position.key(p, n));
  }
  EXPECT_EQ(by_normal.key(p, kUp), by_normal.key(p, {0.5f, 0.5f, 0.6f}));
}

TEST(CoefficientCache, PointsOutsideBelongToTheNearestCell) {
  const CellGrid grid({{0, 0, 0}, {2, 1, 1}}, 10, false);
  EXPECT_EQ(9u, grid.key({2, 0, 0}, kUp).x());
  EXPECT_EQ(5u, grid.key({0, 1, 0}, kUp).y());
  EXPECT_EQ(0u, grid.key({-kInfinity, 0, 0}, kUp).x());
  EXPECT_EQ(9u, grid.key({kInfinity, 0, 0}, kUp).x());
  EXPECT_EQ(0u, grid.key({std::nanf(""), 0, 0}, kUp).x());
  const CellGrid flat({{1, 1, 1}, {1, 1, 1}}, 10, false);
  EXPECT_EQ(0u, flat.key({1, 1, 1}, kUp).x());
}

/// Halving the coordinates of a cell gives the cell of the coarser grid, even for odd resolutions.
TEST(CoefficientCache, GridsAreNested) {
  for (uint32_t resolution : {1u, 7u, 64u, 100u}) {
    CellGrid fine(kUnit, resolution, true);
    for (int level = 0; level < 4; ++level) {
      const CellGrid coarse = fine.coarser();
      for (float x = 0; x < 1; x += 0.0625f) {
        const Vec3 p{x, 1 - x, x * x};
        EXPECT_EQ(coarse.key(p, kUp), fine.key(p, kUp).coarser(1));
      }
      fine = coarse;
    }
  }
}

TEST(CoefficientCache, RefusesImpossibleResolutions) {
  for (uint32_t resolution : {0u, 70000u}) {
    CacheSettings settings;
    settings.resolution = resolution;
    try {
      CoefficientCache(kUnit, {1}, 1, settings);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(ErrorCode::kUsage, error.code());
      EXPECT_EQ("a grid of " + std::to_string(resolution) +
                    " cells; between 1 and 65536 along the longest side of the scene are possible",
                error.what());
    }
  }
}

/// The control of a cell with an unrepresentative first wave does harm, which the next wave detects.
TEST(CoefficientCache, SwitchesOffControlsThatDoHarm) {
  CacheSettings settings;
  settings.resolution = 1, settings.prior_vertices = 0, settings.prior_samples = 0;
  CoefficientCache cache(kUnit, {0.5f, 0.5f}, 0, settings);
  const auto wave = [&](float first, float second) {
    SystemSums sums = cache.new_sums();
    for (uint32_t i = 0; i < 100; ++i) {
      const CellKey key = cache.key({0.5f, 0.5f, 0.5f}, kUp);
      const uint32_t cell = sums.cell(key), light = i % 2;
      const Spectrum value(light ? second : first);
      sums.add(cell, 1, {value, light, 1, {}});
      if (const uint32_t own = cache.table().find(key); own != CoefficientTable::kNone)
        sums.add_held_out(cell, 1, value, cache.table().light_sum(own) + cache.table().light(own, light) * -1);
    }
    cache.absorb(sums);
    cache.update();
  };
  wave(3, 1);
  EXPECT_EQ(0u, cache.table().n_switched_off());
  wave(1, 3);
  EXPECT_EQ(cache.table().n_cells(), cache.table().n_switched_off());
  wave(1, 3), wave(1, 3), wave(1, 3);  // the first wave is outvoted
  EXPECT_EQ(0u, cache.table().n_switched_off());
}

TEST(CoefficientCache, LeavesOutSamplesThatAreNotFinite) {
  CoefficientCache cache(kUnit, {1}, 1, {});
  SystemSums sums = cache.new_sums();
  const CellKey key = cache.key({0.5f, 0.5f, 0.5f}, kUp);
  const float r = 0.5f, nan = std::nanf("");
  const uint32_t cell = sums.cell(key);
  sums.add(cell, 1, {Spectrum(nan), 0, 0.5f, {&r, 1}});
  sums.add(cell, kInfinity, {Spectrum(1), 0, 0.5f, {&r, 1}});
  sums.add(cell, -1, {Spectrum(1), 0, 0.5f, {&r, 1}});
  for (int i = 0; i < 10; ++i) sums.add(cell, 1, {Spectrum(2), 0, 0.5f, {&r, 1}});
  sums.add_held_out(cell, 1, Spectrum(nan), Spectrum(1));
  cache.absorb(sums);
  cache.update();
  EXPECT_EQ(3u, cache.n_rejected());
  const uint32_t own = cache.table().find(key);
  EXPECT_TRUE(is_finite(cache.table().light(own, 0)) && is_finite(cache.table().light_sum(own)));
  cache.freeze();
  EXPECT_EQ(3u, cache.n_rejected());
  EXPECT_EQ(own, cache.table().find(key)) << "freezing keeps what was learnt";
}

TEST(CoefficientCache, HasTheSameBitsForAnyNumberOfThreads) {
  const Room room(6, smooth_light);
  std::vector<uint64_t> hashes;
  for (const size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    CoefficientCache cache = make_cache(room, {});
    room.train(cache, 0, 10);
    room.train(cache, 10, 30);
    hashes.push_back(cache.table().hash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
  CoefficientCache other = make_cache(room, {});
  room.train(other, 0, 10);
  EXPECT_NE(hashes[0], other.table().hash());
  other.restart();
  room.train(other, 0, 10), room.train(other, 10, 30);
  EXPECT_EQ(hashes[0], other.table().hash()) << "after a restart nothing of before is left";
}

TEST(CoefficientCache, BecomesCoarserWhenMemoryIsShort) {
  const Room room(40, smooth_light);
  CacheSettings settings;
  settings.resolution = 256;
  CoefficientCache free = make_cache(room, settings);
  room.train(free, 0, 200);
  EXPECT_EQ(0u, free.n_coarsened());
  EXPECT_EQ(256u, free.table().grid().resolution());
  settings.memory_limit = 1 << 20;
  CoefficientCache cache = make_cache(room, settings);
  room.train(cache, 0, 100);
  room.train(cache, 100, 100);
  EXPECT_GE(cache.n_coarsened(), 1u);
  EXPECT_EQ(256u >> cache.n_coarsened(), cache.table().grid().resolution());
  EXPECT_LE(cache.bytes(), settings.memory_limit);
  const Room::Moments m = room.measure(cache, 20000);
  EXPECT_LT(m.controlled_squared, 0.9 * m.plain_squared);
  EXPECT_NEAR(m.plain, m.controlled, 4 * std::sqrt(m.plain_squared / 20000));
}

TEST(CoefficientCache, KeepsToAnyLimitOfMemory) {
  const Room room(40, smooth_light);
  CacheSettings settings;
  settings.resolution = 256;
  for (double limit = 1 << 19; limit < 1 << 23; limit *= 1.15) {
    settings.memory_limit = static_cast<size_t>(limit);
    CoefficientCache cache = make_cache(room, settings);
    for (uint32_t first : {0u, 30u, 60u}) {
      room.train(cache, first, 30);
      EXPECT_LE(cache.bytes(), settings.memory_limit) << cache.n_coarsened() << " times coarser";
    }
  }
}

std::string refused(std::string_view bytes, const std::string& key) {
  try {
    CoefficientTable::from_bytes(bytes, key, "a.training");
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::kInput, error.code());
    return error.what();
  }
  return "";
}

class TrainingFile : public testing::Test {
 protected:
  TrainingFile() : room_(4, smooth_light), cache_(make_cache(room_, {})) {
    room_.train(cache_, 0, 10);
    bytes_ = cache_.table().to_bytes("scene 1");
  }
  Room room_;
  CoefficientCache cache_;
  std::string bytes_;
};

TEST_F(TrainingFile, HoldsEverything) {
  const CoefficientTable read = CoefficientTable::from_bytes(bytes_, "scene 1", "a.training");
  EXPECT_EQ(cache_.table().hash(), read.hash());
  for (float x : {0.1f, 0.5f, 0.9f}) {
    const CellKey key = cache_.key({x, x, 0}, kUp);
    EXPECT_EQ(key, read.grid().key({x, x, 0}, kUp));
    const uint32_t cell = cache_.table().find(key);
    EXPECT_EQ(cell, read.find(key));
    EXPECT_EQ(cache_.table().light(cell, 2), read.light(cell, 2));
  }
  EXPECT_EQ(CoefficientTable::kNone,
            CoefficientTable::from_bytes(CoefficientTable().to_bytes(""), "", "").find(CellKey()));
}

TEST_F(TrainingFile, IsRefusedWhenTruncatedAnywhere) {
  for (size_t size = 0; size < bytes_.size(); size += size < 200 ? 1 : 997)
    EXPECT_NE("", refused(std::string_view(bytes_).substr(0, size), "scene 1")) << size;
  EXPECT_EQ(0u, refused(std::string_view(bytes_).substr(0, 1000), "scene 1").find("a.training: is truncated: "));
}

TEST_F(TrainingFile, IsRefusedWhenItIsSomethingElse) {
  EXPECT_EQ("a.training: is not a training file, as `save-training` writes them", refused("P6 640 480 255", "scene 1"));
  EXPECT_EQ("a.training: was trained for another scene or with other settings: 'scene 1'; 'scene 2' is needed",
            refused(bytes_, "scene 2"));
  std::string newer = bytes_;
  newer[20] = 9;
  EXPECT_EQ("a.training: is a training file of version 9; this program reads version 3", refused(newer, "scene 1"));
  std::string damaged = bytes_;
  damaged[damaged.size() - 20] ^= 1;
  EXPECT_EQ("a.training: is damaged: its content does not match its checksum", refused(damaged, "scene 1"));
  EXPECT_EQ("a.training: is damaged: its content does not match its checksum", refused(bytes_ + "x", "scene 1"));
}

/// Content changes that a checksum would let through: rejected or harmless.
TEST(TrainingFileBody, ManyMutationsAreRefusedOrHarmless) {
  const Room room(4, smooth_light);
  CacheSettings settings;
  settings.resolution = 2;
  CoefficientCache cache = make_cache(room, settings);
  room.train(cache, 0, 1);
  const std::string body = cache.table().body();
  int n_accepted = 0;
  for (uint64_t i = 0; i < 3000; ++i) {
    std::string mutated = body;
    for (uint64_t n = 0; n <= i % 3; ++n) {
      const uint64_t dice = mix64(7 * i + n);
      // Numbers in the header and in the first cells determine sizes.
      mutated[dice % std::min<size_t>(mutated.size(), i % 2 ? 100 : 600)] ^= static_cast<char>(1 << (dice >> 32) % 8);
    }
    if (i % 5 == 0) mutated.resize(mix64(i) % mutated.size());
    try {
      const CoefficientTable table = CoefficientTable::from_body(mutated, "a.training");
      ++n_accepted;
      const uint32_t cell = table.find(table.grid().key({0.3f, 0.3f, 0}, kUp));
      if (cell != CoefficientTable::kNone && table.n_lights() > 3) table.light(cell, 3);
    } catch (const Error& error) {
      ASSERT_EQ(ErrorCode::kInput, error.code()) << error.what();
    }
  }
  EXPECT_GT(n_accepted, 100);
}

// c_k proportional to the root of c_k S_k: here of 0.25 · 1 and 0.75 · 12, so 0.5 : 3; a fifth stays as it was.
TEST(LightSelectionByResiduals, IsThatOfLeastVariance) {
  CoefficientCache cache({{0, 0, 0}, {1, 1, 1}}, {0.25f, 0.75f}, 1, {});
  EXPECT_TRUE(cache.best_selection().empty());
  SystemSums tile = cache.new_sums(), other = cache.new_sums();
  tile.add_residual(1, 2, Spectrum(1, 1, 2));
  tile.add_residual(1, 1, Spectrum(std::nanf("")));
  other.add_residual(0, 1, Spectrum(1));
  other.add_residual(1, 8, Spectrum(1));
  cache.absorb(tile), cache.absorb(other);
  const std::vector<float> selection = cache.best_selection();
  ASSERT_EQ(selection.size(), 2u);
  EXPECT_NEAR(selection[0], 0.2 * 0.25 + 0.8 * 0.5 / 3.5, 1e-6);
  EXPECT_NEAR(selection[1], 0.2 * 0.75 + 0.8 * 3 / 3.5, 1e-6);
  cache.forget_residuals();
  EXPECT_TRUE(cache.best_selection().empty());
}

TEST(LightSelectionByResiduals, KeepsTheSumOfTheControl) {
  const float dense[] = {0.25f}, nothing[] = {0};
  CoefficientCache cache({{0, 0, 0}, {1, 1, 1}}, {0.25f, 0.75f}, 1, {});
  SystemSums sums = cache.new_sums();
  const CellKey key = cache.key({0.5f, 0.5f, 0.5f}, {0, 0, 1});
  for (int i = 0; i < 100; ++i) {
    sums.add(sums.cell(key), 1, {Spectrum(1 + i % 2), static_cast<uint32_t>(i % 2), 0.75f, dense});
    sums.add(sums.cell(key), 1, {Spectrum(3), 0, 1, nothing});
  }
  cache.absorb(sums), cache.update();
  const CoefficientTable before = cache.table();
  cache.select({0.5f, 0.5f});
  const uint32_t cell = cache.table().find(key);
  EXPECT_EQ(cache.table().light_sum(cell), before.light_sum(cell));
  EXPECT_FLOAT_EQ(cache.table().light(cell, 0).r, before.light(cell, 0).r / 2);
  EXPECT_FLOAT_EQ(cache.table().light(cell, 1).g, before.light(cell, 1).g * 1.5f);
  cache.set_selection({1, 2});
  const CoefficientTable read = CoefficientTable::from_bytes(cache.table().to_bytes("key"), "key", "a.training");
  EXPECT_EQ(read.selection(), (std::vector<float>{1, 2}));
  EXPECT_EQ(read.hash(), cache.table().hash());
  EXPECT_NE(read.hash(), before.hash());
}

}  // namespace
}  // namespace covary
