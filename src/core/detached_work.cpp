// SPDX-License-Identifier: Apache-2.0
#include "core/detached_work.h"

#include <tbb/task_group.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "core/stop.h"

namespace covary {
namespace {

constexpr std::chrono::milliseconds kStopPoll{20};

/// Set once, by the job's thread, when the job is done.
class Ending {
 public:
  void set(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    error_ = std::move(error), ended_ = true;
    changed_.notify_all();
  }
  bool is_set() {
    const std::lock_guard lock(mutex_);
    return ended_;
  }
  /// Throws Stopped if the surrounding work is stopped first.
  void wait() {
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, kStopPoll, [this] { return ended_; })) throw_if_stopped();
  }
  void rethrow() const {  // after wait()
    if (error_) std::rethrow_exception(error_);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
  std::exception_ptr error_;
};

struct Job {
  std::shared_ptr<Ending> ending;
  std::thread thread;
};

/// The abandoned jobs. Joined when the process exits, because they use libraries that are torn down afterwards.
class Jobs {
 public:
  static Jobs& left() {
    static Jobs jobs;
    return jobs;
  }
  ~Jobs() {
    for (Job& job : jobs_) job.thread.join();
  }
  void add(Job job) {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  /// Waits for all of them; if Stopped interrupts it, finished jobs remain in the list.
  void wait() {
    std::vector<std::shared_ptr<Ending>> endings;
    {
      const std::lock_guard lock(mutex_);
      for (const Job& job : jobs_) endings.push_back(job.ending);
    }
    for (const std::shared_ptr<Ending>& ending : endings) ending->wait();
    remove_ended();
  }
  bool any() {
    remove_ended();
    const std::lock_guard lock(mutex_);
    return !jobs_.empty();
  }

 private:
  void remove_ended() {
    const std::lock_guard lock(mutex_);
    std::erase_if(jobs_, [](Job& job) {
      const bool ended = job.ending->is_set();
      if (ended) job.thread.join();
      return ended;
    });
  }
  std::mutex mutex_;
  std::vector<Job> jobs_;
};

}  // namespace

void run_detached(std::function<void()> job, const std::function<void()>& cancel) {
  Jobs::left().wait();
  const auto ending = std::make_shared<Ending>();
  std::thread thread([ending, work = std::move(job)]() mutable {
    std::exception_ptr error;
    try {
      work();
    } catch (...) {
      error = std::current_exception();
    }
    work = nullptr;  // release what the job owns before announcing that it has ended
    ending->set(std::move(error));
  });
  try {
    ending->wait();
  } catch (const Stopped&) {
    cancel();
    Jobs::left().add({ending, std::move(thread)});
    throw;
  }
  thread.join();
  ending->rethrow();
}

bool has_detached_work() { return Jobs::left().any(); }

void run_outside(const std::function<void()>& body) {
  // Never destroyed, because objects that keep it may live as long as the process; and never cancelled.
  static auto* context = new tbb::task_group_context(tbb::task_group_context::isolated);
  std::exception_ptr error;
  tbb::task_group group(*context);
  group.run_and_wait([&] {
    try {
      body();
    } catch (...) {  // would cancel the context
      error = std::current_exception();
    }
  });
  if (error) std::rethrow_exception(error);
}

}  // namespace covary
