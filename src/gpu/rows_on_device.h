// SPDX-License-Identifier: Apache-2.0
// Rows of an image and their mixture with denoised images on a device, step by step as denoising/parts_mixture.h and
// denoising/mixed_rows.h.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "denoising/mean_mixture.h"
#include "denoising/mixed_rows.h"
#include "gpu/denoising_parts.h"
#include "gpu/filtered_candidates.h"
#include "gpu/history.h"
#include "gpu/layers.h"
#include "gpu/mixture.h"
#include "gpu/trial.h"
#include "gpu/weighing.h"

namespace covary::gpu {

/// Bytes of a device's memory for each pixel of the rows of a mean, and of the largest buffer.
double bytes_of_mean(int groups);
double largest_buffer_of_mean(int groups);
/// Bytes for each pixel if both halves have features of their own.
inline constexpr double kBytesOfHalfFeatures = 200;

class RowsOnDevice {
 public:
  /// `request`: with the samples and features of these rows, which must outlive the object.
  RowsOnDevice(Device& device, const MeanMixture& request, const Trial& trial);
  RowsOnDevice(Device& device, const PairMixture& request, const Trial& trial);

  /// What a network denoises: of all samples and of both halves.
  std::array<Image, 3> noisy();
  /// Makes the candidates at first use. `network`: a network's images of these rows; null: without one.
  void make_candidates(const NetworkImages* network);
  const std::vector<CandidateMaker>& makers() const { return makers_; }
  /// Of rows first … end - 1.
  std::vector<NormalRow> normal_rows(int first, int end);
  /// The mixture, and what its error needs of these rows. `everywhere`: weights of the whole image.
  MixedRows mix(const std::vector<float>& everywhere);
  /// For rows that are the whole image, once it is mixed: the frame of a history. `std_error`: of the mixture.
  FrameHistory history_of(const History& before, const Image& std_error);
  /// The frame's halves with samples of the history, or its own if there is none.
  std::array<Image, 2> halves_with_samples(const FrameHistory* history);
  /// Mixes the history into the picture, which comes back (FrameHistory::add_history()).
  Image add_history(const FrameHistory& history, const MixedBuffers* accumulated);
  const MixedBuffers& mixed() const { return mixed_; }

  /// A layer of these rows without fireflies: what a network denoises.
  Image noisy_layer(const Layer& layer);
  /// A layer of these rows with the weights of the mixture, once it is made. `clean`: what a network made of the noisy
  /// layer; null: without one.
  Image denoised_layer(const Layer& layer, const Image* clean);
  /// Pixels that are left out, of rows first … first + n - 1.
  long unusable(int first, int n);

  /// Once there are any; of all samples.
  std::vector<Image> candidates() { return downloaded_images(candidates_[0], 3); }
  std::vector<Image> weights() { return downloaded_images(mixed_.weights, 1); }

 private:
  bool is_mean() const { return base_ == CandidateBase::kMean; }
  size_t pixels() const { return static_cast<size_t>(groups_.pixels()); }
  int n_made() const;
  void upload_features();
  const FeatureBuffers& features_of(size_t part) const { return features_[part] ? *features_[part] : *features_[0]; }
  void add_network(const Image& clean, size_t part);
  Buffer<float> counts_of(int half);
  MixtureBuffers mixture_input();
  LayerBuffers upload_layer(const Layer& layer);
  WeighingBuffers weighing_input(size_t part) const;
  void correct_residual();
  void find_errors(MixedRows& rows);
  Image downloaded(const Buffer<float>& buffer, int channels, size_t first = 0);
  std::vector<Image> downloaded_images(const Buffer<float>& buffer, int channels);

  Device& device_;
  const CandidateBase base_;
  const GroupedImage independent_;
  const Features auxiliary_;
  const FilterKinds kinds_;
  const PartsWeighting weighting_;
  const bool std_error_;
  Stages stages_;
  Groups groups_;
  std::array<std::optional<FeatureBuffers>, 3> features_;  ///< those of the halves only if they have their own
  std::array<PartBuffers, 3> parts_;
  std::vector<CandidateMaker> makers_;
  int n_candidates_ = 0;
  std::array<Buffer<float>, 3> candidates_;
  std::array<Buffer<float>, 2> counts_;
  MixedBuffers mixed_;
  // For layers:
  std::optional<Limits> limits_;
  std::unique_ptr<Weighing> weighing_network_;
  WeighingCells shares_;  ///< of all samples, in the candidate that consists of the others
};

}  // namespace covary::gpu
