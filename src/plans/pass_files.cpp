// SPDX-License-Identifier: Apache-2.0
#include "plans/pass_files.h"

#include <fmt/format.h>

#include <exception>
#include <fstream>
#include <iterator>
#include <map>
#include <utility>

#include "core/error.h"
#include "film/film_file.h"
#include "film/output_file.h"
#include "film/splat_layer.h"
#include "plans/pass_costs.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMaxCostsSize = 4096;

std::string costs_path(const Pass& pass) { return fs::path(pass.path).replace_extension(".json").string(); }

std::string frame_text(const Film& film) {
  const CropWindow& c = film.crop();
  return fmt::format("{} x {}, crop {},{},{},{}", film.frame_width(), film.frame_height(), c.x, c.y, c.width, c.height);
}

/// Reads what the samples of a kept film cost; what cannot be right is left out.
void read_costs(const std::function<void(const std::string&)>& warn, Pass& pass) {
  const std::string path = costs_path(pass);
  try {
    if (fs::file_size(path) > kMaxCostsSize) throw Error(ErrorCode::kInput, "the file is too large");
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    const PassCosts costs = parse_pass_costs(text);
    pass.result = {};
    pass.result.n_samples = costs.samples, pass.result.n_rays = costs.rays;
    pass.result.seconds = costs.seconds, pass.result.estimate_seconds = costs.estimate_seconds;
  } catch (const std::exception& problem) {
    if (warn) warn(fmt::format("'{}' is not used, so that times count this run alone: {}", path, problem.what()));
  }
}

void write_costs(const Pass& pass) {
  const PassResult& result = pass.result;
  write_text_file(costs_path(pass), to_text({result.n_samples, result.n_rays, result.seconds,
                                             pass.settings.estimate ? result.estimate_seconds : 0}));
}

/// Puts the film at pass.path in the place of the empty one, which it must match.
void resume(const RenderRequest& request, Pass& pass) {
  const std::string frame = frame_text(pass.film);
  const int groups = pass.film.groups(), fewest = pass.plan.fewest_groups;
  const std::map<std::string, std::string> attributes = std::move(pass.film.attributes);
  pass.film = Film();  // two of them might not fit into memory
  Film film = read_film(pass.path);
  const auto differs = [&](const std::string& what, const std::string& old_value, const std::string& new_value) {
    throw Error(ErrorCode::kInput,
                fmt::format("--resume: '{}' was rendered with {} {}, this command asks for {}{}", pass.path, what,
                            old_value, new_value, request.passes.empty() ? "" : "; --overwrite replaces it"));
  };
  if (frame_text(film) != frame) differs("frame", frame_text(film), frame);
  const bool any_groups = fewest > 0 && film.groups() >= fewest;
  if (film.groups() != groups && !any_groups) differs("groups", std::to_string(film.groups()), std::to_string(groups));
  if (pass.plan.sample_variance && !film.keeps_sample_variance())
    differs("variances of samples", "not kept", "kept ones");
  const auto wanted = [&](const char* key) {
    const auto it = attributes.find(key);
    return it == attributes.end() ? std::string() : it->second;
  };
  for (const char* key : {film_key::kSceneHash, film_key::kSampling, film_key::kSeed, film_key::kSettings,
                          film_key::kTraining, film_key::kLightPaths, film_key::kLight})
    if (film.attributes[key] != wanted(key)) differs(key, film.attributes[key], wanted(key));
  film.attributes = attributes;
  film.aovs.clear();
  pass.film = std::move(film);
}

}  // namespace

bool output_is_film(const Plan& plan, const RenderRequest& request) {
  return plan.film_is_image && !plan.traces_light && request.passes.empty();
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

void take_film_on_disk(const RenderRequest& request, const std::function<void(const std::string&)>& warn, Pass& pass) {
  if (pass.path.empty() || !fs::exists(pass.path)) return;
  const bool kept = !request.passes.empty();
  if (request.resume) {
    resume(request, pass);
    if (kept && fs::exists(costs_path(pass))) read_costs(warn, pass);
  } else if (kept && !request.overwrite) {
    throw Error(ErrorCode::kInput,
                fmt::format("'{}' is there already; --resume continues it, or takes it as it is where "
                            "it has enough samples, and --overwrite replaces it",
                            pass.path));
  }
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
