// SPDX-License-Identifier: Apache-2.0
// Blocks of the report: tables and plots of results. Each is JSON as in docs/report.md; null if there is nothing to
// show.
#pragma once

#include <nlohmann/json.hpp>

#include "lab/results.h"

namespace covary::lab {

/// Geometric means over scenes at one budget.
nlohmann::ordered_json summary_table(const Results& results, size_t budget);
/// relMSE of all scenes (rows) and methods (columns) at one budget.
nlohmann::ordered_json error_table(const Results& results, size_t budget);
/// relMSE beside published values, for the scenes and methods that have them.
nlohmann::ordered_json published_table(const Results& results, size_t budget);
/// Equal-sample and equal-time ratios of all scenes and methods at one budget.
nlohmann::ordered_json ratio_table(const Results& results, size_t budget);
/// Bias, variance, other metrics, predicted error.
nlohmann::ordered_json quality_table(const Results& results, size_t budget);
nlohmann::ordered_json time_table(const Results& results, size_t budget);
nlohmann::ordered_json slope_table(const Results& results);

/// relMSE against samples per pixel, and against the seconds of the method.
nlohmann::ordered_json convergence_plot(const Results& results, size_t scene);
nlohmann::ordered_json time_plot(const Results& results, size_t scene);
/// Errors of changes between frames, and of the worst region relative to the baseline, for scenes with frames at one
/// budget.
nlohmann::ordered_json frames_table(const Results& results, size_t budget);
/// relMSE of each frame of a scene at one budget; with `of_changes`, temporal error.
nlohmann::ordered_json frames_plot(const Results& results, size_t scene, size_t budget, bool of_changes);
/// The trade of error against bias at one budget: error over that of the baseline (geometric mean over scenes) against
/// squared bias as a fraction of the method's own error (mean over scenes). Needs two seeds.
nlohmann::ordered_json front_plot(const Results& results, size_t budget);

}  // namespace covary::lab
