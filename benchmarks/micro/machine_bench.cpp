// SPDX-License-Identifier: Apache-2.0
// The peak rates of one core of this machine: the roofline for the stages in docs/performance.md.
#include <benchmark/benchmark.h>

#include <vector>

#include "filters/lanes.h"

namespace covary {
namespace {

using namespace lanes;

/// Fused multiply-adds on registers, enough chains to hide their latency. items_per_second: floating-point operations.
void multiply_add(benchmark::State& state) {
  constexpr int kChains = 12, kSteps = 1000;
  vfloat sum[kChains] = {}, factor = splat(0.999f), term = splat(1e-3f);
  for (auto _ : state) {
    for (int step = 0; step < kSteps; ++step)
      for (vfloat& s : sum) s = s * factor + term;
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(state.iterations() * kSteps * kChains * kLanes * 2);
}

/// Sum of an array; bytes_per_second of the memory that holds it: 24 KiB, 512 KiB, 256 MiB.
void read_array(benchmark::State& state) {
  const auto n = static_cast<size_t>(state.range(0)) / sizeof(float);
  const std::vector<float> data(n, 1.0f);
  for (auto _ : state) {
    vfloat sum[8] = {};
    for (size_t i = 0; i < n; i += 8 * kLanes)
      for (int j = 0; j < 8; ++j) sum[j] += load(data.data() + i + j * kLanes);
    benchmark::DoNotOptimize(sum);
  }
  state.SetBytesProcessed(state.iterations() * state.range(0));
}

BENCHMARK(multiply_add);
BENCHMARK(read_array)->Arg(24 << 10)->Arg(512 << 10)->Arg(256 << 20);

}  // namespace
}  // namespace covary
