// SPDX-License-Identifier: Apache-2.0
// A small network that weighs images which others made: for each cell of 2 x 2 pixels, shares of the mean and of its
// candidates, with a sum of 1. That networks combine images of different noise and bias is in [Back2020], that they
// weigh denoisers in [Zheng2021]. A U-Net [Ronneberger2015] over three sizes of cells, trained on the project's own
// scenes by benchmarks/weighing/learn.py.
//
// Claim: none about the result, whose error held-out samples measure, as that of any candidate.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "film/film.h"
#include "filters/planes.h"
#include "weighing/convolution.h"
#include "weighing/weighing_features.h"

namespace covary {

/// The layers of the network, in order: over cells (A, E), and over 2 x 2 and 4 x 4 of them (B and D, C).
enum class WeighingLayer { kMix, kA, kB, kB2, kC, kC2, kD, kE, kOut };

class WeighingNetwork {
 public:
  /// `bytes`: the layers' weights in order, 16-bit floats. `candidates`: their number.
  WeighingNetwork(std::string_view bytes, int candidates);
  /// The network for candidates with these names, in this order; null if there is none.
  static const WeighingNetwork* find(std::span<const std::string> names);

  /// The shares of the mean and the candidates, one plane each, by cells. Bit-identical for any number of threads.
  Planes shares(const WeighingInput& input) const;

  int candidates() const { return layers_.back().outputs - 1; }
  const std::vector<Convolution>& layers() const { return layers_; }

 private:
  std::vector<Convolution> layers_;
};

/// Rows start at a multiple of kWeighingRows pixels; kWeighingHalo rows from those that are missing, the bits are
/// those of the whole image.
inline constexpr int kWeighingRows = 8, kWeighingHalo = 56;

/// Bilinear interpolation between the shares of cells.
class PixelShares {
 public:
  explicit PixelShares(const Planes& cells) : cells_(cells) {}
  float at(int image, int x, int y) const;

 private:
  const Planes& cells_;
};

/// The images' mixture with these shares of cells.
Image weighed(const WeighingInput& input, const Planes& shares);

/// Multiplies `weight`, of the mixture in another one, by an image's shares: 1 channel.
Image share_of(const Planes& shares, int image, const Image& weight);

}  // namespace covary
