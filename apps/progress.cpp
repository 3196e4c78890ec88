// SPDX-License-Identifier: Apache-2.0
#include "progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace covary {
namespace {

constexpr double kTerminalSeconds = 0.2;               // between two drawings, and lines for another program
constexpr double kLogSeconds = 10, kLogGrowth = 1.35;  // until the first line of a log, and from one to the next
constexpr double kShownSeconds = 50;                   // at most, between texts that are shown
constexpr double kUnknown = 1e9;                       // seconds, until a time limit says more
constexpr int kDefaultColumns = 80, kBarColumns = 30;

/// The file in which a program that runs this one wants the line, as often as on a terminal; null: none.
const char* file_of_caller() {
  static const char* const name = std::getenv("COVARY_PROGRESS");
  return name;
}

void write_to_caller(const std::string& line) {
  std::FILE* file = std::fopen(file_of_caller(), "ae");
  if (!file) return;  // nobody reads it any more
  std::fprintf(file, "%s\n", line.c_str());
  std::fclose(file);
}

int terminal_columns() {
  winsize size{};
  return ioctl(2, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kDefaultColumns;
}

/// The first `columns` characters of UTF-8.
std::string cut_to(const std::string& text, int columns) {
  size_t end = 0;
  for (int n = 0; end < text.size(); ++end)
    if ((static_cast<unsigned char>(text[end]) & 0xc0) != 0x80 && n++ == columns) break;
  return text.substr(0, end);
}

}  // namespace

std::string samples_per_pixel_text(double samples) {
  return fmt::format("{:g} {} per pixel", samples, samples == 1 ? "sample" : "samples");
}

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
    : label_(std::move(label)),
      quiet_(quiet),
      terminal_(isatty(2) == 1),
      next_(terminal_ || file_of_caller() ? 0 : kLogSeconds) {}

ProgressLine::~ProgressLine() { finish(); }

void ProgressLine::begin(const std::string& phase, uint64_t done) {
  const std::lock_guard lock(mutex_);
  phase_ = phase, shown_ = nullptr;
  first_ = done_ = done, total_ = 0;
  expected_ = nullptr, later_units_ = later_seconds_ = 0;
  of_phase_ = Stopwatch();
  if (quiet_) return;
  if (terminal_) draw();
  start_redrawing();
}

std::string ProgressLine::phase() const {
  const std::lock_guard lock(mutex_);
  return phase_;
}

void ProgressLine::expect(std::function<double()> seconds_left) {
  const std::lock_guard lock(mutex_);
  expected_ = std::move(seconds_left);
  if (terminal_ && expected_) draw();
}

void ProgressLine::later(double units, double seconds) {
  const std::lock_guard lock(mutex_);
  later_units_ = units, later_seconds_ = seconds;
}

void ProgressLine::repeats(int times, double seconds) {
  const std::lock_guard lock(mutex_);
  repeats_ = times, repeat_seconds_ = seconds;
}

void ProgressLine::update(uint64_t done, uint64_t total) {
  if (quiet_) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;  // tiles must not wait for the terminal
  if (done < first_) first_ = 0;
  done_ = done, total_ = total;
  if (of_line_.seconds() >= next_) draw();
}

void ProgressLine::limit(double seconds) {
  const std::lock_guard lock(mutex_);
  seconds_limit_ = seconds;
  of_limit_ = Stopwatch();
}

void ProgressLine::aim(double goal) {
  const std::lock_guard lock(mutex_);
  goal_ = goal;
}

void ProgressLine::toward(const PredictedError& reached) {
  const std::lock_guard lock(mutex_);
  reached_ = fmt::format("{:.2g} ({})", reached.relmse,
                         reached.bounds ? fmt::format("{:.2g} to {:.2g}", reached.bounds->low, reached.bounds->high)
                         : reached.doubt.empty() ? "predicted"
                                                 : "unreliable");
  if (goal_ > 0) min_total_ = static_cast<uint64_t>(static_cast<double>(done_) * std::max(1.0, reached.relmse / goal_));
}

std::string ProgressLine::note() const {
  if (reached_.empty()) return goal_ > 0 ? fmt::format("  goal relMSE {:.2g}", goal_) : "";
  return fmt::format("  relMSE {}{}", reached_, goal_ > 0 ? fmt::format(", goal {:.2g}", goal_) : "");
}

void ProgressLine::show(std::function<std::string()> text) {
  const std::lock_guard lock(mutex_);
  shown_ = std::move(text);
  if (terminal_ || !drawn_ || of_line_.seconds() >= next_) draw();
  if (!quiet_) start_redrawing();
}

double ProgressLine::all_left(double seconds) const {
  double left = seconds + later_seconds_;
  if (seconds_limit_ > 0) left = std::min(left, std::max(0.0, seconds_limit_ - of_limit_.seconds()));
  return left + repeats_ * (repeat_seconds_ > 0 ? repeat_seconds_ : of_line_.seconds() + left);
}

std::string ProgressLine::bar_text(int columns) const {
  const uint64_t total = std::max(total_, min_total_);
  const double rate = static_cast<double>(done_ - first_) / std::max(of_phase_.seconds(), 1e-9);
  const double limit_used = seconds_limit_ > 0 ? of_limit_.seconds() / seconds_limit_ : 0;
  const double done = total ? static_cast<double>(done_) / static_cast<double>(total) : 0;
  const double fraction = std::clamp(std::max(done, limit_used), 0.0, 1.0);
  const double left = total ? static_cast<double>(total - std::min(done_, total)) / rate : kUnknown;
  const std::string percent = fmt::format("{:.0f} %", 100 * fraction);
  const std::string until = fmt::format("{}{} left{}", goal_ > 0 ? "at least " : "",
                                        format_duration(all_left(left + later_units_ / rate)), note());
  const std::string start = fmt::format("{}: {} ", label_, phase_);
  if (!terminal_) return fmt::format("{}{}, {}", start, percent, until);
  const std::string end = fmt::format(" {:>5}  {}", percent, until);
  const int room = columns - static_cast<int>(start.size() + end.size()) - 2, width = std::min(room, kBarColumns);
  if (width < 4) return start + end;
  const auto filled = static_cast<size_t>(fraction * width);
  return fmt::format("{}[{}{}]{}", start, std::string(filled, '='), std::string(width - filled, ' '), end);
}

std::string ProgressLine::text(int columns) const {
  if (shown_) return shown_();
  if (done_ > first_ && (total_ > 0 || seconds_limit_ > 0)) return bar_text(columns);
  const double seconds = of_phase_.seconds();
  std::string text = fmt::format("{}: {}", label_, phase_);
  if (seconds >= 1) text += " " + format_duration(std::floor(seconds));
  const double left = expected_ ? expected_() : 0;
  if (left > 0) text += fmt::format("  {} left", format_duration(all_left(left)));
  return text + note();
}

void ProgressLine::draw() {
  if (quiet_ || finished_) return;
  const double now = of_line_.seconds();
  next_ = terminal_ || file_of_caller() ? now + kTerminalSeconds : std::max(now + kLogSeconds, now * kLogGrowth);
  if (shown_) next_ = std::min(next_, now + kShownSeconds);
  const int columns = terminal_ ? terminal_columns() - 1 : 1000;  // the last column would wrap the line
  const std::string line = cut_to(text(terminal_ ? columns : kDefaultColumns + kBarColumns), columns);
  drawn_ = true;
  if (file_of_caller()) return write_to_caller(line);
  std::fprintf(stderr, terminal_ ? "\r%s\033[K" : "%s\n", line.c_str());
  std::fflush(stderr);
}

void ProgressLine::start_redrawing() {
  if (!redrawing_.joinable()) redrawing_ = std::thread([this] { redraw_regularly(); });
}

void ProgressLine::redraw_regularly() {
  std::unique_lock lock(mutex_);
  while (!end_.wait_for(lock, std::chrono::milliseconds(500), [this] { return finished_; }))
    if ((!phase_.empty() || shown_) && of_line_.seconds() >= next_) draw();
}

void ProgressLine::erase() {
  if (terminal_ && drawn_) std::fputs("\r\033[K", stderr);
  drawn_ = false;
}

void ProgressLine::print(const std::string& line) {
  const std::lock_guard lock(mutex_);
  erase();
  std::fprintf(stderr, "%s\n", line.c_str());
  if (file_of_caller()) write_to_caller(line);
}

void ProgressLine::clear() {
  const std::lock_guard lock(mutex_);
  erase();
}

void ProgressLine::finish() {
  {
    const std::lock_guard lock(mutex_);
    erase();
    finished_ = true;
  }
  end_.notify_all();
  if (redrawing_.joinable()) redrawing_.join();
}

}  // namespace covary
