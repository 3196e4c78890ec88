// SPDX-License-Identifier: Apache-2.0
// Motion of frames of any renderer, from their files.
#pragma once

#include <string>

#include "sequences/reprojection.h"

namespace covary {

/// Which layers tell motion, and how they mean it.
struct MotionSource {
  /// Layer of two channels or more: .X .Y, or .R .G, or .U .V. Names may lack what stands before the last dot, as
  /// Blender's view layer. Where there is no Motion, Blender's Vector is taken, as Blender means it.
  std::string motion = "Motion";
  std::string depth = "Depth";  ///< a channel, or a layer of one: .V, .Z, .R, .Y or .X; left out where there is none
  /// What the values are multiplied by, so that they are pixels to the right and down from a pixel to where its point
  /// was in the frame before.
  float scale_x = 1, scale_y = 1;
};

/// Whether the file has the layer of motion. Throws Error(kIo).
bool has_motion(const std::string& path, const MotionSource& source);

/// The layers in the file's window. A third channel .Z of motion that is covary's is the change of depth; without one,
/// or without depth, MotionLayers::knows_depth is false. Throws Error(kIo), and Error(kInput) with the layers there are
/// where the motion is missing.
MotionLayers read_motion(const std::string& path, const MotionSource& source);

/// How well motion fits two pictures of which `now` is the later one: the mean over pixels that are known of the
/// distance of the moved picture to `now`, over that without motion, each relative to its brightness; below 1: motion
/// explains what has changed. 1 where both are the same, or nothing is known.
double misfit(const Image& before, const Image& now, const MotionLayers& motion);

}  // namespace covary
