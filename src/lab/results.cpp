// SPDX-License-Identifier: Apache-2.0
#include "lab/results.h"

#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <thread>

#include "lab/json_values.h"

namespace covary::lab {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Estimate& e) {
  return {{"value", json_number(e.value)},
          {"standard_error", json_number(e.standard_error)},
          {"low", json_number(e.low)},
          {"high", json_number(e.high)}};
}

Json json_of(const SplitError& split) {
  Json json = json_of(split.error);
  json["squared_bias"] = json_of(split.squared_bias);
  json["variance"] = json_of(split.variance);
  return json;
}

Json json_of(const CropWindow& w) { return {w.x, w.y, w.width, w.height}; }

Json json_of(const FrameErrors& frame) {
  return {{"relmse", json_number(frame.relmse)},
          {"temporal", json_number(frame.temporal)},
          {"temporal_flip", json_number(frame.temporal_flip)},
          {"still_relmse", json_number(frame.still_relmse)}};
}

/// A cell's results per frame.
Json frames_of(const Cell& cell, const std::vector<int>& numbers) {
  Json frames = Json::array();
  for (size_t f = 0; f < cell.frames.size(); ++f) {
    frames.push_back({{"frame", numbers[f]}});
    frames.back().update(json_of(cell.frames[f]));
  }
  Json json{{"temporal", json_of(cell.temporal)},
            {"temporal_flip", json_of(cell.temporal_flip)},
            {"temporal_gain", json_of(cell.temporal_gain)},
            {"frames", frames}};
  if (!cell.worst) return json;
  for (const auto& [name, region] : {std::pair{"relmse", &cell.worst->relmse},
                                     {"relmse_of_frame", &cell.worst->relmse_of_frame},
                                     {"temporal", &cell.worst->temporal},
                                     {"temporal_of_frame", &cell.worst->temporal_of_frame}})
    json["worst_region"][name] = json_number(region->ratio);
  return json;
}

Json json_of(const RunResult& run) {
  const RunRecord& r = run.record;
  return {{"seed", run.seed},
          {"relmse", json_number(run.relmse)},
          {"relmse_trimmed", json_number(run.relmse_trimmed)},
          {"mse", json_number(run.mse)},
          {"mae", json_number(run.mae)},
          {"flip", json_number(run.flip)},
          {"above5", json_number(run.above5)},
          {"mean_ratio", json_number(run.mean_ratio)},
          {"predicted_relmse", json_number(run.predicted_relmse)},
          {"predicted_relmse_low", json_number(run.predicted_low)},
          {"predicted_relmse_high", json_number(run.predicted_high)},
          {"coverage", json_number(run.coverage)},
          {"temporal", json_number(run.temporal)},
          {"temporal_flip", json_number(run.temporal_flip)},
          {"samples_per_pixel", r.samples_per_pixel},
          {"seconds", seconds_of(r)},
          {"peak_memory_bytes", r.peak_memory_bytes},
          {"command", r.command},
          {"image", r.image}};
}

Json json_of(const Cell& cell, const Results& results) {
  const Suite& suite = results.suite;
  Json mae = json_of(cell.mae), flip = json_of(cell.flip), seeds = Json::array(), runs = Json::array();
  mae["of_mean"] = json_number(cell.mae_of_mean);
  flip["of_mean"] = json_number(cell.flip_of_mean);
  for (const RunResult& run : cell.runs) {
    seeds.push_back(run.seed);
    runs.push_back(json_of(run));
  }
  Json json{
      {"scene", suite.scenes[cell.scene].name},
      {"method", suite.methods[cell.method].name},
      {"budget", json_of(suite.budgets[cell.budget])},
      {"seeds", seeds},
      {"samples_per_pixel", cell.samples_per_pixel},
      {"pixels", cell.split.n_pixels},
      {"non_finite_pixels", cell.split.n_non_finite},
      {"relmse", json_of(cell.split.relative)},
      {"relmse_trimmed", json_of(cell.relmse_trimmed)},
      {"mse", json_of(cell.split.absolute)},
      {"mae", mae},
      {"flip", flip},
      {"above5", json_of(cell.above5)},
      {"mean_ratio", json_of(cell.split.mean_ratio)},
      {"equal_sample", json_of(cell.equal_sample)},
      {"equal_sample_normalised", cell.equal_sample_normalised},
      {"equal_time", json_of(cell.equal_time)},
      {"equal_processor_time", json_of(cell.equal_processor_time)},
      {"seconds",
       {{"load", json_of(cell.load_seconds)},
        {"render", json_of(cell.render_seconds)},
        {"estimate", json_of(cell.estimate_seconds)},
        {"then", json_of(cell.then_seconds)},
        {"method", json_of(cell.method_seconds)},
        {"processor", json_of(cell.processor_seconds)},
        {"over_budget", json_number(cell.time_ratio)}}},
      {"efficiency", json_of(cell.efficiency)},
      {"predicted_over_true", json_of(cell.predicted_over_true)},
      {"coverage", json_of(cell.coverage)},
      {"bounded", json_number(cell.bounded)},
      {"bounds_hold", json_number(cell.bounds_hold)},
      {"published", {{"relmse", json_number(cell.published_relmse)}, {"ratio", json_number(cell.published_ratio)}}},
      {"peak_memory_bytes", cell.peak_memory_bytes},
      {"warnings", cell.suspicions},
      {"runs", runs}};
  if (!cell.frames.empty()) json.update(frames_of(cell, results.scenes[cell.scene].scene.frames));
  return json;
}

