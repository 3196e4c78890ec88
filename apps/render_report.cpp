// SPDX-License-Identifier: Apache-2.0
#include "render_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "commands.h"
#include "core/shell_text.h"
#include "film/splat_layer.h"
#include "json_output.h"
#include "passes/light_pass.h"
#include "passes/training.h"
#include "phase_times.h"
#include "plans/budget.h"
#include "plans/integrator_trial.h"
#include "plans/memory.h"
#include "risk_report.h"
#include "settings/option_names.h"

namespace covary {
namespace {

/// Command that replays one sample of a pass: the user's own, with the sample instead of the outputs.
std::string replay_command(const RenderOptions& o, const Pass& pass, const BadSample& bad) {
  std::vector<std::string> words = {"covary", "render", o.scene};
  for (std::string& word : scene_words(o.scene_options)) words.push_back(std::move(word));
  OptionValues given = o.values;
  given.insert(o.of_integrator.begin(), o.of_integrator.end());
  const int frame = o.sequence.is_sequence() ? o.sequence.frames->first : 0;
  for (const std::string& word : replay_words(std::move(given), pass, bad, SequenceSettings::seed_offset(frame)))
    words.push_back(word);
  if (o.sequence.is_sequence()) {
    words.insert(words.end(), {"--frames", std::to_string(frame)});
    if (!o.sequence.camera_path.empty()) words.insert(words.end(), {"--camera-path", o.sequence.camera_path});
  }
  return shell_text(words);
}

nlohmann::ordered_json json_of(const IntegratorReport& report) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [name, number] : report.numbers) std::visit([&](const auto& value) { json[name] = value; }, number);
  return json;
}

/// Samples per pixel of the training; 0 without one, or if it was loaded from a file.
uint32_t training_samples_taken(const RenderReport& report) {
  const LearningIntegrator* learning = report.result.integrator->learning();
  return learning && report.options.request().load_training.empty() ? learning->trained_spp() : 0;
}

}  // namespace

void report_bad_samples(const RenderOptions& options, const Pass& pass) {
  const PassResult& result = pass.result;
  if (result.bad_samples.empty()) return;
  const bool light = pass.plan.light;
  fmt::print(stderr, "warning: {} {} were not finite and {} negative; they count as black. The first:\n",
             result.n_not_finite, light ? "splats of light paths" : "samples", result.n_negative);
  for (const BadSample& bad : result.bad_samples)
    fmt::print(stderr, "  pixel ({}, {}), {} {}: ({}, {}, {})\n    {}\n", bad.x, bad.y, light ? "light path" : "sample",
               bad.sample, bad.value.r, bad.value.g, bad.value.b, replay_command(options, pass, bad));
}

namespace {

nlohmann::ordered_json statistics_of(const Pass& pass) {
  nlohmann::ordered_json json = {{"sampling", sampling_name(pass.settings.sampling)},
                                 {"sampler", sampler_name(pass.settings.sampler)}};
  if (pass.plan.light)
    json["light_paths"] = light_paths(pass.film);
  else
    json["samples_per_pixel"] = pass.film.mean_count();
  json["groups"] = pass.film.groups();
  json["samples"] = pass.result.n_samples;
  json["rays"] = pass.result.n_rays;
  json["seconds"] = pass.result.seconds;
  return json;
}

/// What only applies to some renders.
void add_results(const RenderReport& report, const Method& estimator, nlohmann::ordered_json& json) {
  const RenderResult& result = report.result;
  for (const IntegratorTrial& trial : result.trials) {
    nlohmann::ordered_json found = {{"integrator", trial.integrator}};
    if (trial.left_out.empty())
      found["relative_variance"] = trial.variance, found["rays_per_sample"] = trial.rays;
    else
      found["left_out"] = trial.left_out;
    json["integrator_trial"]["tried"].push_back(found);
  }
  if (!result.chosen.empty()) json["integrator_trial"]["chosen"] = result.chosen;
  if (const IntegratorReport of = result.integrator->report(); !of.name.empty()) json[of.name] = json_of(of);
  if (const Pass* light = light_pass(result.passes)) json["light_paths"] = light_paths(light->film);
  if (result.predicted) {
    add_prediction(*result.predicted, json);
    json["predicted_relmse_p95"] = result.predicted_blocks;
  }
  add_risks(result.image.risks, json);
  add_error_sums(result.image.risk_sums, json);
  add_network(estimator.network, result.image.network_runs, report.options.settings.denoising, json);
  if (!result.image.note.empty()) json["note"] = result.image.note;
  if (result.until_reached) json["until_reached"] = *result.until_reached;
  if (result.of_time) json["time_choice"] = result.of_time->text();
}

}  // namespace

nlohmann::ordered_json statistics(const RenderReport& report) {
  const auto& [options, scene, result, load_seconds, threads, last_phase] = report;
  const RenderRequest request = make_request(options, scene);
  const Method estimator = estimator_of(options);
  const CropWindow window = window_of(scene, request);
  const double samples = result.camera_sum([](const Pass& p) { return p.result.n_samples; });
  const double rays = result.sum([](const Pass& p) { return p.result.n_rays; });
  const double rate = 1 / std::max(result.render_seconds(), 1e-9);
  nlohmann::ordered_json passes = nlohmann::json::array(), bad = nlohmann::json::array();
  for (const Pass& pass : result.passes) {
    passes.push_back(statistics_of(pass));
    for (const BadSample& b : pass.result.bad_samples)
      bad.push_back({{"x", b.x},
                     {"y", b.y},
                     {pass.plan.light ? "light_path" : "sample", b.sample},
                     {"replay", replay_command(options, pass, b)}});
  }
  nlohmann::ordered_json json = {
      {"version", COVARY_VERSION},
      {"command", command_line()},
      {"output", request.output},
      {"scene", options.scene},
      {"scene_hash", scene.content_hash},
      {"width", window.width},
      {"height", window.height},
      {"estimator", estimator.text},
      {"samples_per_pixel", result.samples_per_pixel()},
      {"training_samples_per_pixel", training_samples_taken(report)},
      {"training_counts_as_samples", (result.training.samples[0] + result.training.samples[1]) / 2},
      {"seed", request.seed},
      {"threads", threads},
      {"complete", result.complete},
      {"interrupted", result.interrupted},
      {"passes", passes},
      {"seconds", json_of(phase_times(report), result, load_seconds)},
      {"samples", samples},
      {"rays", rays},
      {"samples_per_second", samples * rate},
      {"rays_per_second", rays * rate},
      {"triangles", scene.scene->n_triangles()},
      {"planned_memory_bytes", render_memory(scene, make_plan(options), request).total()},
      {"peak_memory_bytes", peak_memory_bytes()},
      {"negative_pixels", count_negative_pixels(result.picture())},
      {"not_finite_samples", result.sum([](const Pass& p) { return p.result.n_not_finite; })},
      {"negative_samples", result.sum([](const Pass& p) { return p.result.n_negative; })},
      {"bad_samples", bad}};
  add_results(report, estimator, json);
  return json;
}

}  // namespace covary
