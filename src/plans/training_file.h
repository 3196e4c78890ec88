// SPDX-License-Identifier: Apache-2.0
// Files that keep what an integrator has learnt (docs/file-formats.md).
#pragma once

#include <string>

#include "io/load_scene.h"

namespace covary {

/// Writes what the scene's trained integrator has learnt. Throws Error(kUsage) where it learns nothing that is kept
/// (LearningIntegrator::keeps_training), and Error(kIo).
void save_training(const LoadedScene& scene, const std::string& path);

/// Gives it to the scene's prepared integrator, which is then not trained. Throws Error(kUsage) likewise,
/// Error(kIo), and Error(kInput) for a file that is damaged, of another version, or of another scene or other settings.
void load_training(const LoadedScene& scene, const std::string& path);

}  // namespace covary
