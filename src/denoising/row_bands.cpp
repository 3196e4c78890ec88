// SPDX-License-Identifier: Apache-2.0
#include "denoising/row_bands.h"

#include <algorithm>

#include "denoising/mixed_rows.h"
#include "filters/regression.h"
#include "filters/residual_correction.h"
#include "weighing/weighing.h"

namespace covary {

static_assert(kBandCell % kResidualCell == 0 && kBandCell % kRegressionCell == 0 && kBandCell % kWeighingRows == 0);

std::vector<RowBand> bands_of(int height, int rows_at_once, const RowHalo& halo, int first, int end) {
  const int step = std::max(kBandCell, (rows_at_once - halo.above - halo.below) / kBandCell * kBandCell - kBandCell);
  std::vector<RowBand> bands;
  for (int y = first; y < end; y += step) {
    const int n = std::min(step, end - y), begin = std::max(0, y - halo.above) / kBandCell * kBandCell;
    bands.push_back({begin, std::min(height, y + n + halo.below) - begin, y - begin, y, n});
  }
  return bands;
}

int weighing_halo(CandidateBase base, bool with_network) {
  return base == CandidateBase::kMean && !with_network ? kWeighingHalo : 0;
}

int candidates_halo(CandidateBase base, bool with_network, int halo_of_parts) {
  return halo_of_parts + kCandidateHalo + weighing_halo(base, with_network);
}

int mixed_halo(CandidateBase base, bool with_network, int halo_of_parts, const PartsWeighting& weighting) {
  return candidates_halo(base, with_network, halo_of_parts) + mixture_halo(base == CandidateBase::kMean, weighting) +
         kErrorHalo;
}

FeatureRows::FeatureRows(const Features& whole, int first, int n) {
  for (size_t i = 0; i < feature::kCount; ++i)
    if (const Image* image = whole.*kImagesOfFeatures[i])
      images[i] = rows_of(*image, first, n), features.*kImagesOfFeatures[i] = &images[i];
  features.clean = whole.clean;
  if (!whole.differences) return;
  differences.factors = whole.differences->factors;
  for (size_t i = 0; i < feature::kCount; ++i) {
    const std::vector<uint16_t>& values = whole.differences->values[i];
    if (values.empty()) continue;
    const auto row = static_cast<ptrdiff_t>(images[i].data.size()) / n;
    differences.values[i].assign(values.begin() + first * row, values.begin() + (first + n) * row);
  }
  features.differences = &differences;
}

}  // namespace covary
