// SPDX-License-Identifier: Apache-2.0
// From images to cells: errors of single runs, their split, times, and what follows from several cells together.
#pragma once

#include <vector>

#include "lab/results.h"

namespace covary::lab {

/// Fills in everything of a cell that follows from its own runs; their records and seeds are given. MAE and FLIP are
/// against the mean of the references. `unbiased`: see suspicions(). Errors of single images are kept in the cache
/// under keys made of `run_keys`, one for each run, and `reference_key`.
void measure(Cell& cell, const SceneInstance& scene, const std::vector<Image>& references, bool unbiased,
             const Budget& budget, const Cache& cache, const std::vector<std::string>& run_keys,
             const std::string& reference_key);

/// Ratios against the baseline, published values, slopes and means over scenes, from the cells.
void compare_cells(Results& results);

}  // namespace covary::lab
