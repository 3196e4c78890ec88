// SPDX-License-Identifier: Apache-2.0
#include "plans/pass_files.h"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "core/error.h"
#include "core/json_depth.h"
#include "film/film_file.h"
#include "film/outputs.h"
#include "film/splat_layer.h"
#include "imageio/output_file.h"
#include "imageio/output_folder.h"
#include "plans/made_of.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMaxCostsSize = 4096;

std::string costs_path(const Pass& pass) { return fs::path(pass.path).replace_extension(".json").string(); }

std::string frame_text(const Film& film) {
  const CropWindow& c = film.crop();
  return fmt::format("{} x {}, crop {},{},{},{}", film.frame_width(), film.frame_height(), c.x, c.y, c.width, c.height);
}

/// Reads the cost of a kept film's samples; ignores impossible values.
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
    pass.processor_seconds = costs.processor_seconds;
  } catch (const std::exception& problem) {
    if (warn) warn(fmt::format("'{}' is not used, so that times count this run alone: {}", path, problem.what()));
  }
}

void write_costs(const Pass& pass) {
  const PassResult& result = pass.result;
  write_text_file(costs_path(pass),
                  to_text({result.n_samples, result.n_rays, result.seconds,
                           pass.settings.estimate ? result.estimate_seconds : 0, pass.processor_seconds}));
}

/// Replaces the empty film with the one at pass.path, which it must match.
void resume(const RenderRequest& request, Pass& pass) {
  const std::string frame = frame_text(pass.film);
  const int groups = pass.film.groups(), fewest = pass.plan.min_groups;
  const std::map<std::string, std::string> attributes = std::move(pass.film.attributes);
  pass.film = Film();  // both might not fit into memory
  Film film = read_film(pass.path);
  const auto differs = [&](const std::string& what, const std::string& old_value, const std::string& new_value) {
    throw Error(ErrorCode::kInput,
                fmt::format("`resume`: '{}' was rendered with {} {}, this command asks for {}; `overwrite` replaces it",
                            pass.path, what, old_value, new_value));
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
  // Does not remove a film that an earlier render was asked to keep.
  pass.temporary = pass.temporary && film.attributes.count(film_key::kTemporary) > 0;
  const auto budgets = film.attributes.extract(film_key::kBudgets);
  film.attributes = attributes;
  if (request.until > 0 && budgets) film.attributes[film_key::kBudgets] = budgets.mapped();
  film.aovs.clear();
  pass.film = std::move(film);
}

/// Whether the file is the film of an interrupted render, and not a sum of films, which are in a folder beside it.
bool is_unfinished_film(const std::string& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return false;
  try {
    const std::map<std::string, std::string> attributes = read_film_attributes(path);
    const auto complete = attributes.find(film_key::kComplete);
    return complete != attributes.end() && complete->second == "false" && !attributes.count(film_key::kLight);
  } catch (const Error&) {
    return false;  // an ordinary image
  }
}

bool is_film_file(const std::string& path) {
  try {
    read_film_attributes(path);
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// Only replaces films in the folder itself.
void check_replaceable(const std::string& path) {
  try {
    read_film_attributes(path);
  } catch (const Error& error) {
    throw Error(
        ErrorCode::kInput,
        fmt::format("'{}' would be replaced by the film of a pass, and is not a film: {}; give another name for "
                    "the folder or the output",
                    path, error.what()));
  }
}

constexpr const char* kWaysOut =
    "`resume` continues it, or takes it as it is where it has enough samples, and "
    "`overwrite` replaces it";

/// Whether the film of the only pass is the output's file.
bool outputs_film(const Plan& plan, const RenderRequest& request) {
  return plan.makes_film() && !plan.traces_light && request.passes.empty();
}

}  // namespace

fs::path passes_folder(const RenderRequest& request) {
  if (!request.passes.empty()) return request.passes;
  return request.output.empty() ? fs::path() : fs::path(request.output).replace_extension(".passes");
}

std::string pass_path(const Plan& plan, const RenderRequest& request, const PassPlan& pass) {
  if (outputs_film(plan, request)) return request.output;
  const fs::path folder = passes_folder(request);
  return folder.empty() ? "" : (folder / (pass.id() + ".exr")).string();
}

namespace {

/// The path of a film in the folder; "" if there is none.
std::string film_in(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().extension() == ".exr") return entry.path().string();
  return "";
}

/// Whether the request has more samples than the complete picture, or a goal, so that it may replace it.
bool asks_for_more(const RenderRequest& request, const MadeFile& picture) {
  return request.until > 0 || (request.spp && *request.spp > picture.samples);
}

}  // namespace

void check_earlier_films(const Plan& plan, const RenderRequest& request) {
  if (request.output.empty() || request.overwrite) return;
  std::error_code ignored;
  if (fs::is_regular_file(request.output, ignored) && !is_render(request.output))
    throw Error(ErrorCode::kInput, fmt::format("'{}' already exists, and is no render of covary; give another name, or "
                                               "`overwrite` to replace it",
                                               request.output));
  const bool is_film = outputs_film(plan, request);
  // With a folder for films, the output is a copy of one.
  const bool continues = request.resume && (is_film ? is_film_file(request.output) : !request.passes.empty());
  if (!continues && is_unfinished_film(request.output))
    throw Error(ErrorCode::kInput,
                fmt::format("'{}' is the film of an interrupted render; {}", request.output,
                            request.resume ? "only the command that started it can continue it; `overwrite` "
                                             "replaces it"
                                           : "`resume` continues it, and `overwrite` replaces it"));
  const bool has_folder = !is_film && !request.resume && request.passes.empty();
  const std::string unfinished = film_in(passes_folder(request));
  if (has_folder && !unfinished.empty())
    throw Error(ErrorCode::kInput, fmt::format("'{}' already exists, in the folder for the films of this render; {}",
                                               unfinished, kWaysOut));
  // Films that are continued are compared themselves; those that would be replaced are refused when they are found.
  const bool has_films = fs::is_directory(request.passes, ignored) && !fs::is_empty(request.passes, ignored);
  const auto made_of = request.attributes.find(film_key::kMadeOf);
  if (continues || has_films || made_of == request.attributes.end()) return;
  const MadeFile picture = made_file(request.output);
  const bool asks = request.resume && unfinished.empty() && asks_for_more(request, picture);
  check_made_alike(request.output, made_of->second, request.resume && (!unfinished.empty() || asks), request.resume);
  // Without films, all samples would be taken again, and an interruption would leave a worse picture.
  if (asks && picture.complete && !picture.made_of.empty())
    throw Error(ErrorCode::kInput, fmt::format("`resume`: the samples of '{}' were not kept (`passes`); `overwrite` "
                                               "instead of `resume` renders all",
                                               request.output));
}

void take_film_on_disk(const RenderRequest& request, const std::function<void(const std::string&)>& warn, Pass& pass) {
  const bool kept = !request.passes.empty(), is_film = is_output(pass, request);
  pass.temporary = !kept && !is_film && !pass.path.empty();
  if (pass.path.empty()) return;
  if (!is_film && fs::is_symlink(pass.path))
    throw Error(ErrorCode::kInput,
                fmt::format("'{}' is a symbolic link; films are not written through links; remove it, or "
                            "give another name for the folder or the output",
                            pass.path));
  if (!fs::exists(pass.path)) return;
  if (request.resume) {
    resume(request, pass);
    if (kept && fs::exists(costs_path(pass))) read_costs(warn, pass);
  } else if (!is_film) {
    if (!request.overwrite) throw Error(ErrorCode::kInput, fmt::format("'{}' already exists; {}", pass.path, kWaysOut));
    check_replaceable(pass.path);
  }
}

void save_passes(const RenderRequest& request, std::span<Pass> passes, bool complete) {
  for (Pass& pass : passes) {
    if (pass.path.empty()) continue;
    if (!is_output(pass, request)) make_output_folder(passes_folder(request));
    pass.film.attributes[film_key::kComplete] = complete ? "true" : "false";
    if (pass.temporary) pass.film.attributes[film_key::kTemporary] = "true";
    write_film(pass.path, pass.film);
    pass.film.attributes.erase(film_key::kTemporary);  // an attribute of the file, not of the film
    if (!request.passes.empty()) write_costs(pass);
  }
}

void remove_passes(const RenderRequest& request, std::span<const Pass> passes) {
  std::error_code ignored;
  bool any = false;
  for (const Pass& pass : passes)
    if (pass.temporary) any = true, fs::remove(pass.path, ignored);
  const fs::path folder = passes_folder(request);
  if (any && !fs::is_symlink(folder, ignored)) fs::remove(folder, ignored);  // only if empty
}

namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorCode::kInput, what); }

