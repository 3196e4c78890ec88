// SPDX-License-Identifier: Apache-2.0
// Rows of what a mixture is made of, so that bands which overlap need not make the rows that they share again.
#pragma once

#include <vector>

#include "denoising/denoising_parts.h"
#include "denoising/parts_mixture.h"

namespace covary {

/// Leaves `n` rows, from `first` on, without what serves only to mix them, and without samples and features, which
/// others own.
void leave_rows(int first, int n, DenoisingParts& parts);
void leave_rows(int first, int n, std::vector<CandidateSet>& sets);
void leave_rows(int first, int n, MixedParts& mixed);

/// Copies of rows: of all that leave_rows() leaves, and of the candidates.
DenoisingParts rows_of(const DenoisingParts& parts, int first, int n);
std::vector<std::vector<Image>> rows_of(const std::vector<CandidateSet>& sets, int first, int n);

/// Adds the rows below to parts, which may be empty.
void append_rows(DenoisingParts below, DenoisingParts& parts);
/// Replaces the uppermost rows of the candidates.
void set_rows(const std::vector<std::vector<Image>>& rows, std::vector<CandidateSet>& sets);

}  // namespace covary
