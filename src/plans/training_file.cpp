// SPDX-License-Identifier: Apache-2.0
#include "plans/training_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/error.h"
#include "film/output_file.h"
#include "integrators/training.h"
#include "sampling/training_bytes.h"

namespace covary {
namespace {

LearningIntegrator& learning_integrator(const LoadedScene& scene) {
  auto* learning = dynamic_cast<LearningIntegrator*>(scene.integrator.get());
  if (!learning || !learning->keeps_training())
    throw Error(ErrorCode::kUsage,
                "only the integrator controlled-path with control variates and guided-path keep a training file");
  return *learning;
}

/// What was learnt from.
std::string key(const LoadedScene& scene, const LearningIntegrator& integrator) {
  return scene.content_hash + "; " + integrator.settings_text();
}

}  // namespace

void save_training(const LoadedScene& scene, const std::string& path) {
  const LearningIntegrator& integrator = learning_integrator(scene);
  write_text_file(path, training_file_bytes(key(scene, integrator), integrator.trained_bytes()));
}

void load_training(const LoadedScene& scene, const std::string& path) {
  LearningIntegrator& integrator = learning_integrator(scene);
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  if (file) content << file.rdbuf();
  if (!file || !content)
    throw Error(ErrorCode::kIo, "cannot read the training file '" + path + "': " + std::strerror(errno));
  const std::string bytes = content.str();
  integrator.use_bytes(training_file_body(bytes, key(scene, integrator), path), path);
}

}  // namespace covary
