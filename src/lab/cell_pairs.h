// SPDX-License-Identifier: Apache-2.0
// Values of the runs of two cells, paired by seed: what ratios to the baseline are of.
#pragma once

#include <functional>

#include "lab/results.h"
#include "lab/statistics.h"

namespace covary::lab {

double relmse(const RunResult& run);
/// Seconds of rendering and estimating.
double seconds(const RunResult& run);

Pairs in_pairs(const Cell& a, const Cell& b, const std::function<double(const RunResult&)>& value);

/// Errors of the baseline and of a cell of the same budget, with the noise of their references: at equal samples, by
/// error times samples if their numbers differ; at equal time, by error times time, or, with a budget in seconds, the
/// errors themselves; at equal processor time.
Pairs at_equal_samples(const Cell& base, const Cell& cell);
Pairs at_equal_time(const Cell& base, const Cell& cell, const Budget& budget);
Pairs at_equal_processor_time(const Cell& base, const Cell& cell);

}  // namespace covary::lab
