// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "core/stopwatch.h"
#include "passes/render_pass.h"

namespace covary {

/// Decides when a pass ends early, and reports its progress: PassSettings::seconds, stop and progress, for the threads
/// of one call. The clock starts at construction.
class PassLimits {
 public:
  /// `total`: samples that the call will take.
  PassLimits(const PassSettings& settings, uint64_t total) : settings_(settings), total_(total) {}

  /// Thread-safe, like advance().
  bool ended() const {
    return out_of_time_.load(std::memory_order_relaxed) ||
           (settings_.stop && settings_.stop->load(std::memory_order_relaxed));
  }
  /// Call after each piece of work, with the number of samples it took.
  void advance(uint64_t n_new) {
    const uint64_t now = done_.fetch_add(n_new) + n_new;
    if (settings_.seconds > 0 && watch_.seconds() >= settings_.seconds) out_of_time_ = true;
    if (settings_.progress) settings_.progress(now, total_);
  }
  double seconds() const { return watch_.seconds(); }

 private:
  const PassSettings& settings_;
  const uint64_t total_;
  const Stopwatch watch_;
  std::atomic<uint64_t> done_{0};
  std::atomic<bool> out_of_time_{false};
};

/// Sorts by pixel and sample and keeps the first few, independently of the order in which they arrived.
void keep_first(std::vector<BadSample>& samples);

}  // namespace covary
