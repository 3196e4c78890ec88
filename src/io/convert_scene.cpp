// SPDX-License-Identifier: Apache-2.0
#include "io/convert_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "core/srgb.h"
#include "emitters/equal_area_image.h"
#include "formats/file_resolver.h"
#include "formats/object_builder.h"
#include "imageio/png.h"
#include "io/media.h"
#include "io/scene_formats.h"
#include "scene/embedded_data.h"
#include "textures/image.h"

namespace covary {
namespace fs = std::filesystem;
namespace {

/// XML comments must not contain "--".
std::string comment_on(const std::string& path) {
  std::string name = fs::path(path).filename().string();
  for (size_t i; (i = name.find("--")) != std::string::npos;) name.replace(i, 2, "- -");
  return fmt::format(" Made by covary of '{}' ", name);
}

/// Path of `file` relative to `folder`.
std::string relative_name(const fs::path& file, const fs::path& folder) {
  std::error_code failed;
  const fs::path relative = fs::relative(file, folder.empty() ? "." : folder, failed);
  return failed || relative.empty() ? fs::absolute(file).string() : relative.string();
}

/// A parameter that Mitsuba's plugin of the same name lacks; empty if there is none.
std::string own_parameter(const ObjectDescription& object) {
  static constexpr std::pair<const char*, const char*> kOwn[] = {{"spot", "falloff"},
                                                                 {"hdrfilm", "response"},
                                                                 {"bitmap", "gamma"},
                                                                 {"checkerboard", "dimension"},
                                                                 {"area", "two_sided"},
                                                                 {"area", "power"},
                                                                 {"area", "hidden"},
                                                                 {"scale", "exponent"},
                                                                 {"projector", "constant_intensity"},
                                                                 {"roughplastic", "alpha_u"},
                                                                 {"homogeneous", "radiance"},
                                                                 {"heterogeneous", "radiance"},
                                                                 {"normalmap", "along_dv"}};
  const auto has = [&](const std::string& name) {
    return std::any_of(object.properties.begin(), object.properties.end(),
                       [&](const Property& p) { return p.name == name; });
  };
  for (const auto& [type, name] : kOwn)
    if (object.type == type && has(name)) return name;
  return "";
}

/// Warns about plugins and parameters that Mitsuba 3 does not have.
void warn_of_own_plugins(const ObjectDescription& scene, std::vector<std::string>& warnings) {
  std::set<std::string> told;
  visit_properties(scene, [&](const ObjectDescription&, const Property& property) {
    const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
    if (!child || !*child) return;
    const ObjectDescription& object = **child;
    static const std::set<std::pair<std::string, std::string>> kOwn = {
        {"texture", "bilerp"},      {"texture", "dots"},   {"texture", "mix"},
        {"texture", "noise"},       {"texture", "scale"},  {"texture", "projected"},
        {"integrator", "bdpt"},     {"bsdf", "difftrans"}, {"bsdf", "metallicroughness"},
        {"emitter", "goniometric"}, {"bsdf", "coating"},   {"bsdf", "phong"},
        {"bsdf", "roughcoating"},   {"bsdf", "ward"},      {"sensor", "spherical"},
        {"emitter", "environments"}};
    const bool own = kOwn.contains({object.kind, object.type});
    if (const std::string name = own_parameter(object); !name.empty() && told.insert(name).second)
      warnings.push_back(fmt::format("{}: the {} '{}' gets the parameter '{}', which Mitsuba 3 does not have",
                                     object.where.text(), object.kind, object.type, name));
    if (own && told.insert(object.type).second)
      warnings.push_back(fmt::format("{}: becomes the {} '{}', which Mitsuba 3 does not have", object.where.text(),
                                     object.kind, object.type));
  });
}

using FindFile = std::function<std::string(const std::string& name, const SourceLocation& where)>;

std::string pfm_text(const TexelImage& image) {
  std::string text = fmt::format("P{}\n{} {}\n-1.0\n", image.channels == 3 ? 'F' : 'f', image.width, image.height);
  const size_t row = static_cast<size_t>(image.width) * image.channels;
  for (int y = image.height - 1; y >= 0; --y)
    text.append(reinterpret_cast<const char*>(image.floats.data() + y * row), row * sizeof(float));
  return text;
}

/// Re-encodes images embedded in the scene's file in formats that Mitsuba reads: 8-bit colours as PNG; grey, which is
/// linear, as PFM.
std::optional<RecodedFile> recode(std::string_view bytes) {
  if (!bytes.starts_with("P5") && !bytes.starts_with("P6")) return std::nullopt;
  TexelImage image = read_embedded_image(bytes);
  if (image.channels == 3) {
    const std::vector<unsigned char> png = encode_png(image.width, image.height, image.bytes);
    return RecodedFile{{png.begin(), png.end()}, ".png"};
  }
  for (const uint8_t value : image.bytes) image.floats.push_back(static_cast<float>(value) / 255);
  return RecodedFile{pfm_text(image), ".pfm"};
}

/// Resamples a pbrt environment map to Mitsuba's mapping.
ObjectPtr in_latitude_longitude(const ObjectDescription& emitter, const FindFile& find_file) {
  auto changed = std::make_shared<ObjectDescription>(emitter);
  std::erase_if(changed->properties, [](const Property& p) { return p.name == "mapping"; });
  for (Property& p : changed->properties)
    if (p.name == "filename") {
      const std::string path = find_file(std::get<std::string>(p.value), p.where);
      p.name = kEmbeddedData;
      p.value = pfm_text(latitude_longitude_of(read_linear_rgb(path)));
    }
  return changed;
}

/// Images whose one channel is not what Mitsuba takes become grey images.
class GreyImages {
 public:
  explicit GreyImages(const FindFile& find_file) : find_file_(find_file) {}

