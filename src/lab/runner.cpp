// SPDX-License-Identifier: Apache-2.0
#include "lab/runner.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <utility>

#include "core/error.h"
#include "core/process.h"
#include "core/shell_text.h"
#include "film/image_file.h"
#include "imageio/output_file.h"

namespace covary::lab {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

std::optional<nlohmann::json> read_json_file(const std::string& path) {
  std::ifstream file(path);
  if (!file) return std::nullopt;
  nlohmann::json json = nlohmann::json::parse(file, nullptr, false);
  if (json.is_discarded()) return std::nullopt;
  return json;
}

/// The command as a user would type it: `covary` instead of the program's path.
std::string typed(Words command) {
  command[0] = "covary";
  return shell_text(command);
}

/// The scene that a render says it is of.
std::string scene_hash_of(const std::string& render) {
  const std::map<std::string, std::string> attributes = inspect_image(render).attributes;
  const auto found = attributes.find(std::string("covary:") + film_key::kSceneHash);
  return found == attributes.end() ? "" : found->second;
}

/// Adds the statistics of one of `n` images.
void add_statistics(const nlohmann::json& stats, size_t n, RunRecord& record) {
  const nlohmann::json seconds = stats.value("seconds", nlohmann::json::object());
  record.load_seconds += seconds.value("load", 0.0) + seconds.value("build", 0.0);
  record.render_seconds += seconds.value("render", 0.0) + seconds.value("trial", 0.0) + seconds.value("train", 0.0);
  record.estimate_seconds += seconds.value("estimate", 0.0);
  record.processor_seconds += seconds.value("processor", 0.0);
  record.samples_per_pixel +=
      (stats.value("samples_per_pixel", 0.0) + stats.value("training_samples_per_pixel", 0.0)) / static_cast<double>(n);
  record.peak_memory_bytes = std::max(record.peak_memory_bytes, stats.value("peak_memory_bytes", 0.0));
}

/// The times of a program that says how long its work took elsewhere or earlier, in lines "seconds 1.5" and
/// "processor_seconds 1.2": NaN, unknown, if it tells the first alone.
ProcessResult told_times(ProcessResult process) {
  std::istringstream lines(process.output);
  if (process.output.starts_with("seconds ") || process.output.find("\nseconds ") != std::string::npos)
    process.processor_seconds = std::numeric_limits<double>::quiet_NaN();
  for (std::string line; std::getline(lines, line);)
    for (const auto& [name, value] :
         {std::pair{"seconds ", &process.seconds}, {"processor_seconds ", &process.processor_seconds}})
      if (line.starts_with(name)) {
        const double told = std::strtod(line.c_str() + std::strlen(name), nullptr);
        if (std::isfinite(told) && told >= 0) *value = told;
      }
  return process;
}

/// The frame number in the names of a run's files.
std::string number_of(const Run& run) { return run.frames.empty() ? "" : "_####"; }

nlohmann::json json_of(const RunRecord& r) {
  return {{"command", r.command},
          {"seconds", seconds_of(r)},
          {"samples_per_pixel", r.samples_per_pixel},
          {"peak_memory_bytes", r.peak_memory_bytes},
          {"messages", r.messages}};
}

}  // namespace

nlohmann::ordered_json seconds_of(const RunRecord& r) {
  return {{"load", r.load_seconds},
          {"render", r.render_seconds},
          {"estimate", r.estimate_seconds},
          {"then", r.then_seconds},
          {"processor", r.processor_seconds}};
}

Cache::Cache(std::string folder, const std::string& part) : folder_(std::move(folder)) {
  std::error_code error;
  for (const char* kind : {"runs", "passes", "measures"}) fs::create_directories(fs::path(folder_) / kind, error);
  if (error) throw Error(ErrorCode::kIo, fmt::format("cannot make the cache {}: {}", folder_, error.message()));
  lock("lock", part.empty() ? LOCK_EX : LOCK_SH);
  if (!part.empty()) lock("lock-" + part, LOCK_EX);
}

