// SPDX-License-Identifier: Apache-2.0
// The first picture of a render: one sample in each square of pixels, as small as a fraction of a second allows. These
// samples have random numbers of their own and do not enter the image.
#pragma once

#include <atomic>

#include "plans/render.h"

namespace covary {

/// Largest side of the squares, in pixels, of which pictures made in a hurry have one value each.
inline constexpr int kMaxStride = 16;

struct FirstPicture {
  Image image;     ///< of the centres of the squares
  int stride = 1;  ///< side of the squares in pixels
};

/// By the render's integrator, or by path tracing in place of one that has to be chosen or trained first. `stop` (may
/// be null) ends it early; the image is then not complete. Throws Error as render() does.
FirstPicture first_picture_of(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                              const std::atomic<bool>* stop);

}  // namespace covary
