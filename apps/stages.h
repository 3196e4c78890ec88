// SPDX-License-Identifier: Apache-2.0
// --save-stages: writes images of an estimator's steps.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "estimators/method.h"
#include "film/exr.h"

namespace covary {

void add_stages_option(CLI::App& command, std::string& folder);

/// Throws Error(kUsage) if a folder is named and the estimator has no steps to show.
void check_stages(const std::string& folder, const Method& estimator);

/// Writes each stage as NAME.exr, and as NAME.png for viewing; does nothing if no folder is named. Creates the folder
/// if needed. Images of one channel are coloured from black through red to pale yellow, on a logarithmic scale if they
/// span more than two decades. Throws Error(kIo).
void save_stages(const std::string& folder, const Method& method, const Samples& samples,
                 const MethodSettings& settings, const ImagePlace& place);

}  // namespace covary