  ObjectPtr of(const ObjectPtr& object) {
    if (const auto known = done_.find(object); known != done_.end()) return known->second;
    std::shared_ptr<ObjectDescription> changed;  // copies only what changes: meshes may be large
    const auto copy = [&]() -> ObjectDescription& {
      if (!changed) changed = std::make_shared<ObjectDescription>(*object);
      return *changed;
    };
    for (size_t i = 0; i < object->properties.size(); ++i)
      if (const ObjectPtr* child = std::get_if<ObjectPtr>(&object->properties[i].value); child && *child)
        if (const ObjectPtr other = of(*child); other != *child) copy().properties[i].value = other;
    if (object->kind == "texture" && object->type == "bitmap" &&
        std::any_of(object->properties.begin(), object->properties.end(),
                    [](const Property& p) { return p.name == "grey"; }))
      make_grey(copy());
    return done_[object] = changed ? ObjectPtr(changed) : object;
  }

 private:
  void make_grey(ObjectDescription& bitmap) {
    std::erase_if(bitmap.properties, [](const Property& p) { return p.name == "grey"; });
    const auto file = std::find_if(bitmap.properties.begin(), bitmap.properties.end(),
                                   [](const Property& p) { return p.name == "filename"; });
    if (file == bitmap.properties.end()) return;
    const std::string path = find_file_(std::get<std::string>(file->value), file->where);
    const bool raw = std::any_of(bitmap.properties.begin(), bitmap.properties.end(), [](const Property& p) {
      const bool* value = std::get_if<bool>(&p.value);
      return p.name == "raw" && value && *value;
    });
    if (read_texels(path).channels == 1) return;  // Mitsuba takes the same
    TexelImage image = read_alpha_or_mean(path, raw);
    if (image.srgb && !raw)
      for (float& value : image.floats) value = srgb_to_linear(value);
    file->name = kEmbeddedData;
    file->value = pfm_text(image);
  }

