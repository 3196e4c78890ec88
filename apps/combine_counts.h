// SPDX-License-Identifier: Apache-2.0
// Samples per pixel of the images of `covary combine`, where their files do not tell them.
#pragma once

#include <optional>
#include <string>

#include "combine/grouped_file.h"

namespace covary {

/// `path`: of the independent image's counts; empty: nothing is done. All pixels of the CRN image (may be null) have
/// `crn_samples`, or what its files tell on average. Throws Error(kUsage) where neither is known, and as
/// GroupedFile::take_counts().
void take_counts(const std::string& path, std::optional<int> crn_samples, GroupedFile* crn, GroupedFile& independent);

}  // namespace covary
