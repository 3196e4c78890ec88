// SPDX-License-Identifier: Apache-2.0
// How a render spends a time limit. Trials on a few pixels, before anything is rendered, tell what its parts cost. Then
// passes take samples in rounds, each a fraction of those that the rest of the time suffices for at the speed measured
// so far, so that every pixel ends with the same number, and the same image can be made without a clock.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace covary {

/// Seconds that the parts of a render take.
struct TimeCosts {
  double sample = 0;     ///< one sample of each pixel
  double auxiliary = 0;  ///< one sample of each pixel of the auxiliary images; 0: there are none
  double end = 0;        ///< what follows the passes: estimate and files
};

/// How a render of known costs is expected to spend its time.
struct TimePlan {
  uint32_t aov_samples = 0;  ///< at most, per pixel of the auxiliary images
  uint32_t samples = 0;      ///< per pixel, of all passes together
  double seconds = 0;        ///< for all of it; more than there are if even the least takes longer
};

/// Splits `seconds` for at least `fewest` samples per pixel. Auxiliary images get at most `aov_samples`, as many as fit
/// into kAuxiliaryShare of the time, and at least 1.
TimePlan plan_time(const TimeCosts& costs, double seconds, uint32_t fewest, uint32_t aov_samples);
inline constexpr double kAuxiliaryShare = 0.15;

/// Seconds that the end takes for an image of `height` rows, from trials of few of them: trial(rows) returns its
/// seconds, of which the first is longer because it loads what the others use. A second one is made unless the first
/// took more than twice the `allowed` seconds; after it, none that would make all of them take longer than these.
double time_of_end(int height, double allowed, const std::function<double(int rows)>& trial);
inline constexpr double kTrialShare = 0.15;  ///< of the time, for these trials

/// Samples per pixel to have after the next round; `taken` if the time left suffices for no more. `left`: seconds for
/// passes; `seconds_per_sample` > 0: of each sample per pixel.
uint32_t next_round(uint32_t taken, double seconds_per_sample, double left);

/// Samples per pixel after the first round, whose speed is known from trials alone: fewer, but at least `fewest`.
uint32_t first_round(const TimePlan& plan, uint32_t fewest);

/// What a render decided by the clock: options with which it makes the same image again.
struct TimeChoice {
  uint32_t samples = 0;
  std::optional<int> groups;            ///< if they follow from the time
  std::optional<uint32_t> aov_samples;  ///< if there are auxiliary images
  std::string text() const;             ///< "--spp 33 --groups 11 --aov-samples 16"
};

}  // namespace covary