/// Member `key` of `costs`, which must be a finite number >= 0.
template <typename T>
T amount(const Json& costs, const char* key) {
  const auto it = costs.find(key);
  if (it == costs.end()) fail(fmt::format("'{}' is missing", key));
  const bool fits = std::is_integral_v<T> ? it->is_number_unsigned() : it->is_number();
  if (!fits || !(it->get<double>() >= 0) || !std::isfinite(it->get<double>()))
    fail(fmt::format("'{}' is {}, expected a {} from 0 on", key, it->is_number() ? it->dump() : it->type_name(),
                     std::is_integral_v<T> ? "whole number" : "number"));
  return it->get<T>();
}

}  // namespace

PassCosts parse_pass_costs(std::string_view text) {
  if (line_nested_too_deep(text)) fail(fmt::format("arrays and objects nest deeper than {}", kMaxJsonDepth));
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) fail("expected a JSON object");
  PassCosts costs{amount<uint64_t>(json, "samples"), amount<uint64_t>(json, "rays"), amount<double>(json, "seconds")};
  if (json.contains("estimate_seconds")) costs.estimate_seconds = amount<double>(json, "estimate_seconds");
  if (json.contains("processor_seconds")) costs.processor_seconds = amount<double>(json, "processor_seconds");
  if (costs.estimate_seconds > costs.seconds) fail("'estimate_seconds' is above 'seconds'");
  return costs;
}

std::string to_text(const PassCosts& costs) {
  Json json = {{"samples", costs.samples}, {"rays", costs.rays}, {"seconds", costs.seconds}};
  if (costs.estimate_seconds > 0) json["estimate_seconds"] = costs.estimate_seconds;
  if (costs.processor_seconds > 0) json["processor_seconds"] = costs.processor_seconds;
  return json.dump(2) + "\n";
}

}  // namespace covary
