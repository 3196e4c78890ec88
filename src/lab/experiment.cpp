// SPDX-License-Identifier: Apache-2.0
#include "lab/experiment.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/process.h"
#include "core/stop.h"
#include "core/stopwatch.h"
#include "core/unfinished.h"
#include "film/image_file.h"
#include "film/outputs.h"
#include "lab/measure.h"
#include "lab/run_clock.h"
#include "lab/runner.h"
#include "lab/scene_images.h"
#include "metrics/provenance.h"

namespace covary::lab {
namespace {

namespace fs = std::filesystem;

/// "3-of-8", or "" for the whole.
std::string part_name(const Part& part) {
  return part.of == 0 ? "" : fmt::format("{}-of-{}", part.number + 1, part.of);
}

/// Whether the program reported an error, rather than being ended by a signal or an internal error.
bool says_why(const RunFailure& failure) {
  return (failure.exit_code == 1 || failure.exit_code == 2) &&
         failure.message.find("internal error") == std::string::npos;
}

class Experiment {
 public:
  Experiment(const Suite& suite, const ExperimentOptions& options)
      : options_(options),
        reader_(options.reader ? options.reader : std::make_shared<SceneReader>(options.program, options.stop)),
        cache_(options.cache_folder, part_name(options.part)),
        runner_(cache_, options.program, options.threads, options.stop),
        clock_(options.expected_seconds) {
    results_.suite = suite;
  }

  Results run() {
    const size_t n = results_.suite.scenes.size();
    for (size_t s = 0; s < n && !stopped(); ++s) look_at(s);
    while (results_.scenes.size() < n)
      results_.scenes.push_back({SceneInstance{results_.suite.scenes[results_.scenes.size()]}, {}});
    plan();
    for (size_t s = 0; s < n && !stopped(); ++s)
      if (usable_[s] && make_reference(s)) make_runs(s);
    throw_if_interrupted();
    if (options_.part.of > 0) return std::move(results_);
    run_stoppable(options_.stop, [this, n] {
      for (size_t s = 0; s < n && !stopped(); ++s)
        if (usable_[s]) measure_scene(s);
      compare_cells(results_);
    });
    throw_if_interrupted();
    collect_warnings();
    warn_of_noisy_references();
    results_.complete = results_.failures.empty();
    return std::move(results_);
  }

 private:
  bool stopped() const { return options_.stop && options_.stop->load(); }
  void throw_if_interrupted() const {
    if (stopped())
      throw Unfinished(kInterrupted,
                       fmt::format("interrupted after {} of {} runs; the same command continues", done_, total_));
  }

  void report(Progress::Kind kind, const std::string& what) {
    if (options_.progress) options_.progress({done_, total_, clock_.seconds_left(), what, kind});
  }

  void look_at(size_t index) {
    const std::string& name = results_.suite.scenes[index].name;
    report(Progress::Kind::kStarted, name + ", reading");
    ScenePlan plan =
        plan_scene(results_.suite, index, options_.scenes_folder, options_.max_pixels, options_.context, *reader_);
    usable_.push_back(!plan.failure);
    results_.scenes.push_back({std::move(plan.scene), {}});
    references_.push_back(std::move(plan.references));
    runs_.push_back(std::move(plan.runs));
    if (plan.failure && !stopped()) fail(std::move(*plan.failure));
  }

  void plan() {
    usable_.resize(results_.scenes.size(), false);
    runs_.resize(results_.scenes.size());
    references_.resize(results_.scenes.size());
    for (size_t s = 0; s < results_.scenes.size(); ++s) {
      if (!usable_[s]) continue;
      if (options_.part.of > 0) keep_part(s);
      for (const std::vector<Run>* runs : {&references_[s], &runs_[s]})
        for (const Run& run : *runs) ++total_, clock_.add_planned(run.work);
    }
  }

  /// Keeps only the part's runs of the scene. Runs that share passes have the same seed and budget.
  void keep_part(size_t s) {
    const auto is_own = [this] { return piece_++ % options_.part.of == options_.part.number; };
    std::erase_if(references_[s], [&](const Run&) { return !is_own(); });
    const auto cell = [](const Run& run) { return std::pair(run.seed, run.budget); };
    std::map<std::pair<uint64_t, size_t>, bool> own;
    for (const Run& run : runs_[s])
      if (!own.contains(cell(run))) own[cell(run)] = is_own();
    std::erase_if(runs_[s], [&](const Run& run) { return !own[cell(run)]; });
  }

