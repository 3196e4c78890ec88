// SPDX-License-Identifier: Apache-2.0
// What held-out samples tell of an image's error, on a device: risk/held_out_error.h, risk/held_out_bias.h and
// risk/image_risk.h. Pixels are worked on there; sums over parts of rows come back and are added in double precision.
#pragma once

#include <array>
#include <vector>

#include "device/device.h"
#include "gpu/denoising_parts.h"
#include "gpu/nl_means.h"
#include "risk/held_out_error.h"

namespace covary::gpu {

/// The images made of both halves, and the independent images of these.
struct HeldOutBuffers {
  int width = 0, height = 0;
  std::array<Place, 2> halves;                         ///< M_A, M_B; both begin at the same element
  std::array<const MeanBuffers*, 2> independent = {};  ///< h_A, h_B
  const Buffer<float>* guide = nullptr;                ///< G
  const Buffer<unsigned char>* valid = nullptr;
  bool planted_bug = false;
};

/// risk/held_out_error.h. M_A and M_B are whole buffers.
HeldOutParts held_out_parts(Device& device, const HeldOutBuffers& in);
std::vector<HeldOutRow> held_out_rows(Device& device, const HeldOutBuffers& in);

/// risk/held_out_bias.h; `guides`: images of the halves with little noise.
Image held_out_bias(Device& device, const HeldOutBuffers& in, const std::array<const Buffer<float>*, 2>& guides);

/// Auxiliary images of first surfaces and of those seen behind glass; null if unknown.
struct SurfaceBuffers {
  const Buffer<float>*normal = nullptr, *normal_behind = nullptr, *albedo = nullptr, *albedo_behind = nullptr;
};
/// risk/image_risk.h. `image`: M; `all`: the moments of all samples.
std::vector<RiskRow> image_risk(Device& device, const HeldOutBuffers& in, const Buffer<float>& image,
                                const MeanBuffers& all, const Groups& groups, const SurfaceBuffers& surfaces);

/// The squared error of the mean and the number of valid pixels in each row, relative to the guide.
std::vector<std::array<double, 2>> base_rows(Device& device, const HeldOutBuffers& in, const Buffer<float>& std_error);

}  // namespace covary::gpu