  const FindFile& find_file_;
  std::map<ObjectPtr, ObjectPtr> done_;
};

/// The sensor with the sampler of Mitsuba 3 that selects the same points here.
ObjectPtr with_known_sampler(const ObjectPtr& sensor) {
  const auto is_sobol = [](const Property& p) {
    const ObjectPtr* child = std::get_if<ObjectPtr>(&p.value);
    return child && *child && (*child)->kind == "sampler" && (*child)->type == "sobol";
  };
  if (std::none_of(sensor->properties.begin(), sensor->properties.end(), is_sobol)) return sensor;
  auto changed = std::make_shared<ObjectDescription>(*sensor);
  for (Property& property : changed->properties) {
    if (!is_sobol(property)) continue;
    auto sampler = std::make_shared<ObjectDescription>(*std::get<ObjectPtr>(property.value));
    sampler->type = "ldsampler";
    property.value = ObjectPtr(sampler);
  }
  return changed;
}

/// The scene with environments in Mitsuba's mapping and, if it has media, Mitsuba's volumetric path tracer.
std::shared_ptr<const ObjectDescription> for_mitsuba(const ObjectDescription& scene, const FindFile& find_file,
                                                     std::vector<std::string>& warnings) {
  auto changed = std::make_shared<ObjectDescription>(scene);
  const bool media = has_media(scene);
  GreyImages images(find_file);
  for (Property& property : changed->properties) {
    ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
    if (!object || !*object) continue;
    *object = images.of(*object);
    if ((*object)->kind == "sensor") *object = with_known_sampler(*object);
    if (media && (*object)->kind == "integrator" && (*object)->type == "path") {
      auto integrator = std::make_shared<ObjectDescription>(**object);
      integrator->type = "volpath";
      *object = integrator;
    }
    if ((*object)->kind != "emitter" || (*object)->type != "envmap") continue;
    const auto has = [&](const std::string& name, const std::string& value) {
      return std::any_of((*object)->properties.begin(), (*object)->properties.end(), [&](const Property& p) {
        const std::string* text = std::get_if<std::string>(&p.value);
        return p.name == name && text && *text == value;
      });
    };
    if (!has("mapping", "equal_area")) continue;
    warnings.push_back((*object)->where.text() +
                       ": the image of equal areas becomes one by latitude and longitude: a little less sharp");
    *object = in_latitude_longitude(**object, find_file);
  }
  return changed;
}

}  // namespace

ConvertedScene convert_scene(const std::string& path, const std::string& output, const LoadOptions& options) {
  ConvertedScene result;
  std::vector<ObjectPtr> added;
  {
    const LoadedScene loaded = load_scene(path, options);
    result.files = loaded.files;
    result.warnings = loaded.warnings;
    added = loaded.added;
  }
  result.files.push_back(path);
  const FileView file(path);
  Diagnostics diagnostics;
  FileResolver files;
  const SceneXml xml = read_scene_file({file.text(), path, options.defines, {}}, files, diagnostics);
  const auto find_file = [&](const std::string& name, const SourceLocation& where) {
    return files.resolve(name, where, diagnostics);
  };
  const auto viewed = with_view(*xml.scene, options.view, added, diagnostics);
  if (options.view.background)
    result.warnings.push_back(path + ": `background` is not written: Mitsuba's cameras see the light from all around");
  result.description = for_mitsuba(*viewed, find_file, result.warnings);
  const fs::path folder = fs::path(output).parent_path();
  SceneWriting writing{comment_on(path), fs::path(output).stem().string() + "-files", {}, recode};
  writing.file_name = [&](const std::string& name, const SourceLocation& where) {
    const std::string found = find_file(name, where);
    return found.empty() ? name : relative_name(found, folder);
  };
  result.document = scene_document(*result.description, writing);
  diagnostics.throw_if_errors();
  warn_of_own_plugins(*result.description, result.warnings);
  return result;
}

}  // namespace covary
