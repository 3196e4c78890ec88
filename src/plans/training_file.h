// SPDX-License-Identifier: Apache-2.0
// Files that keep what an integrator has learnt (docs/file-formats.md).
#pragma once

#include <string>

#include "io/load_scene.h"

namespace covary {

/// Writes the coefficients of the scene's trained `controlled-path`. Throws Error(kUsage) where the scene has another
/// integrator or its control is off, and Error(kIo).
void save_training(const LoadedScene& scene, const std::string& path);

/// Gives them to the scene's prepared `controlled-path`, which is then not trained. Throws Error(kUsage) likewise,
/// Error(kIo), and Error(kInput) for a file that is damaged, of another version, or of another scene or other settings.
void load_training(const LoadedScene& scene, const std::string& path);

}  // namespace covary
