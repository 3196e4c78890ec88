// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace covary {

/// The mean with denoised images mixed in (mixed_denoising.h): covary's default.
inline constexpr const char* kMixture = "mixture";

}  // namespace covary
