// SPDX-License-Identifier: Apache-2.0
#include "core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace covary {
namespace {

TEST(ParallelFor, CallsEachIndexOnce) {
  for (const int n : {0, 1, 7, 1000})
    for (const int chunk : {1, 3, 64}) {
      std::vector<std::atomic<int>> calls(n);
      parallel_for(n, chunk, [&](int i) { ++calls[i]; });
      for (int i = 0; i < n; ++i) EXPECT_EQ(calls[i], 1) << i << " of " << n << " by " << chunk;
    }
}

TEST(ParallelFor, Nests) {
  std::atomic<size_t> sum{0};
  parallel_for(size_t{20}, [&](size_t i) { parallel_for(size_t{10}, [&](size_t j) { sum += i * j; }); });
  EXPECT_EQ(sum, 190u * 45u);
}

TEST(ParallelFor, ThrowsWhatABodyThrew) {
  std::atomic<int> running{0};
  const auto loop = [&] {
    parallel_for(1000, [&](int i) {
      ++running;
      if (i == 500) {
        --running;
        throw std::runtime_error("500");
      }
      --running;
    });
  };
  EXPECT_THROW(loop(), std::runtime_error);
  EXPECT_EQ(running, 0) << "bodies still run after the loop has ended";
}

TEST(ParallelFor, MakesWritesVisibleToTheCaller) {
  std::vector<int> squares(5000);
  parallel_for(5000, 16, [&](int i) { squares[i] = i * i; });
  for (int i = 0; i < 5000; ++i) ASSERT_EQ(squares[i], i * i);
}

TEST(PerThread, AddsUpWhatEachThreadCounted) {
  struct Count {
    int n = 0;
  };
  PerThread<Count> counts;
  parallel_for(5000, 16, [&](int) { ++counts.local().n; });
  int sum = 0;
  counts.for_each([&](const Count& count) { sum += count.n; });
  EXPECT_EQ(sum, 5000);
  EXPECT_EQ(&counts.local(), &counts.local());
}

}  // namespace
}  // namespace covary
