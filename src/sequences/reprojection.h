// SPDX-License-Identifier: Apache-2.0
// The image of the frame before, moved to where its points are now.
#pragma once

#include "denoising/history.h"

namespace covary {

/// Layers of a frame, of one size: Depth and Motion as in passes/motion.h.
struct MotionLayers {
  Image depth;   ///< 1 channel; 0 where there is nothing
  Image motion;  ///< 3 channels: pixels to the right and down, and depth: before minus now
  /// The third channel of motion is known, and depth. Otherwise a point may have come nearer or farther by a tenth.
  bool knows_depth = true;
};

/// Whether what is shown next to a pixel, or in it, moves otherwise: by more than a quarter of a pixel.
bool is_motion_edge(const Image& motion, int x, int y);

/// `before`: the picture of the frame before, 3 channels, and `depth_before` its depth, in the same window of the frame
/// as `now`. Where motion is less than a thousandth of a pixel, values are taken as they are. Otherwise they are
/// interpolated by Catmull-Rom splines [Catmull1974], clamped to the four pixels around. `squared_error` is the squared
/// difference to linear interpolation, its mean over the channels and 3 x 3 pixels.
///
/// Where things move against each other or the background (by more than a quarter of a pixel from a pixel to the next),
/// pixels that move may show both: to the squared error is added how far what neighbours' motions lead to differs.
///
/// Not known is what lies out of the window, and what was hidden, by depth: one of the four pixels around is not as far
/// away as the point was.
///
/// `samples`: History::samples of the frame before, or empty. They are moved by whole pixels, so that their noise stays
/// independent from pixel to pixel; what the moved picture differs by from the pixel that they are taken from is added.
///
/// `features`: albedo and normal of the frame before, 6 channels, or empty. History::slopes are those of `before` over
/// them (feature_slopes.h), at the pixel where the point was; squared errors are then of what they leave.
History reproject(const Image& before, const Image& depth_before, const MotionLayers& now,
                  const std::array<Image, 2>& samples = {}, const Image& features = {});

}  // namespace covary
