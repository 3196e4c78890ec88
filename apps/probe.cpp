// SPDX-License-Identifier: Apache-2.0
// covary probe: what guided-path has learnt at the surface behind a pixel, as latitude-longitude images.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <vector>

#include "commands.h"
#include "declared_options.h"
#include "film/image_writer.h"
#include "film/outputs.h"
#include "integrators/registry.h"
#include "method_options.h"
#include "numbers.h"
#include "passes/training.h"
#include "plans/budget.h"
#include "plans/light_plan.h"
#include "plans/result_files.h"
#include "plans/training_stage.h"
#include "progress.h"
#include "render_options.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

/// Samples per pixel of the request if only the training needs a number.
constexpr uint32_t kAnyBudget = 1u << 20;

struct ProbeOptions {
  const CLI::App* command = nullptr;
  RenderOptions render;
  std::string pixel;
  int height = 64;
  uint32_t samples = 64;
};

/// A probe trains but renders no image: refuses options that only affect images, which the help leaves out.
bool has_effect(const CLI::Option& option) {
  static constexpr const char* kUsed[] = {
      "help",   "help-all",       "output",        "integrator",    "resolution", "crop",    "seed",
      "define", "ignore-unknown", "threads",       "quiet",         "no-preview", "rfilter", "pixel",
      "height", "samples",        "load-training", "save-training", "set"};
  if (option.get_positional()) return true;
  for (const std::string& name : option.get_lnames())
    if (std::count(std::begin(kUsed), std::end(kUsed), name) > 0 || find_option(options_of_integrators(), name))
      return true;
  return false;
}

void check_effects(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options())
    if (option->count() > 0 && !has_effect(*option))
      throw Error(ErrorCode::kUsage,
                  "--" + option->get_lnames()[0] + " has no effect on probes, which render no image");
}

void check_parameters(const OptionValues& of_estimator) {
  if (!of_estimator.empty())
    throw Error(ErrorCode::kUsage,
                fmt::format("`{}` has no effect on probes, which render no image", of_estimator.begin()->first));
}

using ThreeImages = std::array<const Image*, 3>;

Image beside_each_other(const ThreeImages& images) {
  const int width = images[0]->width, height = images[0]->height;
  Image all(3 * width, height, 3);
  for (int i = 0; i < 3; ++i)
    for (int y = 0; y < height; ++y) std::copy_n(images[i]->pixel(0, y), 3 * width, all.pixel(i * width, y));
  return all;
}

/// For display: one percent of the values is clipped to white. Radiance and density differ by orders of magnitude.
Image exposed(Image image) {
  std::vector<float> values = image.data;
  const auto white = values.begin() + static_cast<ptrdiff_t>(0.99 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), white, values.end());
  if (*white > 0)
    for (float& value : image.data) value /= *white;
  return image;
}

void write_preview(const std::string& path, const GuideProbe& probe) {
  const Image radiance = exposed(probe.radiance), density = exposed(probe.density), control = exposed(probe.control);
  write_png(path, beside_each_other({&radiance, &density, &control}));
}

void probe(ProbeOptions options) {
  RenderOptions& render = options.render;
  check_effects(*options.command);
  check_parameters(render.of_estimator);
  if (!render.values.contains("output")) throw Error(ErrorCode::kUsage, "no output given; use -o OUT.exr");
  render.values.insert({"integrator", "guided-path"});
  render.values["spp"] = std::to_string(kAnyBudget);
  check_options(render);
  const std::string& output = render.request().output;
  Outputs outputs;
  outputs.writes("-o", output, OutputKind::kImage);
  const bool has_preview = render.request().preview && lower_extension(output) == ".exr";
  const std::string preview = preview_path(output);
  if (has_preview) outputs.writes_derived_png("the preview", preview, "use --no-preview, or another name for -o");
  ProgressLine progress(fs::path(render.scene).stem().string(), render.quiet);
  progress.begin("loading");
  const LoadedScene scene = load(render);
  outputs.reads(scene.files);
  progress.clear();
  for (const std::string& warning : scene.warnings) fmt::print(stderr, "warning: {}\n", as_options(warning));
  const RenderRequest request = make_request(render, scene);
  const std::shared_ptr<Integrator> integrator = prepared_integrator(scene, make_plan(render), request);
  const LearningIntegrator* learning = integrator->learning();
  if (!learning || !learning->learns_directions())
    throw Error(ErrorCode::kUsage, "probe shows what guided-path has learnt, not " + render.settings.integrator);
  const auto at = parse_numbers("--pixel", options.pixel, ',', 2, "X,Y, e.g. 640,360");
  if (at[0] < 0 || at[1] < 0 || at[0] >= scene.width || at[1] >= scene.height)
    throw Error(ErrorCode::kUsage,
                fmt::format("--pixel '{}' is outside the {} x {} frame", options.pixel, scene.width, scene.height));
  RenderSeconds seconds;
  progress.begin("training");
  const auto update = [&](uint64_t done, uint64_t total) { progress.update(done, total); };
  train(scene, request, *integrator,
        {window_of(scene, request), request.filter.value_or(scene.filter), nullptr, update, {}}, seconds);
  const Ray ray =
      scene.scene->camera().ray({static_cast<float>(at[0]) + 0.5f, static_cast<float>(at[1]) + 0.5f}, {0.5f, 0.5f});
  const std::optional<GuideProbe> found =
      learning->probe(*scene.scene, ray, options.height, options.samples, render.request().seed);
  if (!found) throw Error(ErrorCode::kUsage, fmt::format("no surface is visible at pixel {}", options.pixel));
  progress.finish();
  const Image image = beside_each_other({&found->radiance, &found->density, &found->control});
  write_image(output, image, {image.width, image.height, {0, 0, image.width, image.height}}, {});
  if (has_preview) write_preview(preview, *found);
  if (render.quiet) return;
  fmt::print(stderr, "{}: radiance, density and control at ({:g}, {:g}, {:g}), {} x {} pixels each\n", output,
             found->position.x, found->position.y, found->position.z, found->radiance.width, found->radiance.height);
}

}  // namespace

void add_probe(CLI::App& app) {
  const auto options = std::make_shared<ProbeOptions>();
  CLI::App* command = app.add_subcommand(
      "probe",
      "Show what guided-path has learnt at the surface seen by a pixel, as an image (EXR) and its preview (PNG)");
  add_render_options(*command, options->render);
  add_value(*command, "--pixel", options->pixel, "X,Y", "X,Y of the frame")->required();
  command->add_option("--height", options->height, "Rows of the images, which are twice as wide")
      ->transform(whole_number(1, 4096))
      ->capture_default_str();
  command->add_option("--samples", options->samples, "Samples of the radiance in each direction")
      ->transform(whole_number(1u, 1u << 20))
      ->capture_default_str();
  for (CLI::Option* option : command->get_options([](const CLI::Option* o) { return !has_effect(*o); }))
    option->group("");
  options->command = command;
  command->callback([options] { probe(*options); });
}

}  // namespace covary
