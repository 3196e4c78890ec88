// SPDX-License-Identifier: Apache-2.0
#include "plans/training_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/error.h"
#include "film/output_file.h"
#include "integrators/controlled_path.h"

namespace covary {
namespace {

ControlledPath& controlled_path(const LoadedScene& scene) {
  auto* controlled = dynamic_cast<ControlledPath*>(scene.integrator.get());
  if (!controlled || !controlled->settings().on())
    throw Error(ErrorCode::kUsage, "only the integrator controlled-path with control variates keeps a training file");
  return *controlled;
}

/// What the coefficients belong to.
std::string key(const LoadedScene& scene, const ControlledPath& controlled) {
  return scene.content_hash + "; " + controlled.settings_text();
}

}  // namespace

void save_training(const LoadedScene& scene, const std::string& path) {
  const ControlledPath& controlled = controlled_path(scene);
  write_text_file(path, controlled.table().to_bytes(key(scene, controlled)));
}

void load_training(const LoadedScene& scene, const std::string& path) {
  ControlledPath& controlled = controlled_path(scene);
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  if (file) bytes << file.rdbuf();
  if (!file || !bytes)
    throw Error(ErrorCode::kIo, "cannot read the training file '" + path + "': " + std::strerror(errno));
  controlled.use(CoefficientTable::from_bytes(bytes.str(), key(scene, controlled), path));
}

}  // namespace covary
