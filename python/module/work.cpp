// SPDX-License-Identifier: Apache-2.0
#include "python/module/work.h"

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/stop.h"

namespace covary::python {
namespace {

constexpr std::chrono::milliseconds kPoll{50};

/// A flag that threads wait for.
class Event {
 public:
  void set() {
    const std::lock_guard lock(mutex_);
    set_ = true;
    changed_.notify_all();
  }
  /// Whether it was set before the time limit.
  bool wait() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPoll, [this] { return set_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool set_ = false;
};

/// A thread that waits for jobs. Threads are kept between calls, because each new one that enters TBB leaves some of
/// TBB's memory behind.
class Worker {
 public:
  Worker() {
    std::thread([this] { loop(); }).detach();
  }
  void start(std::function<void()> job) {
    const std::lock_guard lock(mutex_);
    job_ = std::move(job);
    changed_.notify_one();
  }

 private:
  void loop() {
    for (;;) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return job_ != nullptr; });
      const std::function<void()> job = std::exchange(job_, nullptr);
      lock.unlock();
      job();
    }
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void()> job_;
};

/// Idle workers. There are as many workers as there were concurrent calls; they live, undestroyed, until the process
/// ends.
class Workers {
 public:
  static Workers& all() {
    static auto* workers = new Workers;
    return *workers;
  }
  Worker* take() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return new Worker;
    Worker* worker = idle_.back();
    idle_.pop_back();
    return worker;
  }
  void give_back(Worker* worker) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(worker);
  }

 private:
  std::mutex mutex_;
  std::vector<Worker*> idle_;
};

void check_not_forked() {
  static const pid_t first = getpid();
  if (getpid() != first)
    throw Error(ErrorCode::kUsage,
                "covary was used before this process was forked, and its threads are not in the copy; start processes "
                "by multiprocessing.get_context('spawn'), or use covary in them only");
}

/// Calls `progress` if the numbers or the phase have changed.
class Reporter {
 public:
  explicit Reporter(nb::handle progress) : progress_(progress) {}
  void report(const WorkState& state) {
    const uint64_t done = state.done, total = state.total;
    const char* phase = state.phase;
    if (progress_.is_none() || (total == 0 && !phase)) return;
    if (done == done_ && total == total_ && phase == phase_) return;
    done_ = done, total_ = total, phase_ = phase;
    if (phase)
      progress_(done, total, phase);
    else
      progress_(done, total);
  }

 private:
  nb::handle progress_;
  uint64_t done_ = 0, total_ = 0;
  const char* phase_ = nullptr;
};

}  // namespace

void run_work(const std::function<void(WorkState&)>& work, nb::handle progress) {
  check_not_forked();
  WorkState state;
  const auto finished = std::make_shared<Event>();  // the worker leaves it after this function may have
  std::exception_ptr error, raised;
  Worker* worker = Workers::all().take();
  worker->start([&, finished] {
    try {
      work(state);
    } catch (...) {
      error = std::current_exception();
    }
    finished->set();
  });
  Reporter reporter(progress);
  const auto look = [&] {
    if (raised) return;
    try {
      if (PyErr_CheckSignals() != 0) throw nb::python_error();
      reporter.report(state);
    } catch (...) {
      raised = std::current_exception();
      state.stop = true;
    }
  };
  {
    const nb::gil_scoped_release release;
    while (!finished->wait()) {
      const nb::gil_scoped_acquire acquire;
      look();
    }
  }
  Workers::all().give_back(worker);
  if (!error) look();  // the last numbers
  if (raised) std::rethrow_exception(raised);
  if (error) std::rethrow_exception(error);
}

bool run_stoppable(WorkState& state, const std::function<void()>& body) {
  return covary::run_stoppable(&state.stop, body);
}

}  // namespace covary::python
