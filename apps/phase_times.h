// SPDX-License-Identifier: Apache-2.0
// Where the time of a render went, by the names that its progress shows.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "plans/render.h"

namespace covary {

/// Seconds of each phase, of one render or the sum of several.
struct PhaseTimes {
  double loading = 0;    ///< files, scene and acceleration structure
  double trials = 0;     ///< choosing an integrator; with a time limit, measuring what the parts of the render take
  double training = 0;   ///< of the integrator
  double auxiliary = 0;  ///< albedo, normal and position for a denoiser
  double samples = 0;
  double estimate = 0;  ///< denoising, combining passes, measuring the error
  double writing = 0;

  double total() const { return loading + trials + training + auxiliary + samples + estimate + writing; }
  PhaseTimes& operator+=(const PhaseTimes& other);
};

/// `load_seconds`: for reading the scene, without building the acceleration structure.
PhaseTimes phase_times(const RenderResult& result, double load_seconds, double build_seconds);

/// "0.42 s", "12.3 s", "1:15".
std::string seconds_text(double seconds);

/// "41 s: auxiliary images 12.1 s, samples 18.3 s, denoising 9.9 s": the phases that take 2 % or more, and 0.1 s.
/// `estimate`: the name of that phase.
std::string text_of(const PhaseTimes& times, const std::string& estimate);

/// The object `seconds` of --json; with "render" = auxiliary + samples.
nlohmann::ordered_json json_of(const PhaseTimes& times, const RenderResult& result, double load_seconds);

}  // namespace covary