Json json_of(const SceneResult& result) {
  const SceneInstance& scene = result.scene;
  const Reference& reference = result.reference;
  return {{"name", scene.entry.name},
          {"file", scene.file},
          {"hash", scene.hash},
          {"frame", {scene.frame_width, scene.frame_height}},
          {"window", json_of(scene.window)},
          {"credit", scene.entry.credit},
          {"reference",
           {{"files", reference.files},
            {"origin", reference.origin},
            {"spp", reference.spp},
            {"seconds", reference.seconds},
            {"relmse", json_number(reference.relmse)}}}};
}

/// The first value of a key in a file of "key : value" lines; "" if there is none.
std::string fact(const char* path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(key)) {
      const size_t value = line.find_first_not_of(" \t", line.find_first_of(":=") + 1);
      std::string text = value == std::string::npos ? "" : line.substr(value);
      std::erase(text, '"');
      return text;
    }
  return "";
}

}  // namespace

std::vector<std::string> SceneResult::reference_files() const {
  std::vector<std::string> all;
  for (const std::string& file : reference.files)
    for (const std::string& of_frame : files_of(scene.frames, file))
      if (std::find(all.begin(), all.end(), of_frame) == all.end()) all.push_back(of_frame);
  return all;
}

const Cell* Results::find(size_t scene, size_t method, size_t budget) const {
  for (const Cell& cell : cells)
    if (cell.scene == scene && cell.method == method && cell.budget == budget) return &cell;
  return nullptr;
}

Json to_json(const Results& results) {
  const Suite& suite = results.suite;
  Json json{{"format", fmt::format("{} 1", kResultsFormat)},
            {"complete", results.complete},
            {"version", results.version},
            {"command", results.command},
            {"date", results.date},
            {"machine", results.machine},
            {"suite", to_json(suite)}};
  for (const char* list : {"scenes", "cells", "slopes", "summary", "failures"}) json[list] = Json::array();
  for (const SceneResult& scene : results.scenes) json["scenes"].push_back(json_of(scene));
  for (const Cell& cell : results.cells) json["cells"].push_back(json_of(cell, results));
  for (const Slope& slope : results.slopes)
    json["slopes"].push_back({{"scene", suite.scenes[slope.scene].name},
                              {"method", suite.methods[slope.method].name},
                              {"relmse", json_of(slope.exponent)}});
  for (const Summary& s : results.summaries) {
    Json unusable = Json::array();
    for (size_t scene : s.unusable) unusable.push_back(suite.scenes[scene].name);
    json["summary"].push_back({{"method", suite.methods[s.method].name},
                               {"budget", json_of(suite.budgets[s.budget])},
                               {"scenes", s.n_scenes},
                               {"samples_per_pixel", json_number(s.samples_per_pixel)},
                               {"relmse", json_number(s.relmse)},
                               {"equal_sample", json_of(s.equal_sample)},
                               {"equal_sample_normalised", s.equal_sample_normalised},
                               {"equal_time", json_of(s.equal_time)},
                               {"published_ratio", json_number(s.published_ratio)},
                               {"unusable", unusable}});
  }
  for (const Failure& f : results.failures)
    json["failures"].push_back({{"scene", f.scene},
                                {"method", f.method},
                                {"budget", f.budget},
                                {"command", f.command},
                                {"exit_code", f.exit_code},
                                {"message", f.message},
                                {"runs_not_tried", f.not_tried}});
  json["warnings"] = results.warnings;
  return json;
}

Json machine_facts() {
  utsname system{};
  uname(&system);
  const double memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  return {{"processor", fact("/proc/cpuinfo", "model name")},
          {"cores", std::thread::hardware_concurrency()},
          {"memory_bytes", memory},
          {"system", fact("/etc/os-release", "PRETTY_NAME")},
          {"kernel", fmt::format("{} {}", system.sysname, system.release)}};
}

}  // namespace covary::lab