  /// The run's result, from the cache or a new run.
  std::optional<RunRecord> obtain(const Run& run, const std::string& what, RunFailure* failure) {
    std::optional<RunRecord> record = runner_.find(run);
    if (!record) {
      report(Progress::Kind::kStarted, what);
      const Stopwatch watch;
      Runner::Result result = runner_.execute(run, results_.scenes[run.scene].scene);
      clock_.took(run.work, watch.seconds());
      if (result.failure) *failure = *result.failure;
      record = result.record;
      if (!result.record && !result.failure) return record;  // stopped
    }
    ++done_, clock_.remove_planned(run.work);
    return record;
  }

  bool make_reference(size_t s) {
    SceneResult& scene = results_.scenes[s];
    const ReferencePlan& plan = results_.suite.reference_of(scene.scene.entry);
    scene.reference.spp = plan.spp;
    if (!plan.files.empty()) {
      scene.reference.origin = "given";
      for (const std::string& file : plan.files)
        scene.reference.files.push_back(
            fs::path(file).is_absolute() ? file : (fs::path(options_.scenes_folder) / file).string());
      return true;
    }
    for (Run& run : references_[s]) {
      run.scene = s;
      RunFailure failure;
      const auto record =
          obtain(run, fmt::format("{}, reference, seed {}", scene.scene.entry.name, run.seed), &failure);
      if (!record) {
        usable_[s] = false;
        if (!stopped())
          fail({scene.scene.entry.name, "reference", "", failure.command, failure.message, failure.exit_code,
                runs_[s].size()});
        return false;
      }
      runner_.remove_passes(run.passes_key);
      scene.reference.files.push_back(record->image);
      scene.reference.seconds += record->render_seconds;
      scene.reference.origin += (scene.reference.origin.empty() ? "" : "; ") + record->command;
    }
    return true;
  }

  void make_runs(size_t s) {
    const Suite& suite = results_.suite;
    const std::string& name = suite.scenes[s].name;
    std::map<std::pair<size_t, size_t>, size_t> failed_cells;  // method, budget -> index into failures
    std::set<size_t> left_out;                                 // optional methods
    const std::vector<Run>& runs = runs_[s];
    for (size_t i = 0; i < runs.size() && !stopped(); ++i) {
      const Run& run = runs[i];
      const std::pair cell{run.method, run.budget};
      if (left_out.contains(run.method)) {
        ++done_, clock_.remove_planned(run.work);
      } else if (const auto failed = failed_cells.find(cell); failed != failed_cells.end()) {
        ++results_.failures[failed->second].not_tried;
        ++done_, clock_.remove_planned(run.work);
      } else {
        const std::string &method = suite.methods[run.method].name, budget = suite.budgets[run.budget].label();
        RunFailure failure;
        const auto record = obtain(run, fmt::format("{}, {}, {}, seed {}", name, method, budget, run.seed), &failure);
        if (record) {
          records_[run.key] = *record;
        } else if (!stopped() && suite.methods[run.method].optional && says_why(failure)) {
          left_out.insert(run.method);
          results_.warnings.push_back(
              fmt::format("{}: the method '{}' is left out: {}", name, method, complaint(failure.message)));
        } else if (!stopped()) {
          failed_cells[cell] = results_.failures.size();
          fail({name, method, budget, failure.command, failure.message, failure.exit_code, 0});
        }
      }
      const bool last_of_passes = i + 1 == runs.size() || runs[i + 1].passes_key != run.passes_key;
      if (last_of_passes && !stopped() && !options_.keep_passes) runner_.remove_passes(run.passes_key);
    }
  }

