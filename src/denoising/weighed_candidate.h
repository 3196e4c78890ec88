// SPDX-License-Identifier: Apache-2.0
// One more candidate: the others, weighed by a small network of the project's own (weighing/weighing.h).
#pragma once

#include <vector>

#include "denoising/candidates.h"
#include "denoising/mixture.h"

namespace covary {

inline constexpr const char* kWeighedName = "weighed";

/// Adds its maker to those of a mean's candidates, if there is a network for these. The features must outlive it.
void add_weighing_maker(const Features& features, std::vector<CandidateMaker>& makers);

/// Adds the candidate that this maker makes of the others.
void add_weighed(const CandidateMaker& maker, const CandidateInput& input, CandidateSet& set);

}  // namespace covary
