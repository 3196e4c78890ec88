// SPDX-License-Identifier: Apache-2.0
#include "lab/scene_plan.h"

#include <nlohmann/json.hpp>

#include "core/process.h"
#include "core/shell_text.h"

namespace covary::lab {

std::optional<Failure> SceneReader::read(SceneInstance& scene, int64_t max_pixels) {
  for (const std::string& file : scene.scene_files()) {
    std::string key = file;
    for (const std::string& define : scene.entry.defines) key += "\n" + define;
    auto known = known_.find(key);
    if (known == known_.end()) {
      Facts facts = look_at(file, scene);
      if (stop_ && stop_->load()) return std::move(facts.failure);
      known = known_.emplace(key, std::move(facts)).first;
    }
    const Facts& facts = known->second;
    std::optional<Failure> failure = facts.failure;
    if (!failure) try {
        scene.hash += facts.hash;
        place(scene, facts.width, facts.height, max_pixels);
      } catch (const std::exception& error) {
        failure = Failure{"", "", "", "", error.what(), 0, 0};
      }
    if (!failure) continue;
    failure->scene = scene.entry.name;
    return failure;
  }
  return std::nullopt;
}

SceneReader::Facts SceneReader::look_at(const std::string& file, const SceneInstance& scene) const {
  std::vector<std::string> command{program_, "info", file, "--json"};
  for (const std::string& define : scene.entry.defines) command.insert(command.end(), {"-D", define});
  const ProcessResult process = run_process(command, stop_);
  std::string message = process.errors;
  if (process.ok()) try {
      const nlohmann::json info = nlohmann::json::parse(process.output);
      return {info.at("frame").at(0), info.at("frame").at(1), info.at("scene_hash"), std::nullopt};
    } catch (const std::exception& error) {
      message = error.what();
    }
  command[0] = "covary";
  return {0, 0, "", Failure{scene.entry.name, "", "", shell_text(command), message, process.exit_code, 0}};
}

ScenePlan plan_scene(const Suite& suite, size_t index, const std::string& folder, int64_t max_pixels,
                     const PlanContext& context, SceneReader& reader) {
  ScenePlan plan{located(suite.scenes[index], folder), {}, {}, {}};
  plan.failure = reader.read(plan.scene, max_pixels);
  if (plan.failure) return plan;
  if (suite.reference_of(plan.scene.entry).files.empty()) plan.references = reference_runs(suite, plan.scene, context);
  plan.runs = runs_of_scene(suite, index, plan.scene, context);
  return plan;
}

}  // namespace covary::lab
