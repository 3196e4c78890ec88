// SPDX-License-Identifier: Apache-2.0
// Motion vectors: where the contents of a pixel were in the previous frame.
#pragma once

#include <atomic>

#include "film/film.h"
#include "scene/scene.h"

namespace covary {

/// Surfaces at the pixel centres: no random samples, so edges are sharp and no value averages two surfaces.
struct MotionImages {
  /// 1 channel: distance of the first surface from the camera (orthographic: from its plane along the ray), in units of
  /// the scene; 0 if there is none. A thin lens counts as a pinhole at its centre.
  Image depth;
  /// 3 channels, each the previous value minus the current one: film position of the same point, in pixels, X to the
  /// right and Y down; and its depth. If a ray leaves the scene, the point is at infinity in that direction, and the
  /// depth is unused. A point behind the previous camera gets (width of the frame, 0, 0), which points out of the
  /// frame.
  Image motion;
};

/// For the pixels of `window`, inside the frame of the scene's camera; `previous` has a frame of the same size. Shapes
/// were where their animations put them at the time `then`. Mirrors and glass count as surfaces. Once `stop` is true,
/// the remaining pixels are 0.
MotionImages motion_images(const Scene& scene, const Camera& previous, double then, const CropWindow& window,
                           const std::atomic<bool>* stop = nullptr);

}  // namespace covary
