// SPDX-License-Identifier: Apache-2.0
// Options that several estimators have: the same range and the same words.
#pragma once

#include <cstdint>
#include <utility>

#include "settings/settings.h"

namespace covary {

/// Largest k: the pixels of the window; validate() knows.
inline constexpr OptionRange kVariatesRange{.low = 1};
inline constexpr const char* kVariatesHelp = "Number of control variates";
inline constexpr OptionRange kWindowRange{.low = 3, .high = 63, .odd = true};
inline constexpr const char* kWindowHelp = "Side of the window of neighbours";
inline constexpr const char* kExcludeTargetHelp = "Leave the target out of its own control variates";
/// Whether coefficients are shared.
inline constexpr std::pair<const char*, bool> kCoefficients[] = {{"shared", true}, {"per-channel", false}};
inline constexpr const char* kCoefficientsHelp = "One coefficient for all channels, or one per channel";

/// Estimator::reliable_samples of Eq. (8) of [YM2025]. Measured on crops of three scenes, 8 to 192 samples per pixel, 6
/// seeds (docs/notes/iicv.md): with fewer, IICV as published predicts 0.3 to 0.6 of its true squared error.
inline constexpr uint32_t kReliableSamples = 48;

}  // namespace covary
