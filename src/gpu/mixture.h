// SPDX-License-Identifier: Apache-2.0
// denoising/mixture.h on a device: weights of candidates by cross-validation, and their mixture.
#pragma once

#include <array>
#include <vector>

#include "denoising/mixture.h"
#include "device/device.h"

namespace covary::gpu {

using device::Buffer;
using device::Device;

/// F and its candidates C_p, one image after another.
struct CandidateBuffers {
  const Buffer<float>* base = nullptr;
  const Buffer<float>* candidates = nullptr;
};

struct MixtureBuffers {
  int width = 0, height = 0;
  int candidates = 0;  ///< their number M
  CandidateBuffers whole;
  std::array<CandidateBuffers, 2> halves;
  std::array<const Buffer<float>*, 2> independent = {};  ///< h_A, h_B
  std::array<const Buffer<float>*, 2> counts = {};       ///< weights of squared errors (error_weights())
  const Buffer<float>* guide = nullptr;                  ///< null: the first candidate of all samples
  const Buffer<unsigned char>* valid = nullptr;
  float bias_share = 1;
  bool of_pair = false;  ///< counts are 1 / (F'^2 + 0.01) of each half's base
  float prior = 0;
  bool planted_bug = false;
};

/// MixtureInput::counts of a half: weights of squared errors by an image with little noise, and the standard error.
Buffer<float> error_weights(Device& device, const Buffer<float>& guide, const Buffer<float>& std_error);

/// What mix() makes: images of three channels, and M weights of one channel.
struct MixedBuffers {
  Buffer<float> image, weights;
  std::array<Buffer<float>, 2> halves;
};
/// `everywhere`: the weights of the whole image, which normal_rows() determine.
MixedBuffers mix(Device& device, const MixtureBuffers& in, const std::vector<float>& everywhere);

/// F + sum_p x_p (C_p - F) of a set, with weights as mix() makes them; from `in`: size, number of candidates, pixels.
Buffer<float> mixture_of(Device& device, const MixtureBuffers& in, const CandidateBuffers& set,
                         const Buffer<float>& weights);

/// The normal equations of rows first … end - 1, of the halves alone.
std::vector<NormalRow> normal_rows(Device& device, const MixtureBuffers& in, int first, int end);

/// How much the candidates differ from the mixture (denoising/mixture.h).
Buffer<float> disagreement(Device& device, const MixtureBuffers& in, const Buffer<float>& mixture);

/// Limits the brightness of all candidates of a part but the first, a network's image.
void limit_by_network(Device& device, int width, int height, int n_candidates, const Buffer<float>& estimate,
                      const Buffer<float>& std_error, const Buffer<float>& candidates);

}  // namespace covary::gpu
