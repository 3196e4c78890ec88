// SPDX-License-Identifier: Apache-2.0
// The cost of learning a control variate: adding samples to sums, merging the sums of tiles, solving all cells, looking
// up coefficients, and clustering lights. Cells and lights are as in a scene of 280 lights on a grid of 64 cells along
// the longest side, after 15 samples in each of 320 x 240 pixels. Solving and clustering use all threads.
#include <benchmark/benchmark.h>

#include <map>

#include "core/random.h"
#include "sampling/coefficient_cache.h"
#include "sampling/light_clusters.h"

namespace covary {
namespace {

constexpr uint32_t kVerticesOfTile = 32 * 32 * 4;

float number(uint64_t i) { return static_cast<float>(mix64(i) >> 40) * 0x1p-24f; }

/// A point on the walls of the unit cube, near the others of its tile, with its normal.
void place(uint64_t i, Vec3& position, Vec3& normal) {
  const uint64_t tile = i / kVerticesOfTile;
  const auto side = static_cast<int>(tile % 6);
  const float u = number(2 * tile) * 0.8f + 0.2f * number(7 * i),
              v = number(2 * tile + 1) * 0.8f + 0.2f * number(9 * i);
  position = Vec3(), normal = Vec3();
  position[side / 2] = side % 2 ? 1.0f : 0.0f, normal[side / 2] = side % 2 ? -1.0f : 1.0f;
  position[(side / 2 + 1) % 3] = u, position[(side / 2 + 2) % 3] = v;
}

CoefficientCache make_cache(uint32_t n_lights) {
  return {Bounds3{{0, 0, 0}, {1, 1, 1}}, std::vector<float>(n_lights, 1.0f / static_cast<float>(n_lights)), 2, {}};
}

/// The three samples of a vertex, added to sums.
void add_vertex(const CoefficientCache& cache, SystemSums& sums, uint64_t i, uint32_t n_lights) {
  Vec3 position, normal;
  place(i, position, normal);
  const uint32_t cell = sums.cell(cache.key(position, normal));
  const auto light = [&](uint64_t k) { return static_cast<uint32_t>(number(k) * static_cast<float>(n_lights)); };
  const float x = number(11 * i), from_light[] = {0.2f * x, 0}, from_bsdf[] = {x, 0}, nothing[] = {0.9f, 0.1f};
  sums.add(cell, 1, {Spectrum(x, 1, 2), light(13 * i), 1 - from_light[0], from_light});
  sums.add(cell, 1, {Spectrum(x, 1, 2), light(17 * i), 1 - x, from_bsdf});
  sums.add(cell, 1, {Spectrum(0), ControlledSample::kNoLight, 0, nothing});
}

void add_tile(const CoefficientCache& cache, SystemSums& sums, uint64_t tile, uint32_t n_lights) {
  for (uint64_t i = 0; i < kVerticesOfTile; ++i) add_vertex(cache, sums, tile * kVerticesOfTile + i, n_lights);
}

/// Items are vertices with three samples.
void BM_AddSamples(benchmark::State& state) {
  const auto n_lights = static_cast<uint32_t>(state.range(0));
  const CoefficientCache cache = make_cache(n_lights);
  SystemSums sums = cache.new_sums();
  uint64_t tile = 0;
  for (auto _ : state) {
    sums.clear();
    add_tile(cache, sums, tile++, n_lights);
  }
  state.SetItemsProcessed(state.iterations() * kVerticesOfTile);
}
BENCHMARK(BM_AddSamples)->Arg(4)->Arg(280)->Arg(5000);

/// Made once for each number of lights.
CoefficientCache& trained(uint32_t n_lights) {
  static std::map<uint32_t, CoefficientCache> caches;
  const auto [found, is_new] = caches.try_emplace(n_lights, make_cache(n_lights));
  if (!is_new) return found->second;
  SystemSums sums = found->second.new_sums();
  for (uint64_t tile = 0; tile < 15 * 320 * 240 * 4 / kVerticesOfTile; ++tile) {
    sums.clear();
    add_tile(found->second, sums, tile, n_lights);
    found->second.absorb(sums);
  }
  return found->second;
}

/// Items are vertices; a tile's sums are merged at once.
void BM_Absorb(benchmark::State& state) {
  const auto n_lights = static_cast<uint32_t>(state.range(0));
  CoefficientCache& cache = trained(n_lights);
  SystemSums sums = cache.new_sums();
  add_tile(cache, sums, 17, n_lights);
  for (auto _ : state) cache.absorb(sums);
  state.SetItemsProcessed(state.iterations() * kVerticesOfTile);
}
BENCHMARK(BM_Absorb)->Arg(4)->Arg(280)->Arg(5000);

/// Items are the cells of the table.
void BM_SolveAllCells(benchmark::State& state) {
  CoefficientCache& cache = trained(static_cast<uint32_t>(state.range(0)));
  for (auto _ : state) cache.update();
  state.SetItemsProcessed(state.iterations() * cache.table().n_cells());
  state.counters["MiB"] = static_cast<double>(cache.bytes()) / (1 << 20);
  state.counters["cells"] = cache.table().n_cells();
}
BENCHMARK(BM_SolveAllCells)->Arg(4)->Arg(280)->Arg(5000)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

/// Items are vertices: a cell, two lights, two dense techniques.
void BM_LookUp(benchmark::State& state) {
  const auto n_lights = static_cast<uint32_t>(state.range(0));
  CoefficientCache& cache = trained(n_lights);
  cache.update();
  uint64_t i = 0;
  for (auto _ : state) {
    ++i;
    Vec3 position, normal;
    place(i, position, normal);
    const CoefficientTable& table = cache.table();
    const uint32_t cell = table.find(cache.key(position, normal));
    Spectrum control = table.light_sum(cell) + table.dense(cell, 0) + table.dense(cell, 1);
    for (uint64_t k : {2 * i, 2 * i + 1})
      control += table.light(cell, static_cast<uint32_t>(number(k) * static_cast<float>(n_lights)));
    benchmark::DoNotOptimize(control * table.scale(cell));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_LookUp)->Arg(4)->Arg(280)->Arg(5000);

/// Items are lights.
void BM_Clusters(benchmark::State& state) {
  std::vector<ClusterLight> lights(static_cast<size_t>(state.range(0)));
  for (uint64_t i = 0; i < lights.size(); ++i) {
    const Vec3 p{number(6 * i), number(6 * i + 1), number(6 * i + 2)};
    lights[i].bounds.extend(p);
    lights[i].axis = normalize(Vec3{number(6 * i + 3) - 0.5f, number(6 * i + 4) - 0.5f, 0.1f});
    lights[i].cos_half_angle = 1, lights[i].power = number(6 * i + 5);
  }
  for (auto _ : state) benchmark::DoNotOptimize(cluster_lights(lights, 5000, 1).n_clusters);
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(BM_Clusters)->Arg(100)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace covary
