// SPDX-License-Identifier: Apache-2.0
#pragma once

#ifdef COVARY_PLAIN_THREADS
#include <tbb/global_control.h>

#include <atomic>
#include <exception>
#include <vector>
#else
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#endif

#include <algorithm>
#include <map>
#include <mutex>
#include <thread>
#include <type_traits>

#include "core/stop.h"

namespace covary {

/// Calls body(i) for every i in [0, n), in any order and on as many threads as `tbb::global_control` allows; a thread
/// takes `chunk` (at least 1) consecutive i at a time. Loops may nest. Rethrows the first exception of a body once all
/// threads have stopped; iterations not yet begun are skipped. Throws Stopped inside run_stoppable().
#ifndef COVARY_PLAIN_THREADS
template <typename Index, typename Body>
void parallel_for(Index n, std::type_identity_t<Index> chunk, const Body& body) {
  tbb::parallel_for(
      tbb::blocked_range<Index>(0, std::max(n, Index{0}), chunk),
      [&body](const tbb::blocked_range<Index>& range) {
        for (Index i = range.begin(); i != range.end(); ++i) body(i);
      },
      tbb::simple_partitioner());
  throw_if_stopped();
}
#else
// For ThreadSanitizer: the TBB library is built without it, so that synchronisation between its threads goes unseen and
// shows up as races.
template <typename Index, typename Body>
void parallel_for(Index n, std::type_identity_t<Index> chunk, const Body& body) {
  std::atomic<Index> next{0};
  std::atomic<bool> failed{false};
  std::exception_ptr error;
  std::mutex error_mutex;
  const auto work = [&] {
    try {
      // Relaxed: the counter must not order the bodies, which would hide their races.
      for (Index first;
           !failed.load(std::memory_order_relaxed) && (first = next.fetch_add(chunk, std::memory_order_relaxed)) < n;)
        for (Index i = first; i < std::min(n, first + chunk); ++i) body(i);
    } catch (...) {
      const std::lock_guard lock(error_mutex);
      if (!error) error = std::current_exception();
      failed = true;
    }
  };
  using Control = tbb::global_control;
  std::vector<std::thread> others(Control::active_value(Control::max_allowed_parallelism) - 1);
  for (std::thread& other : others) other = std::thread(work);
  work();
  for (std::thread& other : others) other.join();
  if (error) std::rethrow_exception(error);
}
#endif

/// Same, one iteration at a time.
template <typename Index, typename Body>
void parallel_for(Index n, const Body& body) {
  parallel_for(n, 1, body);
}

/// One T per thread that asks for it.
template <typename T>
class PerThread {
 public:
  /// The calling thread's T, constructed from the arguments on first use. Its address is stable. Thread-safe.
  template <typename... Arguments>
  T& local(const Arguments&... arguments) {
    const std::lock_guard lock(mutex_);
    return values_.try_emplace(std::this_thread::get_id(), arguments...).first->second;
  }
  /// Calls f(T&) for each, in any order. Not while threads are still using theirs.
  template <typename Function>
  void for_each(const Function& f) {
    for (auto& [thread, value] : values_) f(value);
  }

 private:
  std::mutex mutex_;
  std::map<std::thread::id, T> values_;
};

}  // namespace covary
