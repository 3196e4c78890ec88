// SPDX-License-Identifier: Apache-2.0
// --save-stages: images of the single steps of an estimator, as files.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "estimators/estimator.h"
#include "film/exr.h"

namespace covary {

void add_stages_option(CLI::App& command, std::string& folder);

/// Throws Error(kUsage) where a folder is named and the estimator has no single steps.
void check_stages(const std::string& folder, const Estimator& estimator);

/// Writes each stage as NAME.exr and, to look at, NAME.png; does nothing where no folder is named. The folder is made
/// if need be. Images of one channel are coloured from black over red to pale yellow, with decades where they span
/// more than two. Throws Error(kIo).
void save_stages(const std::string& folder, const Estimator& estimator, const GroupedImage& crn,
                 const GroupedImage& independent, const PairSettings& settings, const ImagePlace& place);

}  // namespace covary