  void measure_scene(size_t s) {
    SceneResult& scene = results_.scenes[s];
    if (scene.reference.files.empty()) return;
    SceneReferences references;
    try {
      references = read_references(scene.reference.files, scene.scene);
      check_seeds(scene);
      warn_of_given_images(s);
    } catch (const std::exception& error) {
      fail({scene.scene.entry.name, "reference", "", "", error.what(), 1, 0});
      return;
    }
    const std::string reference_key = reference_identity(s);
    for (size_t m = 0; m < results_.suite.methods.size(); ++m)
      for (size_t b = 0; b < results_.suite.budgets.size(); ++b) {
        Cell cell{s, m, b};
        std::vector<std::string> keys;
        for (const Run& run : runs_[s])
          if (const auto record = records_.find(run.key);
              run.method == m && run.budget == b && record != records_.end()) {
            cell.runs.push_back({run.seed, record->second});
            keys.push_back(run.key);
          }
        if (cell.runs.empty()) continue;
        const MethodEntry& method = results_.suite.methods[m];
        const Budget& budget = results_.suite.budgets[b];
        try {
          measure(cell, scene.scene, references, method.unbiased, budget, cache_, keys, reference_key);
          scene.reference.relmse = cell.split.n_references == 2 ? cell.split.reference_error : kNone;
          results_.cells.push_back(std::move(cell));
        } catch (const std::exception& error) {
          fail({scene.scene.entry.name, method.name, budget.label(), "", error.what(), 1, 0});
        }
      }
  }

  /// What errors of images depend on, apart from the image.
  std::string reference_identity(size_t s) const {
    const SceneResult& scene = results_.scenes[s];
    std::string text = options_.context.program_version;
    for (const Run& run : references_[s]) text += "\n" + run.key;
    if (references_[s].empty())
      for (const std::string& file : scene.reference_files())
        text += fmt::format("\n{} {} {}", fs::absolute(file).string(), fs::file_size(file),
                            fs::last_write_time(file).time_since_epoch().count());
    return text;
  }

  /// Warns if attributes of references, or of a method's images, that were given make errors doubtful.
  void warn_of_given_images(size_t s) {
    const SceneResult& scene = results_.scenes[s];
    std::vector<ImageFacts> references;
    const std::vector<int>& frames = scene.scene.frames;
    for (const std::string& file : scene.reference.files)
      references.push_back(read_facts(files_of(frames, file).front()));
    std::vector<std::string> found;
    const auto add = [&](const ImageFacts& image, const ImageFacts& reference) {
      for (const std::string& text : comparison_warnings(image, reference))
        found.push_back(scene.scene.entry.name + ": " + text);
    };
    if (references_[s].empty() && references.size() == 2) add(references[0], references[1]);
    std::set<size_t> seen;  // methods: all runs of one have the same warnings
    for (const Run& run : runs_[s])
      if (const auto record = records_.find(run.key);
          record != records_.end() && (references_[s].empty() || !results_.suite.methods[run.method].renders) &&
          seen.insert(run.method).second)
        for (const ImageFacts& reference : references)
          add(read_facts(files_of(frames, record->second.image).front(),
                         "renders of " + results_.suite.methods[run.method].name),
              reference);
    results_.warnings.insert(results_.warnings.end(), found.begin(), found.end());
  }

  /// References given as files whose seeds are known must not share one with a run or with each other.
  void check_seeds(const SceneResult& scene) {
    if (scene.reference.files.size() == 2 && is_same_file(scene.reference.files[0], scene.reference.files[1]))
      throw Error(ErrorCode::kInput,
                  fmt::format("{} is given as both halves of the reference, which must be independent",
                              scene.reference.files[0]));
    std::set<std::string> used;
    for (uint64_t seed : results_.suite.seeds) used.insert(fmt::format("{}", seed));
    for (const std::string& file : scene.reference_files()) {
      const auto attributes = inspect_image(file).attributes;
      const auto seeds = attributes.find("covary:seed");
      if (seeds == attributes.end()) continue;
      for (size_t begin = 0; begin <= seeds->second.size();) {
        const size_t end = std::min(seeds->second.find(',', begin), seeds->second.size());
        const std::string seed = seeds->second.substr(begin, end - begin);
        if (!used.insert(seed).second)
          throw Error(ErrorCode::kInput,
                      fmt::format("{}: the seed {} is also that of a run or of the other reference; they "
                                  "share samples, and no error can be measured",
                                  file, seed));
        begin = end + 1;
      }
    }
  }

