// SPDX-License-Identifier: Apache-2.0
// Results of an image that is estimated in bands of rows.
#pragma once

#include "estimators/estimator_result.h"

namespace covary {

/// Copies n rows of `part`, starting at its row `skipped`, to rows y … y + n - 1 of `whole`, which is allocated with
/// `height` rows when needed. An empty image stays empty.
void copy_rows(const Image& part, int skipped, int y, int n, int height, Image& whole);

/// Appends n rows of `part`, starting at its row `skipped`, to `whole`, whose next row is y: estimate, standard error,
/// bias and what rows tell of the error. Layers and sums over the image are left out.
void append_rows(const MethodImage& part, int skipped, int y, int n, int height, MethodImage& whole);

}  // namespace covary
