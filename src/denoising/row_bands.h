// SPDX-License-Identifier: Apache-2.0
// Bands of rows of an image that is denoised in parts: they overlap by the radius of influence.
#pragma once

#include <array>
#include <vector>

#include "denoising/candidates.h"
#include "denoising/parts_mixture.h"
#include "estimators/method.h"

namespace covary {

/// Bands begin with cells of all kinds, at multiples of so many rows.
inline constexpr int kBandCell = 24;

/// `rows` rows of an image from `first` on, of which `n` are wanted: rows `skipped` … of the band, y … of the image.
struct RowBand {
  int first = 0, rows = 0, skipped = 0, y = 0, n = 0;
};
/// Rows that a band needs beside those that are wanted.
struct RowHalo {
  int above = 0, below = 0;
  RowHalo(int both) : above(both), below(both) {}
  RowHalo(int rows_above, int rows_below) : above(rows_above), below(rows_below) {}
};
/// Bands of an image of `height` rows that hold its rows first … end - 1, and those that they reach: of at most
/// `rows_at_once` rows if these are more than the halo.
std::vector<RowBand> bands_of(int height, int rows_at_once, const RowHalo& halo, int first, int end);

/// Radius of influence of the candidates that are made of the images on all candidates.
int weighing_halo(CandidateBase base, bool with_network);
/// Radius of influence of the images on a pixel of any candidate, and of the mixture with its error. `halo_of_parts`:
/// on what the candidates are made of.
int candidates_halo(CandidateBase base, bool with_network, int halo_of_parts);
int mixed_halo(CandidateBase base, bool with_network, int halo_of_parts, const PartsWeighting& weighting);

/// Rows of auxiliary images.
struct FeatureRows {
  std::array<Image, feature::kCount> images;
  FeatureDifferences differences;
  Features features;

  FeatureRows(const Features& whole, int first, int n);
  FeatureRows(const FeatureRows&) = delete;
  FeatureRows& operator=(const FeatureRows&) = delete;
};

}  // namespace covary
