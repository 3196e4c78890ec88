// SPDX-License-Identifier: Apache-2.0
// covary convert-scene: converts a scene of any supported format to Mitsuba XML.
#include "io/convert_scene.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "commands.h"
#include "core/error.h"
#include "declared_options.h"
#include "film/outputs.h"
#include "formats/file_resolver.h"
#include "imageio/output_file.h"
#include "io/scene_formats.h"
#include "method_options.h"
#include "plans/integrator_choice.h"
#include "value_names.h"

namespace covary {
namespace fs = std::filesystem;
namespace {

/// Default: the picture that `covary render` makes.
const SceneView kConvertedView{.environment = "auto"};

struct ConvertSceneOptions {
  std::string input, output;
  SceneOptions scene_options;
  OptionValues view;
  bool overwrite = false;
};

[[noreturn]] void refuse(const std::string& path) {
  throw Error(ErrorCode::kUsage,
              fmt::format("the output '{}' already exists; give another name, or --overwrite to replace it", path));
}

bool holds(const std::string& path, std::string_view bytes) {
  const FileView file(path);
  return file.text() == bytes;
}

/// Meshes first, the scene last: when it exists, so do all files that it references. Mesh files are named by content,
/// so an existing scene stays intact until it is replaced.
void write_files(const ConvertSceneOptions& options, const ConvertedScene& scene) {
  const fs::path folder = fs::path(options.output).parent_path();
  for (const SceneDocumentFile& file : scene.document.files) {
    const fs::path path = folder / file.path;
    std::error_code failed;
    fs::create_directory(path.parent_path(), failed);
    if (failed)
      throw Error(ErrorCode::kIo,
                  fmt::format("cannot make the folder '{}': {}", path.parent_path().string(), failed.message()));
    if (fs::exists(path, failed)) {
      if (holds(path.string(), file.bytes)) continue;
      if (!options.overwrite) refuse(path.string());
    }
    OutputFile out(path.string());
    out.write(file.bytes.data(), file.bytes.size());
    out.commit();
  }
  write_text_file(options.output, scene.document.xml);
}

void convert_scene(const ConvertSceneOptions& options) {
  Outputs outputs;
  outputs.reads(options.input);
  outputs.writes("the output", options.output, OutputKind::kScene);
  const bool special = output_target(options.output).is_special;
  std::error_code ignored;
  if (!options.overwrite && !special && fs::exists(options.output, ignored)) refuse(options.output);
  LoadOptions loading = load_options(options.scene_options);
  loading.make_integrator = integrator_maker({});
  loading.view = settings_from<SceneView>(options.view, kConvertedView);
  const ConvertedScene scene = convert_scene(options.input, options.output, loading);
  for (const std::string& file : scene.files)
    if (is_same_file(file, options.output))
      throw Error(ErrorCode::kUsage,
                  fmt::format("the output '{}' is a file that the scene reads; give another name", options.output));
  if (special && !scene.document.files.empty())
    throw Error(ErrorCode::kUsage,
                fmt::format("the scene has meshes or images in its own file, which become files beside the new one: "
                            "the output '{}' must be the name of a file",
                            options.output));
  for (const std::string& warning : scene.warnings) fmt::print(stderr, "warning: {}\n", as_options(warning));
  write_files(options, scene);
}

}  // namespace

void add_convert_scene(CLI::App& app) {
  const auto o = std::make_shared<ConvertSceneOptions>();
  CLI::App* command = app.add_subcommand("convert-scene",
                                         "Convert a scene of another format, or of an older Mitsuba, to Mitsuba 3 XML");
  add_value(*command, "SCENE", o->input, kFileValue,
            fmt::format("Scene: {}, of any version ({})", scene_format_names(), scene_file_endings()))
      ->option_text("SCENE")
      ->required();
  add_value(*command, "OUT", o->output, kFileValue,
            "The new scene (.xml, Mitsuba 3.0). Meshes and images inside SCENE become files in the folder "
            "OUT-files; other files stay where they are")
      ->option_text("OUT.xml")
      ->required();
  add_scene_options(*command, o->scene_options);
  add_options(*command, options_of<SceneView>(kConvertedView), o->view);
  command->add_flag("--overwrite", o->overwrite, "Replace OUT.xml and its files");
  command->callback([o] { convert_scene(*o); });
}

}  // namespace covary
