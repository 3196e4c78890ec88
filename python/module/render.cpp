// SPDX-License-Identifier: Apache-2.0
#include "plans/render.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <mutex>
#include <optional>
#include <span>
#include <utility>

#include "combine/combine.h"
#include "combine/registry.h"
#include "core/stopwatch.h"
#include "plans/integrator_choice.h"
#include "plans/made_of.h"
#include "plans/render_settings.h"
#include "plans/result_files.h"
#include "python/module/arrays.h"
#include "python/module/bindings.h"
#include "python/module/live.h"
#include "python/module/work.h"
#include "risk/predicted_error.h"
#include "settings/option_names.h"

namespace covary::python {
namespace {

using Options = std::map<std::string, std::string>;

/// The value of an option as text.
std::string option_text(const std::string& name, nb::handle value) {
  if (nb::isinstance<nb::bool_>(value)) return nb::cast<bool>(value) ? "on" : "off";
  if (nb::isinstance<nb::str>(value) || nb::isinstance<nb::int_>(value) || nb::isinstance<nb::float_>(value))
    return nb::cast<std::string>(nb::str(value));
  throw nb::type_error(("integrator_options['" + name + "']: expected a bool, int, float or str").c_str());
}

struct SceneChoice {
  Options defines;
  std::optional<std::pair<int, int>> resolution;
  std::string integrator;
  std::optional<int> min_depth, max_depth;
  Options view;  ///< of SceneView
  bool ignore_unknown = false;
};

std::shared_ptr<LoadedScene> load(const std::string& path, const SceneChoice& choice, nb::dict integrator_options) {
  LoadOptions options;
  options.defines = choice.defines;
  options.ignore_unknown = choice.ignore_unknown;
  if (choice.resolution) {
    options.width = choice.resolution->first, options.height = choice.resolution->second;
  }
  if (!choice.integrator.empty() && !find_integrator(choice.integrator))
    throw Error(ErrorCode::kUsage, "integrator: " + unknown_integrator(choice.integrator));
  IntegratorChoice integrator;
  integrator.name = choice.integrator;
  for (const auto& [key, value] : integrator_options) {
    const std::string name = nb::cast<std::string>(key);
    integrator.options[dashed(name)] = option_text(name, value);
  }
  if (choice.min_depth) integrator.options["min-depth"] = std::to_string(*choice.min_depth);
  if (choice.max_depth) integrator.options["max-depth"] = std::to_string(*choice.max_depth);
  options.make_integrator = integrator_maker(integrator);
  options.view = settings_from<SceneView>(choice.view, RenderSettings().view);
  auto scene = std::make_shared<LoadedScene>();
  run_work([&](WorkState& state) { run_stoppable(state, [&] { *scene = load_scene(path, options); }); }, nb::none());
  return scene;
}

/// The request to render().
struct Choice {
  Options values, of_estimator;  ///< as the command line has them
  bool films_only = false;       ///< no image is made of the films
};

Plan plan_of(const RenderSettings& settings, const Choice& choice) {
  if (choice.films_only && settings.request.splits_layers())
    throw Error(ErrorCode::kUsage, "layers: films_only=True makes no image that they would be parts of");
  const Plan plan = render_plan(settings, choice.of_estimator);
  check_given(choice.values, settings, *plan.method);
  return plan;
}

/// Adds the first samples of a pass that count as black, with the commands that replay them.
void add_bad_samples(const Pass& pass, const Options& given, nb::list& list) {
  for (const BadSample& bad : pass.result.bad_samples) {
    nb::dict d;
    d["film"] = pass.plan.id();
    d["x"] = bad.x, d["y"] = bad.y, d["sample"] = bad.sample;
    d["value"] = nb::make_tuple(bad.value.r, bad.value.g, bad.value.b);
    d["light_path"] = pass.plan.light;
    d["replay"] = replay_words(given, pass, bad);
    list.append(d);
  }
}

nb::dict dict_of(RenderResult&& result, const std::string& estimator, const std::vector<std::string>& warnings,
                 const Options& given) {
  nb::dict films, aovs, d;
  d["estimator"] = estimator;
  Image picture = result.passes.empty() ? Image() : result.picture();
  d["samples_per_pixel"] = result.samples_per_pixel();
  d["render_seconds"] = result.render_seconds();
  d["estimate_seconds"] = result.estimate_seconds();
  nb::list bad;
  for (const Pass& pass : result.passes) add_bad_samples(pass, given, bad);
  d["bad_samples"] = bad;
  d["not_finite_samples"] = static_cast<uint64_t>(result.sum([](const Pass& p) { return p.result.n_not_finite; }));
  d["negative_samples"] = static_cast<uint64_t>(result.sum([](const Pass& p) { return p.result.n_negative; }));
  for (Pass& pass : result.passes) films[pass.plan.id().c_str()] = nb::cast(std::move(pass.film));
  for (auto& [name, image] : result.aovs) aovs[name.c_str()] = array_of(std::move(image));
  d["image"] = array_of(std::move(picture));
  d["std_error"] = array_of(std::move(result.image.std_error));
  d["bias"] = array_of(std::move(result.image.bias));
  add_prediction(result.predicted, result.image.note, d);
  d["predicted_relmse_p95"] = result.predicted ? nb::cast(result.predicted_blocks) : nb::none();
  d["nonfinite_pixels"] = result.image.nonfinite_pixels;
  d["warnings"] = warnings;
  d["films"] = films;
  d["aovs"] = aovs;
  d["complete"] = result.complete;
  d["until_reached"] = result.until_reached;
  d["time_choice"] = result.of_time ? nb::cast(result.of_time->text()) : nb::none();
  add_risks(result.image, d);
  return d;
}

/// What the caller sees of a render that runs.
struct Watching {
  nb::object progress;  ///< function of done and total, or None
  Page* page = nullptr;
  nb::object step;  ///< of Steps
};

nb::dict render_scene(const LoadedScene& scene, const Choice& choice, const Options& of_integrator, int threads,
                      const Watching& watching) {
  const RenderSettings settings = settings_from<RenderSettings>(choice.values);
  const Plan plan = plan_of(settings, choice);
  RenderRequest request = request_of(settings, scene);
  request.films_only = choice.films_only;
  request.attributes[film_key::kVersion] = COVARY_VERSION;
  request.attributes[film_key::kMadeOf] =
      made_of(scene.content_hash, {choice.values, of_integrator, choice.of_estimator});
  if (request.load_training.empty()) take_training(scene, request);
  std::vector<std::string> warnings(scene.warnings);
  if (const std::string text = advice(settings, *plan.method, scene); !text.empty() && !choice.films_only)
    warnings.push_back(as_arguments(text));
  std::mutex mutex;
  RenderResult result;
  Steps steps(watching.step);
  const auto progress = [&](uint64_t done, uint64_t total, const std::string& phase) {
    steps.deliver();
    if (!watching.progress.is_none()) watching.progress(done, total, phase);
  };
  run_work(
      [&](WorkState& state) {
        RenderCallbacks callbacks;
        steps.watch(callbacks);
        callbacks.stop = &state.stop;
        callbacks.stage = [&](RenderStage stage) {
          // Later phases have no numbers of their own: those of the samples stay.
          if (stage != RenderStage::kEstimating && stage != RenderStage::kWriting) state.done = 0, state.total = 0;
          state.phase = name_of(stage, settings.denoising.denoises() ? "denoising" : "combining");
        };
        callbacks.progress = [&](uint64_t done, uint64_t total) {
          state.total = total;
          // Threads may tell their numbers in another order than they count.
          for (uint64_t last = state.done; last < done && !state.done.compare_exchange_weak(last, done);) continue;
        };
        callbacks.warning = [&](const std::string& text) {
          const std::lock_guard lock(mutex);
          warnings.push_back(as_arguments(text));
        };
        std::optional<tbb::global_control> limit;
        if (threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
        if (!watching.page) {
          result = render(scene, plan, request, callbacks);
          return;
        }
        watching.page->stop = &state.stop;
        result = watching.page->live.render(scene, plan, request, callbacks);
        watching.page->stop = nullptr;
      },
      nb::cpp_function(progress));
  Options given = choice.values;
  given.insert(of_integrator.begin(), of_integrator.end());
  if (const std::string text = missing_network(settings.denoising); !text.empty() && !choice.films_only)
    warnings.push_back(as_arguments(text));
  nb::dict made = dict_of(std::move(result), choice.films_only ? kNoEstimator : plan.method->text, warnings, given);
  made["network"] = choice.films_only ? "" : plan.method->network;
  return made;
}

/// What render() would make of the films of its passes, in their order, and of the auxiliary images, for renders in
/// parts; with the same bits as render().
nb::dict image_of_films(const Options& values, const Options& of_estimator, nb::dict films, nb::dict aovs) {
  const RenderSettings settings = settings_from<RenderSettings>(values);
  const Plan plan = plan_of(settings, {values, of_estimator});
  RenderResult result;
  for (const auto& [name, film] : films) {
    Pass& pass = result.passes.emplace_back();
    pass.plan.name = nb::cast<std::string>(name);
    pass.film = nb::cast<const Film&>(film);
  }
  if (result.passes.empty()) throw Error(ErrorCode::kUsage, "films: found none; expected those of a render");
  for (const auto& [name, image] : aovs) {
    const std::string key = nb::cast<std::string>(name);
    result.aovs[key] = layer_of(image, key);
  }
  run_work(
      [&](WorkState& state) {
        const Stopwatch watch;
        ExtraInputs beside;
        if (plan.method->reads_features) beside.features = features_among(result.aovs);
        const int height = result.passes[0].film.height();
        const auto estimate = [&] { result.image = finish(image_of(plan, result.passes, 0, height, beside)); };
        if (!run_stoppable(state, estimate)) return;
        result.predicted = predicted_error(result.image, result.samples_per_pixel(), plan.method->reliable_samples);
        if (result.predicted) result.predicted_blocks = predicted_blocks(result.image);
        if (plan.makes_film()) result.image.estimate = {};
        result.seconds.estimate = watch.seconds();
      },
      nb::none());
  result.complete = true;
  nb::dict made = dict_of(std::move(result), plan.method->text, {}, values);
  made["network"] = plan.method->network;
  return made;
}

}  // namespace

void bind_render(nb::module_& module) {
  using namespace nb::literals;
  nb::class_<LoadedScene>(module, "LoadedScene")
      .def_ro("width", &LoadedScene::width)
      .def_ro("height", &LoadedScene::height)
      .def_ro("spp", &LoadedScene::spp)
      .def_ro("integrator", &LoadedScene::integrator_type)
      .def_ro("warnings", &LoadedScene::warnings)
      .def_ro("files", &LoadedScene::files)
      .def_ro("content_hash", &LoadedScene::content_hash);
  module.def(
      "load_scene",
      [](const std::string& path, const Options& defines, std::optional<std::pair<int, int>> resolution,
         const std::string& integrator, std::optional<int> min_depth, std::optional<int> max_depth,
         nb::dict integrator_options, const Options& view, bool ignore_unknown) {
        return load(path, {defines, resolution, integrator, min_depth, max_depth, view, ignore_unknown},
                    integrator_options);
      },
      "path"_a, "defines"_a, "resolution"_a.none(), "integrator"_a, "min_depth"_a.none(), "max_depth"_a.none(),
      "integrator_options"_a, "view"_a, "ignore_unknown"_a,
      nb::sig("def load_scene(path: str, defines: dict[str, str], resolution: tuple[int, int] | None, integrator: str, "
              "min_depth: int | None, max_depth: int | None, integrator_options: dict[str, typing.Any], "
              "view: dict[str, str], ignore_unknown: bool) -> LoadedScene"));
  module.def(
      "render",
      [](const std::shared_ptr<LoadedScene>& scene, const Options& values, const Options& of_integrator,
         const Options& of_estimator, bool films_only, int threads, nb::object progress, Page* page, nb::object step) {
        return render_scene(*scene, {values, of_estimator, films_only}, of_integrator, threads, {progress, page, step});
      },
      "scene"_a, "values"_a, "of_integrator"_a, "of_estimator"_a, "films_only"_a, "threads"_a, "progress"_a.none(),
      "page"_a.none(), "step"_a.none(),
      nb::sig("def render(scene: LoadedScene, values: dict[str, str], of_integrator: dict[str, str], "
              "of_estimator: dict[str, str], films_only: bool, threads: int, progress: typing.Any, page: Page | None, "
              "step: typing.Any) "
              "-> dict[str, typing.Any]"));
  module.def(
      "is_complete_file", [](const std::string& path) { return made_file(path).complete; }, "path"_a,
      nb::sig("def is_complete_file(path: str) -> bool"));
  module.def("check_output", &check_output, "path"_a, nb::sig("def check_output(path: str) -> None"));
  module.def("image_of_films", &image_of_films, "values"_a, "of_estimator"_a, "films"_a, "aovs"_a,
             nb::sig("def image_of_films(values: dict[str, str], of_estimator: dict[str, str], films: dict[str, Film], "
                     "aovs: dict[str, typing.Any]) -> dict[str, typing.Any]"));
}

}  // namespace covary::python
