// SPDX-License-Identifier: Apache-2.0
#include "phase_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "progress.h"

namespace covary {
namespace {

constexpr double kNamedShare = 0.02, kNamedSeconds = 0.1;  // at least, of phases that are named

}  // namespace

std::string seconds_text(double seconds) {
  if (seconds >= 60) return format_duration(seconds);
  return seconds < 1 ? fmt::format("{:.2f} s", seconds) : fmt::format("{:.1f} s", seconds);
}

PhaseTimes& PhaseTimes::operator+=(const PhaseTimes& other) {
  loading += other.loading, trials += other.trials, training += other.training, auxiliary += other.auxiliary;
  samples += other.samples, estimate += other.estimate, writing += other.writing;
  return *this;
}

PhaseTimes phase_times(const RenderResult& result, double load_seconds, double build_seconds) {
  const RenderSeconds& s = result.seconds;
  return {load_seconds + build_seconds, s.trial, s.train, s.auxiliary, result.render_seconds() - s.auxiliary,
          result.estimate_seconds(),    s.write};
}

std::string text_of(const PhaseTimes& times, const std::string& estimate) {
  const std::pair<const char*, double> phases[] = {{"loading", times.loading},   {"trials", times.trials},
                                                   {"training", times.training}, {"auxiliary images", times.auxiliary},
                                                   {"samples", times.samples},   {estimate.c_str(), times.estimate},
                                                   {"writing", times.writing}};
  const double least = std::max(kNamedSeconds, kNamedShare * times.total());
  std::string text = seconds_text(times.total());
  const char* before = ": ";
  for (const auto& [name, seconds] : phases) {
    if (seconds < least) continue;
    text += fmt::format("{}{} {}", before, name, seconds_text(seconds));
    before = ", ";
  }
  return text;
}

nlohmann::ordered_json json_of(const PhaseTimes& times, const RenderResult& result, double load_seconds) {
  return {{"load", load_seconds},
          {"build", times.loading - load_seconds},
          {"train", times.training},
          {"surrogate", result.seconds.surrogate},
          {"solve", result.seconds.solve},
          {"trial", times.trials},
          {"render", times.auxiliary + times.samples},
          {"auxiliary", times.auxiliary},
          {"samples", times.samples},
          {"estimate", times.estimate},
          {"write", times.writing},
          {"total", times.total()},
          {"processor", result.seconds.processor}};
}

}  // namespace covary
