// SPDX-License-Identifier: Apache-2.0
#include "lab/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/shell_text.h"
#include "risk/plain_mean.h"
#include "sequences/frame_names.h"

namespace covary::lab {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

CropWindow crop_window(const SceneInstance& scene) {
  const std::string& text = scene.entry.crop;
  if (text.empty()) return {0, 0, scene.frame_width, scene.frame_height};
  CropWindow window;
  if (const std::vector<int> c = whole_numbers(text, ','); c.size() == 4) {
    window = {c[0], c[1], c[2], c[3]};
  } else if (const std::vector<int> size = whole_numbers(text, 'x'); size.size() == 2) {
    window = {(scene.frame_width - size[0]) / 2, (scene.frame_height - size[1]) / 2, size[0], size[1]};
  } else {
    throw Error(ErrorCode::kUsage,
                fmt::format("scene '{}': crop '{}': expected X,Y,WIDTH,HEIGHT or WIDTHxHEIGHT, which "
                            "lies in the middle",
                            scene.entry.name, text));
  }
  if (window.width < 1 || window.height < 1 || window.x < 0 || window.y < 0 ||
      window.x + window.width > scene.frame_width || window.y + window.height > scene.frame_height)
    throw Error(ErrorCode::kUsage, fmt::format("scene '{}': crop '{}' does not fit into the {} x {} frame",
                                               scene.entry.name, text, scene.frame_width, scene.frame_height));
  return window;
}

std::string key_of(const std::string& kind, const PlanContext& context, const SceneInstance& scene,
                   std::initializer_list<Words> lists) {
  std::string text = kind + "\n" + context.program_version + "\n" + scene.hash + "\n";
  for (const Words& words : lists) {
    for (const std::string& word : words) text += word + "\n";
    text += "\n";
  }
  return key_text(text);
}

Words joined(std::initializer_list<Words> lists) {
  Words all;
  for (const Words& words : lists) all.insert(all.end(), words.begin(), words.end());
  return all;
}

Words flattened(const std::vector<Words>& steps) {
  Words all;
  for (const Words& step : steps) {
    all.insert(all.end(), step.begin(), step.end());
    all.emplace_back("|");
  }
  return all;
}

}  // namespace

std::string identity_of_program(const std::string& command) {
  std::string text = command;
  for (const std::string& word : words_of_shell_text(command)) {
    std::error_code ignored;
    if (!fs::is_regular_file(word, ignored)) continue;
    std::ifstream file(word, std::ios::binary);
    std::stringstream content;
    content << file.rdbuf();
    text += "\n" + hash_text(hash_bytes(content.str()));
  }
  return text;
}

std::vector<std::string> files_of(std::span<const int> frames, const std::string& path) {
  if (frames.empty() || !is_frame_pattern(path)) return Words(std::max<size_t>(1, frames.size()), path);
  Words files;
  for (const int frame : frames) files.push_back(frame_name(path, frame));
  return files;
}

std::vector<int> whole_numbers(const std::string& text, char separator) {
  std::vector<int> result;
  const char *at = text.data(), *end = at + text.size();
  for (;;) {
    int value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc() || value < 0) return {};
    result.push_back(value);
    if (next == end) return result;
    if (*next != separator) return {};
    at = next + 1;
  }
}

Words SceneInstance::options() const {
  Words words;
  for (const std::string& define : entry.defines) words.insert(words.end(), {"-D", define});
  if (!entry.resolution.empty()) words.insert(words.end(), {"--resolution", entry.resolution});
  // Always given, so that a crop in the scene file has no effect.
  words.insert(words.end(), {"--crop", fmt::format("{},{},{},{}", window.x, window.y, window.width, window.height)});
  if (!frames.empty()) words.insert(words.end(), {"--frames", entry.frames});
  if (!camera_path.empty()) words.insert(words.end(), {"--camera-path", camera_path});
  if (entry.max_depth) words.insert(words.end(), {"--max-depth", fmt::format("{}", *entry.max_depth)});
  return words;
}

SceneInstance located(const SceneEntry& entry, const std::string& folder) {
  SceneInstance scene{entry};
  scene.file = (fs::path(folder) / entry.file).string();
  if (FrameRange range; read_frame_range(entry.frames, range)) scene.frames = range.numbers();
  if (entry.camera_path.empty()) return scene;
  scene.camera_path = (fs::path(folder) / entry.camera_path).string();
  std::ifstream file(scene.camera_path);  // if it cannot be read, the render reports it
  std::stringstream text;
  text << file.rdbuf();
  scene.hash = hash_text(hash_bytes(text.str()));
  return scene;
}

Words SceneInstance::scene_files() const { return is_frame_pattern(file) ? files_of(frames, file) : Words{file}; }

