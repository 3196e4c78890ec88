// SPDX-License-Identifier: Apache-2.0
// The image of a training's samples. Each wave's samples depend only on earlier waves, so each wave's mean is unbiased,
// and the variance decreases from wave to wave. Waves are combined with inverse-variance weights
// [Muller2019].
//
// Weights must not depend on the samples they weight: bright samples, which raise a wave's variance, would count too
// little. So the two colours of a checkerboard of pixels are combined separately, each with the other's variances.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "film/film.h"

namespace covary {

/// How the waves of a training become an image.
enum class WaveWeights {
  kVariance,  ///< approximately inverse to the variance of a wave's mean
  kSamples,   ///< the mean of all samples, as in [Hua2023]
};

/// An unbiased image of a training's samples.
struct TrainingImage {
  Image mean;  ///< empty if there is none
  /// The equivalent number of samples of the trained integrator, for pixels with even and with odd x + y; at most the
  /// actual number.
  std::array<double, 2> samples{};
  double samples_at(int x, int y) const { return samples[static_cast<size_t>((x + y) & 1)]; }
};

/// Collects the waves of a training.
class WaveCombination {
 public:
  explicit WaveCombination(WaveWeights weights) : weights_(weights) {}
  /// Call after each wave. `film` has two groups, and the same number of samples in all pixels, including earlier
  /// waves. `importance`: weight of an error in each channel of each pixel; empty: 1. A first wave of one sample, which
  /// has no variance estimate, is combined with the next.
  void add(const Film& film, std::span<const Spectrum> importance);
  TrainingImage result() const;

 private:
  WaveWeights weights_;
  uint32_t end_ = 0;           // samples taken into account so far
  std::vector<float> before_;  // the film's groups at that point
  Image sum_;                  // Σ_j weight_j mean_j, with the weights of the pixel's colour
  std::array<double, 2> weight_sums_{}, last_variance_{1, 1};
};

/// The image of a film with the window of `image.mean`, combined with the training's; the film's samples are weighted
/// as those of the trained integrator.
Image with_training(const Film& film, const TrainingImage& image);

}  // namespace covary
