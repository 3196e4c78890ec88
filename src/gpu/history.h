// SPDX-License-Identifier: Apache-2.0
// denoising/history.h on a device: previous frames, which are reprojected already, are mixed into a frame.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "denoising/history.h"
#include "gpu/mixture.h"

namespace covary::gpu {

/// The frame; as in HistoryInput.
struct FrameBuffers {
  int width = 0, height = 0;
  std::array<const Buffer<float>*, 2> independent = {};  ///< means h_A, h_B
  std::array<const Buffer<float>*, 2> counts = {};       ///< null for a pair
  const Buffer<float>* guide = nullptr;                  ///< begins with it
  const Buffer<unsigned char>* valid = nullptr;
  std::string planted_bug = {};  ///< for tests: a kernel that shall be slightly wrong
};

/// A history and the standard error of a frame's mixture, uploaded.
class FrameHistory {
 public:
  FrameHistory(Device& device, const History& history, const Image& std_error, const FrameBuffers& frame);

  /// R'_A and R'_B, from the frame's own samples: the mean Y and its halves.
  std::array<Buffer<float>, 2> add_samples(const Buffer<float>& mean,
                                           const std::array<const Buffer<float>*, 2>& halves) const;
  /// Mixes the history into the frame's mixture of so many candidates, whose weights it scales. `accumulated`: D and
  /// its halves, or null.
  void add_history(const MixedBuffers* accumulated, int candidates, MixedBuffers& frame) const;

 private:
  device::Kernel kernel(const char* name) const;
  Buffer<float> factors(const Buffer<float>& past_a, const Buffer<float>& past_b) const;
  Buffer<float> multiplied(const Buffer<float>& factors, const Buffer<float>& image) const;
  Buffer<float> candidates(const Buffer<float>& image, const Buffer<float>& history, const Buffer<float>& limits,
                           const Buffer<float>* accumulated, float scale) const;
  MixedBuffers mixture_of(int candidates, const CandidateBuffers& whole, const std::array<CandidateBuffers, 2>& halves,
                          const std::array<const Buffer<float>*, 2>& counts) const;

  Device& device_;
  const FrameBuffers frame_;
  const size_t pixels_;
  Buffer<float> image_, squared_error_, std_error_, common_counts_;
  Buffer<unsigned char> known_;
  std::array<Buffer<float>, 2> samples_;  ///< none if they are not kept
};

/// Bytes of a device's memory for each pixel of a frame with a history, beside those of the frame and, with a network,
/// of the accumulated samples.
inline constexpr double kBytesOfHistory = 240;

}  // namespace covary::gpu
