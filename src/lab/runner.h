// SPDX-License-Identifier: Apache-2.0
// Runs of the program, cached on disk: existing results are not computed again, and files in the cache are always
// complete.
//
// The cache is a folder:
//     runs/KEY/image.exr, stats.json    output of the render (or of the last command after it)
//     runs/KEY/run.json                 record of the run; written last, so its presence means "done"
//     passes/KEY/                       films of unfinished runs, or kept on request
//     measures/KEY.json                 errors of images
#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/process.h"
#include "lab/plan.h"

namespace covary::lab {

/// A finished run.
struct RunRecord {
  std::string image;    ///< path of the EXR
  std::string command;  ///< as typed in a shell
  /// load: reading the scene and building the BVH; render: including training and trials; then: commands after the
  /// render. Wall clock.
  double load_seconds = 0, render_seconds = 0, estimate_seconds = 0, then_seconds = 0;
  /// Processor time of render, estimate and what follows, without loading; 0: unknown.
  double processor_seconds = 0;
  double samples_per_pixel = 0, peak_memory_bytes = 0;
  std::string messages;  ///< standard error of the run
  /// Time of the method without loading the scene.
  double method_seconds() const { return render_seconds + estimate_seconds + then_seconds; }
};

/// The object `seconds` of a run, as used in the cache and in results.
nlohmann::ordered_json seconds_of(const RunRecord& record);

/// A run that ended in an error.
struct RunFailure {
  std::string command;
  int exit_code = 0;
  std::string message;
};

class Cache {
 public:
  /// Creates the folder if needed and locks it against other experiments while this object lives; with `part`, the name
  /// of a part of an experiment, not against other parts. Throws Error(kIo).
  explicit Cache(std::string folder, const std::string& part = "");
  ~Cache();
  Cache(const Cache&) = delete;
  Cache& operator=(const Cache&) = delete;

  /// A path in the cache; creates its folder.
  std::string path(const std::string& kind, const std::string& key) const;
  /// A JSON file in the cache; nullopt if missing or damaged.
  std::optional<nlohmann::json> read_json(const std::string& kind, const std::string& key) const;
  void write_json(const std::string& kind, const std::string& key, const nlohmann::json& json) const;
  const std::string& folder() const { return folder_; }

 private:
  void lock(const std::string& name, int operation);
  std::string folder_;
  std::vector<int> locks_;
};

class Runner {
 public:
  Runner(const Cache& cache, std::string program, int threads, const std::atomic<bool>* stop)
      : cache_(cache), program_(std::move(program)), threads_(threads), stop_(stop) {}

  /// The cached record of a run.
  std::optional<RunRecord> find(const Run& run) const;
  /// Executes the run. Exactly one of the two is set, or neither if it was stopped.
  struct Result {
    std::optional<RunRecord> record;
    std::optional<RunFailure> failure;
  };
  Result execute(const Run& run, const SceneInstance& scene) const;
  /// Removes films of passes that no other run needs.
  void remove_passes(const std::string& passes_key) const;

 private:
  Result failed(const std::string& command, const ProcessResult& process) const;
  Result render(const Run& run, const SceneInstance& scene, const std::string& output) const;
  ProcessResult run_program(const Run& run, const std::string& rendered, const std::string& wanted) const;

  const Cache& cache_;
  std::string program_;
  int threads_;
  const std::atomic<bool>* stop_;
};

}  // namespace covary::lab
