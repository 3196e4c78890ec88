// SPDX-License-Identifier: Apache-2.0
// A scene of an experiment, looked at, with the runs that it needs.
#pragma once

#include <atomic>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lab/plan.h"
#include "lab/results.h"

namespace covary::lab {

/// Asks the program for the size and hash of scenes, each once: a scene that crashes the reader must not end the
/// experiment.
class SceneReader {
 public:
  SceneReader(std::string program, const std::atomic<bool>* stop) : program_(std::move(program)), stop_(stop) {}

  /// Sets hash, frame and window (place()) of a located scene; what went wrong, if anything did.
  std::optional<Failure> read(SceneInstance& scene, int64_t max_pixels);

 private:
  struct Facts {
    int width = 0, height = 0;
    std::string hash;
    std::optional<Failure> failure;
  };
  Facts look_at(const std::string& file, const SceneInstance& scene) const;

  std::string program_;
  const std::atomic<bool>* stop_;
  std::map<std::string, Facts> known_;  // by file and definitions
};

/// A scene with its runs; none if it cannot be read.
struct ScenePlan {
  SceneInstance scene;
  std::optional<Failure> failure;
  std::vector<Run> references, runs;  ///< references: only those to be rendered
};

/// Plans scene number `index` of the suite, whose files lie in `folder`.
ScenePlan plan_scene(const Suite& suite, size_t index, const std::string& folder, int64_t max_pixels,
                     const PlanContext& context, SceneReader& reader);

}  // namespace covary::lab
