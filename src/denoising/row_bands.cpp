// SPDX-License-Identifier: Apache-2.0
#include "denoising/row_bands.h"

#include <algorithm>

#include "denoising/mixed_rows.h"
#include "filters/regression.h"
#include "filters/residual_correction.h"
#include "weighing/weighing.h"

namespace covary {

static_assert(kBandCell % kResidualCell == 0 && kBandCell % kRegressionCell == 0 && kBandCell % kWeighingRows == 0);

std::vector<RowBand> bands_of(int height, int rows_at_once, const RowReach& reach, int first, int end) {
  const int step = std::max(kBandCell, (rows_at_once - reach.above - reach.below) / kBandCell * kBandCell - kBandCell);
  std::vector<RowBand> bands;
  for (int y = first; y < end; y += step) {
    const int n = std::min(step, end - y), begin = std::max(0, y - reach.above) / kBandCell * kBandCell;
    bands.push_back({begin, std::min(height, y + n + reach.below) - begin, y - begin, y, n});
  }
  return bands;
}

int weighing_reach(CandidateBase base, bool with_network) {
  return base == CandidateBase::kMean && !with_network ? kWeighingReach : 0;
}

int candidates_reach(CandidateBase base, bool with_network, int reach_of_parts) {
  return reach_of_parts + kCandidateReach + weighing_reach(base, with_network);
}

int mixed_reach(CandidateBase base, bool with_network, int reach_of_parts, const PartsWeighting& weighting) {
  return candidates_reach(base, with_network, reach_of_parts) + mixture_reach(base == CandidateBase::kMean, weighting) +
         kErrorReach;
}

FeatureRows::FeatureRows(const Features& whole, int first, int n) {
  for (size_t i = 0; i < feature::kCount; ++i)
    if (const Image* image = whole.*kImagesOfFeatures[i])
      images[i] = rows_of(*image, first, n), features.*kImagesOfFeatures[i] = &images[i];
  features.clean = whole.clean;
}

}  // namespace covary