void Cache::lock(const std::string& name, int operation) {
  const int file = open((folder_ + "/" + name).c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
  if (file < 0)
    throw Error(ErrorCode::kIo, fmt::format("cannot write to the cache {}: {}", folder_, std::strerror(errno)));
  locks_.push_back(file);
  if (flock(file, operation | LOCK_NB) == 0) return;
  for (const int held : locks_) close(held);
  throw Error(ErrorCode::kIo, fmt::format("the cache {} is in use by another experiment; wait for it, or give this "
                                          "one its own by --cache DIR",
                                          folder_));
}

Cache::~Cache() {
  for (const int file : locks_) close(file);
}

std::string Cache::path(const std::string& kind, const std::string& key) const {
  return folder_ + "/" + kind + "/" + key;
}

std::optional<nlohmann::json> Cache::read_json(const std::string& kind, const std::string& key) const {
  return read_json_file(path(kind, key));
}

void Cache::write_json(const std::string& kind, const std::string& key, const nlohmann::json& json) const {
  write_text_file(path(kind, key), json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

std::optional<RunRecord> Runner::find(const Run& run) const {
  const std::string image = cache_.path("runs", run.key) + "/image" + number_of(run) + ".exr";
  const std::optional<nlohmann::json> json = cache_.read_json("runs", run.key + "/run.json");
  const Words files = files_of(run.frames, image);
  if (!json || !std::all_of(files.begin(), files.end(), [](const std::string& file) { return fs::exists(file); }))
    return std::nullopt;
  RunRecord record;
  add_statistics(*json, 1, record);
  record.image = image;
  record.command = json->value("command", "");
  record.messages = json->value("messages", "");
  record.then_seconds = json->value("seconds", nlohmann::json::object()).value("then", 0.0);
  return record;
}

/// What a failed command leaves: nothing if it was stopped.
Runner::Result Runner::failed(const std::string& command, const ProcessResult& process) const {
  if (stop_ && stop_->load()) return {};
  const std::string signal = process.signal ? fmt::format("ended by signal {}; ", process.signal) : "";
  return {std::nullopt, RunFailure{command, process.exit_code, signal + process.errors}};
}

/// `covary render` of the run into `output`; its record.
Runner::Result Runner::render(const Run& run, const SceneInstance& scene, const std::string& output) const {
  const std::string stats = cache_.path("runs", run.key) + "/stats" + number_of(run) + ".json";
  Words render{program_, "render", scene.file};
  render.insert(render.end(), run.options.begin(), run.options.end());
  const std::string typed_command = typed(render);
  if (threads_ > 0) render.insert(render.end(), {"--threads", fmt::format("{}", threads_)});
  render.insert(render.end(), {"--quiet", "--no-preview", "--json", stats, "-o", output});
  // Of an interrupted sequence, complete frames are kept instead of films.
  if (run.frames.empty()) render.insert(render.end(), {"--passes", cache_.path("passes", run.passes_key)});
  render.emplace_back(run.timed ? "--overwrite" : "--resume");
  const ProcessResult process = run_process(render, stop_);
  // An image that missed its target error is still an image.
  constexpr int kTargetMissed = 3;
  if (!process.ok() && process.exit_code != kTargetMissed) return failed(typed_command, process);
  if (run.frames.empty() && scene.hash.find(scene_hash_of(output)) == std::string::npos) {
    std::error_code ignored;
    fs::remove(output, ignored);
    return {std::nullopt,
            RunFailure{typed_command, 0,
                       fmt::format("'{}' has changed since the experiment began; the same command again makes all of "
                                   "its runs anew",
                                   scene.file)}};
  }
  RunRecord record;
  for (const std::string& file : files_of(run.frames, stats)) {
    const std::optional<nlohmann::json> json = read_json_file(file);
    if (!json) return {std::nullopt, RunFailure{typed_command, 0, "the render wrote no statistics"}};
    add_statistics(*json, std::max<size_t>(1, run.frames.size()), record);
  }
  record.command = typed_command;
  record.messages = process.errors;
  return {record, std::nullopt};
}

Runner::Result Runner::execute(const Run& run, const SceneInstance& scene) const {
  const std::string folder = cache_.path("runs", run.key), number = number_of(run),
                    image = folder + "/image" + number + ".exr";
  fs::create_directories(folder);
  const bool is_last = run.then.empty() && run.program.empty();
  std::string output = !run.renders ? "" : is_last ? image : folder + "/step0" + number + ".exr";
  RunRecord record;
  record.samples_per_pixel = run.samples;
  if (run.renders) {
    Result rendered = render(run, scene, output);
    if (!rendered.record) return rendered;
    record = *rendered.record;
  }
  record.image = image;
  const auto add_step = [&](const std::string& typed_step, const ProcessResult& step) {
    record.then_seconds += step.seconds;
    record.processor_seconds += step.processor_seconds;
    record.peak_memory_bytes = std::max(record.peak_memory_bytes, static_cast<double>(step.peak_memory_bytes));
    record.command += (record.command.empty() ? "" : " && ") + typed_step;
    record.messages += step.errors;
    if (!output.empty())
      for (const std::string& file : files_of(run.frames, output)) fs::remove(file);
  };
  if (!run.program.empty()) {
    const std::string made = run.then.empty() ? image : folder + "/program.exr";
    const ProcessResult own = run_program(run, output, made);
    if (!own.ok()) return failed(run.program, own);
    add_step(run.program, told_times(own));
    output = made;
  }
  for (size_t i = 0; i < run.then.size(); ++i) {
    const std::string next = i + 1 == run.then.size() ? image : fmt::format("{}/step{}{}.exr", folder, i + 1, number);
    Words step{program_, run.then[i][0], output};
    step.insert(step.end(), run.then[i].begin() + 1, run.then[i].end());
    const std::string typed_step = typed(step);
    step.insert(step.end(), {"-o", next});
    const ProcessResult after = run_process(step, stop_);
    if (!after.ok()) return failed(typed_step, after);
    add_step(typed_step, after);
    output = next;
  }
  if (std::isnan(record.processor_seconds)) record.processor_seconds = 0;  // unknown
  cache_.write_json("runs", run.key + "/run.json", json_of(record));
  return {record, std::nullopt};
}

/// Runs the user's program. A result without the image that it was asked for is a failure.
ProcessResult Runner::run_program(const Run& run, const std::string& rendered, const std::string& wanted) const {
  std::error_code ignored;
  fs::remove(wanted, ignored);
  std::vector<std::string> environment = run.environment;
  environment.insert(environment.end(), {"COVARY_OUTPUT=" + wanted, fmt::format("COVARY_THREADS={}", threads_)});
  if (run.renders)
    environment.insert(environment.end(),
                       {"COVARY_IMAGE=" + rendered, "COVARY_FILMS=" + cache_.path("passes", run.passes_key)});
  ProcessResult result = run_process({"/bin/sh", "-c", run.program}, stop_, environment);
  if (!result.ok() || fs::exists(wanted)) return result;
  result.exit_code = 1;
  result.errors += "the program ended without writing the image that COVARY_OUTPUT names";
  return result;
}

void Runner::remove_passes(const std::string& passes_key) const {
  std::error_code ignored;
  fs::remove_all(cache_.path("passes", passes_key), ignored);
}

}  // namespace covary::lab
