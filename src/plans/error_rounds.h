// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace covary {

/// The budgets of a render to a wanted error, one after the other: each is decided on the films of the one before, when
/// these are complete. A render that is resumed goes the same way again, so the films keep the budgets
/// (film_key::kBudgets): decided anew on films that are half-way to the next one, they would differ.
class ErrorRounds {
 public:
  explicit ErrorRounds(uint32_t first) : budgets_{first} {}
  uint32_t budget() const { return budgets_[now_]; }
  /// Takes the budgets of a film that another call began, unless more are known, and `limit` for those above it. Throws
  /// Error(kInput), naming `path`, where they make no sense.
  void take(const std::string& text, uint32_t limit, const std::string& path);
  /// Goes on to the next budget if an earlier call decided on one.
  bool repeat();
  /// Goes on to a budget that was decided now.
  void add(uint32_t budget);
  std::string text() const;

 private:
  std::vector<uint32_t> budgets_;
  size_t now_ = 0;
};

}  // namespace covary