void place(SceneInstance& scene, int width, int height, int64_t max_pixels) {
  const double pixels = static_cast<double>(width) * height;
  if (max_pixels > 0 && scene.entry.resolution.empty() && scene.entry.crop.empty() &&
      pixels > static_cast<double>(max_pixels)) {
    const double factor = std::sqrt(static_cast<double>(max_pixels) / pixels);
    scene.entry.resolution = fmt::format("{}x{}", std::max(1, static_cast<int>(width * factor)),
                                         std::max(1, static_cast<int>(height * factor)));
  }
  if (!scene.entry.resolution.empty()) {
    const std::vector<int> size = whole_numbers(scene.entry.resolution, 'x');
    if (size.size() != 2 || size[0] < 1 || size[1] < 1)
      throw Error(ErrorCode::kUsage, fmt::format("scene '{}': resolution '{}': expected WIDTHxHEIGHT, e.g. 1280x720",
                                                 scene.entry.name, scene.entry.resolution));
    width = size[0], height = size[1];
  }
  scene.frame_width = width, scene.frame_height = height;
  scene.window = crop_window(scene);
}

std::vector<Run> reference_runs(const Suite& suite, const SceneInstance& scene, const PlanContext& context) {
  std::vector<Run> runs;
  const uint32_t spp = suite.reference_of(scene.entry).spp;
  for (uint64_t seed : kReferenceSeeds) {
    Run run;
    run.seed = seed, run.frames = scene.frames;
    run.options =
        joined({scene.options(),
                suite.common_options,
                {"--estimator", kMeanName, "--spp", fmt::format("{}", spp), "--seed", fmt::format("{}", seed)}});
    run.work = static_cast<double>(spp) * static_cast<double>(scene.n_pixels());
    run.key = key_of("reference", context, scene, {run.options});
    run.passes_key = run.key;
    runs.push_back(std::move(run));
  }
  return runs;
}

std::vector<Run> runs_of_scene(const Suite& suite, size_t index, const SceneInstance& scene,
                               const PlanContext& context) {
  std::vector<Run> runs;
  for (uint64_t seed : suite.seeds)
    for (size_t b = 0; b < suite.budgets.size(); ++b) {
      const Budget& budget = suite.budgets[b];
      const Words amount = budget.spp ? Words{"--spp", fmt::format("{}", budget.spp)}
                                      : Words{"--time", fmt::format("{:g}", budget.seconds)};
      const Words seed_words{"--seed", fmt::format("{}", seed)};
      const auto first = static_cast<std::ptrdiff_t>(runs.size());
      for (size_t m = 0; m < suite.methods.size(); ++m) {
        const MethodEntry& method = suite.methods[m];
        Run run;
        run.scene = index, run.method = m, run.budget = b, run.seed = seed;
        run.options = joined({scene.options(), suite.common_options, method.options, amount, seed_words});
        run.then = method.then, run.frames = scene.frames;
        Words own;
        if (!method.program.empty()) {
          run.program = context.programs.at(method.program);
          run.environment = {"COVARY_SCENE=" + scene.file,
                             fmt::format("COVARY_SEED={}", seed),
                             budget.spp ? fmt::format("COVARY_SPP={}", budget.spp)
                                        : fmt::format("COVARY_SECONDS={:g}", budget.seconds),
                             fmt::format("COVARY_WIDTH={}", scene.frame_width),
                             fmt::format("COVARY_HEIGHT={}", scene.frame_height),
                             fmt::format("COVARY_CROP={},{},{},{}", scene.window.x, scene.window.y, scene.window.width,
                                         scene.window.height)};
          own = {identity_of_program(run.program), method.renders ? "" : "renders nothing"};
          run.renders = method.renders, run.samples = budget.spp;
        }
        run.work = budget.spp * static_cast<double>(scene.n_pixels());
        run.key = key_of("run", context, scene, {run.options, flattened(run.then), own});
        run.timed = budget.seconds > 0;
        // With a time budget, the samples depend on the method's speed, so passes are not shared.
        run.passes_key = budget.spp ? key_of("passes", context, scene,
                                             {scene.options(), suite.common_options, amount, seed_words,
                                              context.pass_words(method.options)})
                                    : run.key;
        runs.push_back(std::move(run));
      }
      // Makes runs that share passes adjacent, in the order of the first of them.
      for (auto at = runs.begin() + first; at != runs.end(); ++at)
        std::stable_partition(at, runs.end(), [&, key = at->passes_key](const Run& r) { return r.passes_key == key; });
    }
  return runs;
}

size_t number_of_parts(const Suite& suite, const SceneEntry& scene) {
  const size_t halves = suite.reference_of(scene).files.empty() ? std::size(kReferenceSeeds) : 0;
  return halves + suite.seeds.size() * suite.budgets.size();
}

}  // namespace covary::lab
