// SPDX-License-Identifier: Apache-2.0
// filters/residual_correction.h on a device: of an estimate whose standard error is known.
#pragma once

#include "filters/residual_correction.h"
#include "gpu/denoising_parts.h"
#include "gpu/trial.h"

namespace covary::gpu {

/// An independent image as kernels/residual_correction.cl reads it, four values a pixel: the last of `guide` is the
/// relative number of samples; `other` is the mean and the variance, summed over the channels.
struct ResidualInput {
  Buffer<float> guide, other;
};
/// `relative_counts`: no elements if all pixels have the same number of samples.
ResidualInput residual_input(Device& device, const Buffer<float>& mean, const Buffer<float>& variance_of_mean,
                             const Buffer<float>& relative_counts);

struct ResidualBuffers {
  int width = 0, height = 0;
  const Buffer<float>*guide = nullptr, *other = nullptr;  ///< as ResidualInput
  const Buffer<unsigned char>* valid = nullptr;
  const Buffer<float>* std_error = nullptr;  ///< of the estimate
};
/// Adds the correction to `estimate`.
void correct_residual(Device& device, Stages& stages, const ResidualBuffers& in,
                      const ResidualCorrectionOptions& options, const Buffer<float>& estimate);

}  // namespace covary::gpu
