// SPDX-License-Identifier: Apache-2.0
// From images to cells: errors of single runs, their split, times, and quantities derived from several cells.
#pragma once

#include <vector>

#include "lab/results.h"
#include "lab/scene_images.h"

namespace covary::lab {

/// Fills in everything about a cell that depends on its own runs; their records and seeds are given. MAE and FLIP are
/// against the mean of the references. `unbiased`: see suspicions(). Errors of single images are cached under keys made
/// from `run_keys`, one per run, and `reference_key`.
void measure(Cell& cell, const SceneInstance& scene, const SceneReferences& references, bool unbiased,
             const Budget& budget, const Cache& cache, const std::vector<std::string>& run_keys,
             const std::string& reference_key);

/// Ratios to the baseline, published values, slopes, and means over scenes, from the cells.
void compare_cells(Results& results);

}  // namespace covary::lab
