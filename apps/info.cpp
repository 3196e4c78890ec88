// SPDX-License-Identifier: Apache-2.0
// covary info: what an image or film contains, and whether it is intact, or what a scene file describes.
#include <fmt/format.h>

#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "combine/registry.h"
#include "commands.h"
#include "core/error.h"
#include "core/printable.h"
#include "declared_options.h"
#include "device/device_info.h"
#include "film/pictures.h"
#include "io/load_scene.h"
#include "io/scene_formats.h"
#include "json_output.h"
#include "method_options.h"
#include "plans/integrator_choice.h"
#include "plans/memory.h"
#include "plans/render.h"
#include "plans/render_settings.h"
#include "value_names.h"

namespace covary {
namespace {

struct InfoOptions {
  std::string path;
  bool has_path = false, devices = false;
  SceneOptions scene_options;
  bool json = false;
};

void print_json(const ImageInfo& info, const std::string& path) {
  const CropWindow& w = info.place.window;
  nlohmann::ordered_json object{{"file", path}, {"format", info.format}};
  object["frame"] = {info.place.frame_width, info.place.frame_height};
  object["window"] = {w.x, w.y, w.width, w.height};
  object["compression"] = info.compression;
  object["colours"] = info.colours.text();
  for (const auto* channels : {&info.channels, &info.unreadable})
    for (const ExrFile::Channel& c : *channels) object["channels"][c.name] = c.type;
  std::vector<std::string> pictures;
  for (const Picture& picture : find_pictures(info.channels)) pictures.push_back(picture.layer);
  object["pictures"] = pictures;
  object["attributes"] = info.attributes;
  write_text_output("-", json_text(object, -1));
}

/// Channels by layer: "group00 (R G B, float)".
std::string describe_channels(const std::vector<ExrFile::Channel>& channels) {
  std::map<std::string, std::pair<std::string, std::string>> layers;  // layer -> components, type
  for (const ExrFile::Channel& c : channels) {
    const size_t dot = c.name.rfind('.');
    auto& [components, type] = layers[dot == std::string::npos ? "" : c.name.substr(0, dot)];
    components += (components.empty() ? "" : " ") + c.name.substr(dot == std::string::npos ? 0 : dot + 1);
    if (type.find(c.type) == std::string::npos) type += (type.empty() ? "" : ", ") + c.type;
  }
  std::string text;
  for (const auto& [layer, content] : layers)
    text += fmt::format("  {}{}{} ({})\n", printable(layer), layer.empty() ? "" : ": ", printable(content.first),
                        content.second);
  return text;
}

/// Memory of a render of the scene with default settings, by estimator.
std::map<std::string, double> memory_of_renders(const LoadedScene& scene) {
  std::map<std::string, double> memory;
  for (const char* name : {kDefaultEstimator, kNoEstimator}) {
    const Plan plan = render_plan(settings_from<RenderSettings>({{"estimator", name}}), {});
    memory[name] = render_memory(scene, plan, {}).total();
  }
  return memory;
}

void scene_info(const InfoOptions& options) {
  LoadOptions loading = load_options(options.scene_options);
  loading.make_integrator = integrator_maker({});  // what render would refuse is refused here
  loading.view.environment = "auto";
  const LoadedScene scene = load_scene(options.path, loading);
  for (const std::string& warning : scene.warnings) fmt::print(stderr, "warning: {}\n", as_options(warning));
  const std::map<std::string, double> memory = memory_of_renders(scene);
  if (options.json) {
    const nlohmann::ordered_json object{{"file", options.path},
                                        {"format", "scene"},
                                        {"frame", {scene.width, scene.height}},
                                        {"window", {scene.crop_x, scene.crop_y, scene.crop_width, scene.crop_height}},
                                        {"samples_per_pixel", scene.spp},
                                        {"integrator", scene.integrator_type},
                                        {"triangles", scene.scene->n_triangles()},
                                        {"memory_bytes", memory},
                                        {"scene_hash", scene.content_hash}};
    return write_text_output("-", json_text(object, -1));
  }
  fmt::print("{}: {} x {} pixels, {} samples per pixel, integrator {}\n{} triangles\n", options.path, scene.width,
             scene.height, scene.spp, scene.integrator_type.empty() ? "not named" : scene.integrator_type,
             scene.scene->n_triangles());
  fmt::print("memory of a render beside the scene: {} with --estimator {}, {} with {}\nscene_hash: {}\n",
             bytes_text(memory.at(kDefaultEstimator)), kDefaultEstimator, bytes_text(memory.at(kNoEstimator)),
             kNoEstimator, scene.content_hash);
}

void print_text(const ImageInfo& info, const std::string& path) {
  const CropWindow& w = info.place.window;
  fmt::print("{}: {} x {} pixels", printable(path), w.width, w.height);
  if (w.x || w.y || w.width != info.place.frame_width || w.height != info.place.frame_height)
    fmt::print(" at ({}, {}) of a frame of {} x {}", w.x, w.y, info.place.frame_width, info.place.frame_height);
  fmt::print(", {}{}{}\n", info.format, info.compression.empty() ? "" : ", compression ", info.compression);
  if (!(info.colours == ColourSpace::rec709())) fmt::print("colours {}\n", info.colours.text());
  const std::vector<Picture> pictures = find_pictures(info.channels);
  if (pictures.size() > 1) fmt::print("pictures {}\n", printable(text_of(pictures)));
  fmt::print("channels\n{}", describe_channels(info.channels));
  if (!info.unreadable.empty())
    fmt::print("channels that other commands cannot read\n{}", describe_channels(info.unreadable));
  if (!info.attributes.empty()) fmt::print("attributes\n");
  for (const auto& [name, value] : info.attributes) fmt::print("  {}: {}\n", printable(name), printable(value));
}

/// The devices that `--device` takes.
void devices_info(const InfoOptions& options) {
  if (options.has_path) throw Error(ErrorCode::kUsage, "--devices tells of this machine; it takes no file");
  std::vector<std::string> notes;
  const std::vector<device::DeviceInfo> all = device::devices(&notes);
  if (options.json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const device::DeviceInfo& d : all)
      list.push_back({{"id", d.id()},
                      {"name", d.name},
                      {"driver", d.driver},
                      {"is_processor", d.is_processor},
                      {"units", d.units},
                      {"memory_bytes", d.memory},
                      {"largest_buffer_bytes", d.largest_buffer},
                      {"local_memory_bytes", d.local_memory}});
    return write_text_output("-", json_text({{"devices", list}, {"notes", notes}}, -1));
  }
  for (const device::DeviceInfo& d : all)
    fmt::print("{}: {}{}, {} units, {}; {}\n", d.id(), printable(d.name), d.is_processor ? " (the processor)" : "",
               d.units, bytes_text(static_cast<double>(d.memory)), printable(d.driver));
  for (const std::string& note : notes) fmt::print("{}\n", printable(note));
}

void info(const InfoOptions& options) {
  if (options.devices) return devices_info(options);
  if (!options.has_path) throw Error(ErrorCode::kUsage, "FILE is required, or --devices");
  if (is_scene_file(options.path)) return scene_info(options);
  if (!options.scene_options.defines.empty()) throw Error(ErrorCode::kUsage, "-D is for scene files (.xml)");
  const ImageInfo info = describe_image(options.path);
  if (options.json)
    print_json(info, options.path);
  else
    print_text(info, options.path);
  std::fflush(stdout);
  if (!info.channels.empty()) check_image(options.path);  // last: even the header of a damaged file may help
}

}  // namespace

void add_info(CLI::App& app) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App* command = app.add_subcommand("info", "Describe a film, image or scene: size, channels, attributes");
  const CLI::Option* file = add_value(*command, "FILE", options->path, kFileValue,
                                      fmt::format("A film or image, or a scene file ({})", scene_file_endings()));
  add_scene_options(*command, options->scene_options);
  command->add_flag("--devices", options->devices, "Instead, the GPUs and other devices that --device takes");
  command->add_flag("--json", options->json, "One JSON object");
  command->callback([options, file] {
    options->has_path = file->count() > 0;
    info(*options);
  });
}

}  // namespace covary
