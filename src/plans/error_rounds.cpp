// SPDX-License-Identifier: Apache-2.0
#include "plans/error_rounds.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "core/error.h"

namespace covary {

void ErrorRounds::take(const std::string& text, uint32_t limit, const std::string& path) {
  std::vector<uint32_t> budgets;
  std::istringstream words(text);
  bool good = true;
  for (std::string word; good && words >> word;) {
    uint64_t budget = 0;
    good = word.size() <= 10 && word.find_first_not_of("0123456789") == std::string::npos;
    if (good) budget = std::stoull(word);
    good = good && budget > (budgets.empty() ? 0 : budgets.back()) && budget <= UINT32_MAX;
    budgets.push_back(static_cast<uint32_t>(budget));
  }
  if (!good || budgets.empty())
    throw Error(ErrorCode::kInput, fmt::format("{}: attribute covary:budgets is '{}'; expected are numbers of samples "
                                               "per pixel, ascending",
                                               path, text));
  for (uint32_t& budget : budgets) budget = std::min(budget, limit);
  budgets.erase(std::unique(budgets.begin(), budgets.end()), budgets.end());
  if (budgets.size() >= budgets_.size()) budgets_ = std::move(budgets);
}

bool ErrorRounds::repeat() {
  if (now_ + 1 == budgets_.size()) return false;
  ++now_;
  return true;
}

void ErrorRounds::add(uint32_t budget) {
  budgets_.push_back(budget);
  ++now_;
}

std::string ErrorRounds::text() const { return fmt::format("{}", fmt::join(budgets_, " ")); }

}  // namespace covary
