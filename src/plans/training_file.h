// SPDX-License-Identifier: Apache-2.0
// Files that keep what an integrator has learnt (docs/file-formats.md).
#pragma once

#include <string>

#include "passes/integrator.h"

namespace covary {

/// Writes what a trained integrator has learnt in the scene of this hash. Throws Error(kUsage) where it learns nothing
/// that is kept (LearningIntegrator::keeps_training), and Error(kIo).
void save_training(const std::string& scene_hash, const Integrator& integrator, const std::string& path);

/// Gives it to a prepared integrator, which is then not trained. Throws Error(kUsage) likewise, Error(kIo), and
/// Error(kInput) for a file that is damaged, of another version, or of another scene or other settings.
void load_training(const std::string& scene_hash, Integrator& integrator, const std::string& path);

}  // namespace covary
