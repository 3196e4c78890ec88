// SPDX-License-Identifier: Apache-2.0
// The time that an experiment's runs still take.
#pragma once

#include <cstddef>

namespace covary::lab {

/// Estimates the remaining time from the duration of the runs actually made.
class RunClock {
 public:
  explicit RunClock(double expected_seconds) : expected_(expected_seconds) {}  ///< told until a run has ended
  void add_planned(double work) { work_left_ += work, ++runs_left_; }
  void remove_planned(double work) { work_left_ -= work, --runs_left_; }
  void took(double work, double seconds) { work_ += work, seconds_ += seconds, ++runs_; }
  double seconds_left() const {
    if (runs_ == 0) return expected_;
    return work_ > 0 ? work_left_ * seconds_ / work_
                     : static_cast<double>(runs_left_) * seconds_ / static_cast<double>(runs_);
  }

 private:
  double work_left_ = 0, work_ = 0, seconds_ = 0, expected_ = 0;
  size_t runs_left_ = 0, runs_ = 0;
};

}  // namespace covary::lab
