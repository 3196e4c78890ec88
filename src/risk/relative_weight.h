// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/vec.h"

namespace covary {

/// 1 / (F'^2 + 0.01), the weight of relMSE, at a pixel of RGB `f`; F' is their mean.
inline float relative_weight(const float* f) { return 1 / (sqr((f[0] + f[1] + f[2]) / 3) + 0.01f); }

/// In double precision, in which sums over an image are kept.
inline double square(double value) { return value * value; }

}  // namespace covary
