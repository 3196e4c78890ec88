// SPDX-License-Identifier: Apache-2.0
#include "plans/training_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/error.h"
#include "film/output_file.h"
#include "passes/training.h"
#include "sampling/training_bytes.h"

namespace covary {
namespace {

/// The integrator if it keeps what it learns, else throws.
template <typename Learning>
Learning& keeper(Learning* learning) {
  if (!learning || !learning->keeps_training())
    throw Error(ErrorCode::kUsage,
                "only the integrator controlled-path with control variates and guided-path keep a training file");
  return *learning;
}

/// What was learnt from.
std::string key(const std::string& scene_hash, const LearningIntegrator& integrator) {
  return scene_hash + "; " + integrator.settings_text();
}

}  // namespace

void save_training(const std::string& scene_hash, const Integrator& integrator, const std::string& path) {
  const LearningIntegrator& learnt = keeper(integrator.learning());
  write_text_file(path, training_file_bytes(key(scene_hash, learnt), learnt.trained_bytes()));
}

void load_training(const std::string& scene_hash, Integrator& integrator, const std::string& path) {
  LearningIntegrator& learning = keeper(integrator.learning());
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  if (file) content << file.rdbuf();
  if (!file || !content)
    throw Error(ErrorCode::kIo, "cannot read the training file '" + path + "': " + std::strerror(errno));
  const std::string bytes = content.str();
  learning.use_bytes(training_file_body(bytes, key(scene_hash, learning), path), path);
}

}  // namespace covary
