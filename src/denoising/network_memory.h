// SPDX-License-Identifier: Apache-2.0
// The memory that Open Image Denoise takes (version 2.5.1, measured).
#pragma once

namespace covary {

/// Bytes of its library and weights.
double network_library_memory();
/// Bytes of its own values while it denoises an image of so many pixels, in tiles of limited size.
double network_tile_memory(double n_pixels);

}  // namespace covary
