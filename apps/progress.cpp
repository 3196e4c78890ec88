// SPDX-License-Identifier: Apache-2.0
#include "progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace covary {

std::string format_duration(double seconds) {
  const auto s = static_cast<int64_t>(std::ceil(std::max(0.0, seconds)));
  if (s < 3600) return fmt::format("{}:{:02}", s / 60, s % 60);
  return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

std::string format_count(double count) {
  if (count >= 1e9) return fmt::format("{:.2f} G", count / 1e9);
  if (count >= 1e6) return fmt::format("{:.2f} M", count / 1e6);
  if (count >= 1e3) return fmt::format("{:.1f} k", count / 1e3);
  return fmt::format("{:.0f}", count);
}

ProgressLine::ProgressLine(std::string label, bool quiet)
    : label_(std::move(label)), quiet_(quiet), terminal_(isatty(2) == 1), next_(terminal_ ? 0.1 : 10) {}

void ProgressLine::update(uint64_t done, uint64_t total, double seconds_limit) {
  if (quiet_) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;
  const double elapsed = watch_.seconds();
  if (elapsed < next_) return;
  next_ = elapsed + (terminal_ ? 0.2 : 10);

  const double rate = static_cast<double>(done) / elapsed;
  double fraction = total ? static_cast<double>(done) / static_cast<double>(total) : 0;
  double left = fraction > 0 ? elapsed * (1 - fraction) / fraction : 0;
  if (seconds_limit > 0 && (seconds_limit - elapsed < left || fraction == 0)) {
    fraction = std::min(1.0, elapsed / seconds_limit);
    left = seconds_limit - elapsed;
  }
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(fraction * kWidth);
  const std::string line =
      fmt::format("{} [{}{}] {:3.0f} %  {} samples/s  {} left", label_, std::string(filled, '='),
                  std::string(kWidth - filled, ' '), 100 * fraction, format_count(rate), format_duration(left));
  std::fprintf(stderr, terminal_ ? "\r%s\033[K" : "%s\n", line.c_str());
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressLine::finish() {
  if (terminal_ && drawn_) std::fputs("\r\033[K", stderr);
  drawn_ = false;
}

}  // namespace covary
