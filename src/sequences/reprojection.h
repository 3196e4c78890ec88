// SPDX-License-Identifier: Apache-2.0
// Reprojects the previous frame to the current one [Nehab2007].
#pragma once

#include "denoising/history.h"

namespace covary {

/// Layers of a frame, of one size: Depth and Motion as in passes/motion.h.
struct MotionLayers {
  Image depth;   ///< 1 channel; 0 where there is nothing
  Image motion;  ///< 3 channels: previous minus current position, in pixels right and down, and depth
  /// Depth and the third channel of motion are known. Otherwise depth may change by a tenth from frame to frame.
  bool knows_depth = true;
};

/// Whether the motion of a neighbour, in the 3 x 3 pixels around, differs by more than a quarter of a pixel.
bool is_motion_edge(const Image& motion, int x, int y);

/// `before`: the previous frame's picture, 3 channels, and `depth_before` its depth, in the same data window as `now`.
/// Where motion is below a thousandth of a pixel, values are copied. Otherwise they are interpolated by Catmull-Rom
/// splines [Catmull1974], clamped to the four nearest pixels. `squared_error` is the squared difference from bilinear
/// interpolation, averaged over the channels and 3 x 3 pixels.
///
/// Where neighbours' motions differ (is_motion_edge()), a moving pixel may show more than one surface: a fifth of the
/// largest squared difference from the values at which the neighbours' motions point is added to the squared error.
///
/// Pixels are unknown if they come from outside the window or were occluded: the depth of one of the four nearest
/// pixels is not that of the point.
///
/// `samples`: History::samples of the previous frame, or empty. They are moved by whole pixels, so that their noise
/// stays independent between pixels; the reprojected picture minus the pixel that they are taken from is added.
///
/// `features`: albedo and normal of the previous frame, 6 channels, or empty. History::slopes are those of `before`
/// over them (feature_slopes.h), at the pixel where the point was; squared errors are then of the residuals.
///
/// Throws Error(kInput) if sizes differ.
History reproject(const Image& before, const Image& depth_before, const MotionLayers& now,
                  const std::array<Image, 2>& samples = {}, const Image& features = {});

}  // namespace covary
