// SPDX-License-Identifier: Apache-2.0
#include "core/stop.h"

#include <tbb/task.h>
#include <tbb/task_group.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace covary {
namespace {

constexpr std::chrono::milliseconds kPoll{20};

/// Cancels a task group once `stop` returns true.
class Watcher {
 public:
  Watcher(const std::function<bool()>& stop, tbb::task_group_context& context)
      : thread_([this, &stop, &context] {
          std::unique_lock lock(mutex_);
          while (!ended_.wait_for(lock, kPoll, [this] { return end_; }))
            if (stop()) context.cancel_group_execution();
        }) {}
  ~Watcher() {
    {
      const std::lock_guard lock(mutex_);
      end_ = true;
    }
    ended_.notify_all();
    thread_.join();
  }
  Watcher(const Watcher&) = delete;
  Watcher& operator=(const Watcher&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  bool end_ = false;
  std::thread thread_;  // declared last because it uses the other members
};

}  // namespace

bool run_stoppable(const std::function<bool()>& stop, const std::function<void()>& body) {
  if (stop()) return false;
  // Loops inside inherit the context, which cancels them.
  tbb::task_group_context context;
  std::exception_ptr error;
  bool ended = false;
  {
    const Watcher watcher(stop, context);
    try {
      tbb::task_group group(context);
      group.run_and_wait([&] {
        body();
        ended = true;
      });
    } catch (...) {
      error = std::current_exception();
    }
  }
  if (error && !stop()) std::rethrow_exception(error);
  return ended && !error;
}

bool run_stoppable(const std::atomic<bool>* stop, const std::function<void()>& body) {
  if (stop) return run_stoppable([stop] { return stop->load(); }, body);
  body();
  return true;
}

void throw_if_stopped() {
  if (tbb::is_current_task_group_canceling()) throw Stopped();
}

}  // namespace covary
