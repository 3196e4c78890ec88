// SPDX-License-Identifier: Apache-2.0
#include "plans/pass_files.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/error.h"
#include "film/film_file.h"
#include "film/output_file.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

std::string costs_path(const Pass& pass) { return fs::path(pass.path).replace_extension(".json").string(); }

std::string frame_text(const Film& film) {
  const CropWindow& c = film.crop();
  return fmt::format("{} x {}, crop {},{},{},{}", film.frame_width(), film.frame_height(), c.x, c.y, c.width, c.height);
}

/// Reads what the samples of a kept film cost.
void read_costs(Pass& pass) {
  std::ifstream file(costs_path(pass));
  const nlohmann::json costs = nlohmann::json::parse(file, nullptr, false);
  if (costs.is_discarded()) return;
  pass.result.n_samples = costs.value("samples", uint64_t{0});
  pass.result.n_rays = costs.value("rays", uint64_t{0});
  pass.result.seconds = costs.value("seconds", 0.0);
  pass.result.estimate_seconds = costs.value("estimate_seconds", 0.0);
}

void write_costs(const Pass& pass) {
  nlohmann::ordered_json costs = {
      {"samples", pass.result.n_samples}, {"rays", pass.result.n_rays}, {"seconds", pass.result.seconds}};
  if (pass.settings.estimate) costs["estimate_seconds"] = pass.result.estimate_seconds;
  write_text_file(costs_path(pass), costs.dump(2) + "\n");
}

}  // namespace

bool output_is_film(const Plan& plan, const RenderRequest& request) {
  return plan.film_is_image && request.passes.empty();
}

fs::path passes_folder(const RenderRequest& request) {
  if (!request.passes.empty()) return request.passes;
  return request.output.empty() ? fs::path() : fs::path(request.output).replace_extension(".passes");
}

std::string pass_path(const Plan& plan, const RenderRequest& request, const PassPlan& pass) {
  if (output_is_film(plan, request)) return request.output;
  const fs::path folder = passes_folder(request);
  return folder.empty() ? "" : (folder / (pass.id() + ".exr")).string();
}

void resume(const RenderRequest& request, Pass& pass) {
  const Film empty = std::exchange(pass.film, read_film(pass.path));
  Film& film = pass.film;
  const auto differs = [&](const std::string& what, const std::string& old_value, const std::string& new_value) {
    throw Error(ErrorCode::kInput, fmt::format("--resume: '{}' was rendered with {} {}, this command asks for {}",
                                               pass.path, what, old_value, new_value));
  };
  if (frame_text(film) != frame_text(empty)) differs("frame", frame_text(film), frame_text(empty));
  const int fewest = pass.plan.fewest_groups;
  const bool any_groups = fewest > 0 && film.groups() >= fewest;
  if (film.groups() != empty.groups() && !any_groups)
    differs("groups", std::to_string(film.groups()), std::to_string(empty.groups()));
  for (const char* key : {film_key::kSceneHash, film_key::kSampling, film_key::kSeed, film_key::kSettings})
    if (film.attributes[key] != empty.attributes.at(key)) differs(key, film.attributes[key], empty.attributes.at(key));
  film.attributes = empty.attributes;
  film.aovs.clear();
  if (!request.passes.empty() && fs::exists(costs_path(pass))) read_costs(pass);
}

void save_passes(const RenderRequest& request, std::span<Pass> passes, bool complete) {
  for (Pass& pass : passes) {
    if (pass.path.empty()) continue;
    if (pass.path != request.output) fs::create_directories(passes_folder(request));
    pass.film.attributes[film_key::kComplete] = complete ? "true" : "false";
    write_film(pass.path, pass.film);
    if (!request.passes.empty()) write_costs(pass);
  }
}

void remove_passes(const Plan& plan, const RenderRequest& request, std::span<const Pass> passes) {
  if (!request.passes.empty() || request.output.empty() || output_is_film(plan, request)) return;
  std::error_code ignored;
  for (const Pass& pass : passes) fs::remove(pass.path, ignored);
  fs::remove(passes_folder(request), ignored);  // only when empty
}

}  // namespace covary
