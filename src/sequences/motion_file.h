// SPDX-License-Identifier: Apache-2.0
// Reads the motion of frames of any renderer from their files.
#pragma once

#include <string>

#include "sequences/reprojection.h"

namespace covary {

/// The layers that hold motion, and their convention.
struct MotionSource {
  /// Layer of two channels or more: .X .Y, or .R .G, or .U .V. Names may omit what stands before the last dot, such as
  /// Blender's view layer. If there is no Motion, Blender's Vector is used, in Blender's convention.
  std::string motion = "Motion";
  std::string depth = "Depth";  ///< a channel, or a layer of one: .V, .Z, .R, .Y or .X; ignored if missing
  /// Factors that convert the values to pixels to the right and down, from a pixel to its point's position in the
  /// previous frame.
  float scale_x = 1, scale_y = 1;
};

/// Whether the file has the layer of motion. Throws Error(kIo).
bool has_motion(const std::string& path, const MotionSource& source);

/// The layers in the file's window. In covary's motion, a third channel .Z is the change of depth; without it, or
/// without depth, MotionLayers::knows_depth is false. Throws Error(kIo), and Error(kInput), listing the layers, if the
/// motion is missing.
MotionLayers read_motion(const std::string& path, const MotionSource& source);

/// How well the motion matches two pictures, `now` being the later one: the mean difference of the warped picture from
/// `now` over known pixels, divided by that without motion, each relative to its brightness. Below 1, motion explains
/// the changes. 1 if both are the same, or nothing is known.
double misfit(const Image& before, const Image& now, const MotionLayers& motion);

}  // namespace covary
