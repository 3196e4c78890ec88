// SPDX-License-Identifier: Apache-2.0
// Reads motion vectors from the frames of any renderer.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "sequences/reprojection.h"

namespace covary {

/// The layers of motion and depth, and their convention.
struct MotionSource {
  /// A layer with channels .X .Y, or .R .G, or .U .V. The name may omit a prefix up to a dot, such as Blender's view
  /// layer. By default, a file without Motion may have Blender's Vector, which is read in Blender's convention.
  std::string motion = "Motion";
  std::string depth = "Depth";  ///< a channel, or a layer with one: .V, .Z, .R, .Y or .X; ignored if missing
  /// Factors that convert the values to pixels, right and down, from a pixel to its point's position in the previous
  /// frame.
  float scale_x = 1, scale_y = 1;
};

/// Whether the file has the motion layer. Throws Error(kIo).
bool has_motion(const std::string& path, const MotionSource& source);

/// Reads the layers within the file's data window. A third motion channel .Z is covary's change of depth; without it,
/// or without depth, MotionLayers::knows_depth is false. Throws Error(kIo), and Error(kInput), which lists the layers,
/// if the motion is missing.
MotionLayers read_motion(const std::string& path, const MotionSource& source);

/// How badly each motion matches two pictures, `now` being the later one: the mean difference between the reprojected
/// picture and `now`, divided by that without motion, each relative to brightness, over the pixels that all motions
/// know. Below 1, motion explains the changes. 1 if both pictures are equal, or less than a twentieth of the pixels is
/// known.
std::vector<double> misfits(const Image& before, const Image& now, std::span<const MotionLayers> motions);

}  // namespace covary
