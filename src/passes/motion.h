// SPDX-License-Identifier: Apache-2.0
// Where what a pixel shows was in the frame before.
#pragma once

#include <atomic>

#include "film/film.h"
#include "scene/scene.h"

namespace covary {

/// What lies behind the centres of the pixels: no sample is drawn, so that edges are sharp and no value is a mean of
/// two surfaces.
struct MotionImages {
  /// 1 channel: distance of the first surface from the camera (orthographic: from its plane along the ray), in units of
  /// the scene; 0 where there is none. A thin lens counts as the pinhole in its middle.
  Image depth;
  /// 3 channels, each the previous value minus that of this frame: film position of the same point, in pixels, X to the
  /// right and Y down; and its depth. Where a ray leaves the scene, the point is at infinity in that direction, and
  /// depth has no part. A point that the previous camera had behind it gets (width of the frame, 0, 0), which leads out
  /// of the frame.
  Image motion;
};

/// Of the pixels of `window`, which lies in the frame of the scene's camera; `previous` has a frame of the same size.
/// Shapes were where their animations say for the time `then`. Mirrors and glass count as surfaces. Where `stop`
/// becomes true, the rest of the pixels are 0.
MotionImages motion_images(const Scene& scene, const Camera& previous, double then, const CropWindow& window,
                           const std::atomic<bool>* stop = nullptr);

}  // namespace covary
