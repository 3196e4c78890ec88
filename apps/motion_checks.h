// SPDX-License-Identifier: Apache-2.0
// Whether frames and their motion fit together.
#pragma once

#include <string>

#include "core/error.h"
#include "sequences/motion_file.h"

namespace covary {

/// A fault of the whole sequence, not of one frame.
class WrongSequence : public Error {
 public:
  explicit WrongSequence(const std::string& message) : Error(ErrorCode::kInput, message) {}
};

/// Throws WrongSequence if the motion explains less of the changes between two frames, files with the picture in
/// `layer`, than no motion, or than motion with other signs. (Warping a noisy image by fractions of pixels smooths it,
/// so any motion may fit better than none.)
void check_motion(const std::string& before, const std::string& now, const std::string& layer,
                  const MotionLayers& motion);

/// Throws WrongSequence if frames have the same seed: they share errors, which held-out samples cannot reveal.
void check_seeds(const std::string& before, const std::string& now);

}  // namespace covary
