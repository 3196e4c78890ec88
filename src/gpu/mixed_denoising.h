// SPDX-License-Identifier: Apache-2.0
// The default's denoising, denoising/mixed_denoising.h, on a device: the samples and auxiliary images go there once,
// and the picture with its error comes back. Every step is tested against the processor's function.
//
// A network is MeanMixture::network: its three noisy images come down, and what it makes of them goes up.
#pragma once

#include "denoising/mean_mixture.h"
#include "denoising/mixed_denoising.h"
#include "device/device.h"
#include "gpu/trial.h"

namespace covary::gpu {

using device::Buffer;
using device::Device;

/// Implements MixedDenoisingOptions::mix_mean. Values agree with the processor's to rounding: 99.9 % of them within
/// 1e-4 of value + 0.01. Bit-identical on one device. An image that does not fit the device's memory is made in bands
/// that overlap by the radius of influence, smaller ones if the device has less memory than it tells; they agree with
/// the whole to rounding. Samples that are on the device already, such as those of a renderer, are read in place
/// (GroupedImage::on_device); those that are nowhere else (`data` null) are not made in bands. Throws device::Failure,
/// and like the network.
MixedDenoising mix_mean(Device& device, const MeanMixture& request, const Trial& trial = {});

/// Implements MixedDenoisingOptions::mix_pair, of the whole image at once.
MixedDenoising mix_pair(Device& device, const PairMixture& request, const Trial& trial = {});

}  // namespace covary::gpu
