// SPDX-License-Identifier: Apache-2.0
// Open Image Denoise [OIDN], a neural denoiser, as a comparator and an optional last step. The library is loaded at run
// time, where there is one; nothing else needs it.
//
// Claim: biased, and not consistent unless the network happens to be; the size of its bias is not known.
#pragma once

#include <string>

#include "film/film.h"

namespace covary {

struct DenoiseOptions {
  /// The library's file, its folder, or a folder above it in Python's wheel `pyoidn`, up to the root of the environment
  /// that holds the wheel; "": the environment variable COVARY_OIDN (likewise), the loader's path, and the places where
  /// the wheel puts it (of $VIRTUAL_ENV, the user, the system).
  std::string library;
};

/// Denoises `rgb` (linear, 3 channels, high dynamic range) on the processor. `albedo` in [0, 1] and `normal` in [-1, 1]
/// (3 channels, the same size; the normal only together with the albedo) or null: guides that keep texture and edges;
/// they may be noisy. Values that are not finite become zero before. The same input gives the same bits on one machine.
/// Throws Error(kUsage) when the library is missing, with how to get it, Error(kInput) when sizes differ, and
/// Error(kIo) when the library refuses to work.
Image denoise(const Image& rgb, const Image* albedo, const Image* normal, const DenoiseOptions& options = {});

/// Path of the library that denoise() would load; "" when there is none.
std::string find_denoiser(const DenoiseOptions& options = {});

}  // namespace covary
