// SPDX-License-Identifier: Apache-2.0
// What the samples of a training tell of the image. Each wave's samples read only what earlier waves taught, so that
// the mean of each wave is unbiased, and their variance falls from wave to wave. Waves are combined with weights that
// are inverse to their variance.
//
// Weights must not depend on the samples that they weigh: bright samples, which raise a wave's variance, would count
// too little. So the pixels of the two colours of a chessboard are combined apart, by the variances of one another.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "film/film.h"

namespace covary {

/// How the waves of a training become an image.
enum class WaveWeights {
  kVariance,  ///< inverse to the variance of a wave's mean, about
  kSamples,   ///< the mean of all samples, as [Hua2023] do
};

/// An unbiased image of a training's samples.
struct TrainingImage {
  Image mean;  ///< empty: there is none
  /// As how many samples of the trained integrator it counts, of pixels with even and with odd x + y; at most as many
  /// as it has.
  std::array<double, 2> samples{};
  double samples_at(int x, int y) const { return samples[static_cast<size_t>((x + y) & 1)]; }
};

/// Collects the waves of a training.
class WaveCombination {
 public:
  explicit WaveCombination(WaveWeights weights) : weights_(weights) {}
  /// After each wave. `film` has two groups, and in all pixels the same number of samples, those of earlier waves
  /// included. `importance`: how much an error counts in each channel of each pixel; empty: 1. A first wave of one
  /// sample, which does not show its variance, counts together with the next.
  void add(const Film& film, std::span<const Spectrum> importance);
  TrainingImage result() const;

 private:
  WaveWeights weights_;
  uint32_t end_ = 0;           // samples that were taken into account so far
  std::vector<float> before_;  // the film's groups then
  Image sum_;                  // Σ_j weight_j mean_j, with the weights of the pixel's colour
  std::array<double, 2> weight_sums_{}, last_variance_{1, 1};
};

/// The image of a film of `image.mean`'s window together with the training's, the film's samples counting as those of
/// the trained integrator.
Image with_training(const Film& film, const TrainingImage& image);

}  // namespace covary