  std::string name_of(const Cell& cell) const {
    const Suite& suite = results_.suite;
    return fmt::format("{}, {}, {}", suite.scenes[cell.scene].name, suite.methods[cell.method].name,
                       suite.budgets[cell.budget].label());
  }

  /// Once a method's image mean is off, its other cells need not be as certain: all whose 95 % intervals lie on the
  /// same side are named with the first.
  void warn_of_like_means(const Cell& first) {
    std::vector<std::string> others;
    for (const Cell& cell : results_.cells) {
      const Estimate& mean = cell.split.mean_ratio;
      if (cell.method != first.method || &cell == &first) continue;
      if (is_mean_off(cell.split) && &cell < &first) return;  // told with that one
      if (!is_mean_off(cell.split) && (first.split.mean_ratio.value > 1 ? mean.low > 1 : mean.high < 1))
        others.push_back(fmt::format("{} ({:+.2f} %)", name_of(cell), 100 * (mean.value - 1)));
    }
    if (!others.empty())
      results_.warnings.push_back(fmt::format("{}: the image means of {} are off, too, although less certainly",
                                              results_.suite.methods[first.method].name, fmt::join(others, "; ")));
  }

  void collect_warnings() {
    for (const Cell& cell : results_.cells) {
      const std::string where = name_of(cell) + ": ";
      if (cell.split.n_non_finite > 0)
        results_.warnings.push_back(fmt::format(
            "{}{} pixels ({:.2g} % of all) are not finite in a run or reference and left out of its errors, "
            "which may therefore be too small",
            where, cell.split.n_non_finite,
            100.0 * static_cast<double>(cell.split.n_non_finite) /
                static_cast<double>(cell.split.n_non_finite + cell.split.n_pixels)));
      for (const std::string& text : cell.suspicions) results_.warnings.push_back(where + text);
      if (is_mean_off(cell.split)) warn_of_like_means(cell);
      if (std::abs(cell.time_ratio - 1) > 0.1)
        results_.warnings.push_back(fmt::format("{}took {:.3g} s, {:+.0f} % off the budget", where,
                                                cell.method_seconds.value, 100 * (cell.time_ratio - 1)));
    }
  }

  /// One warning per scene, for the method with the smallest error, if the references' noise makes that uncertain.
  void warn_of_noisy_references() {
    for (size_t s = 0; s < results_.scenes.size(); ++s) {
      const Cell* best = nullptr;
      for (const Cell& cell : results_.cells)
        if (cell.scene == s && (!best || cell.split.relative.error.value < best->split.relative.error.value))
          best = &cell;
      if (!best || best->split.reference_noise <= kMaxReferenceNoise * std::abs(best->split.relative.error.value))
        continue;
      results_.warnings.push_back(
          fmt::format("{}: the noise of the references makes the error of the best method, {:.2g}, uncertain by "
                      "±{:.2g}; references with more samples would tell more",
                      results_.suite.scenes[s].name, best->split.relative.error.value, best->split.reference_noise));
    }
  }

  void fail(Failure failure) {
    while (!failure.message.empty() && failure.message.back() == '\n') failure.message.pop_back();
    report(Progress::Kind::kFailed,
           fmt::format("{}{}{}: {}", failure.scene, failure.method.empty() ? "" : ", " + failure.method,
                       failure.budget.empty() ? "" : ", " + failure.budget, telling_line(failure.message)));
    results_.failures.push_back(std::move(failure));
  }

  const ExperimentOptions& options_;
  std::shared_ptr<SceneReader> reader_;
  Cache cache_;
  Runner runner_;
  Results results_;
  std::vector<bool> usable_;                         // per scene
  std::vector<std::vector<Run>> runs_, references_;  // per scene
  std::map<std::string, RunRecord> records_;         // by key
  RunClock clock_;
  size_t done_ = 0, total_ = 0;
  size_t piece_ = 0;  // index of the next unit of work to divide among parts, over all scenes
};

}  // namespace

Results run_experiment(const Suite& suite, const ExperimentOptions& options) {
  throw_if_invalid(suite);
  return Experiment(suite, options).run();
}

}  // namespace covary::lab
