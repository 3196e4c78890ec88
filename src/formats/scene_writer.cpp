// SPDX-License-Identifier: Apache-2.0
#include "formats/scene_writer.h"

#include <fmt/format.h>

#include <pugixml.hpp>
#include <set>
#include <sstream>
#include <unordered_map>
#include <unordered_set>

#include "core/content_hash.h"
#include "formats/object_builder.h"
#include "formats/xml_values.h"
#include "scene/embedded_data.h"

namespace covary {
namespace {

/// The shortest text that reads back as the same float: scene numbers are parsed as doubles and then rounded.
std::string float_text(float value) {
  std::string text = fmt::format("{}", value);
  return static_cast<float>(parse_number(text)) == value ? text : fmt::format("{}", static_cast<double>(value));
}

std::string vector_text(const Vec3& v) {
  return fmt::format("{}, {}, {}", float_text(v.x), float_text(v.y), float_text(v.z));
}

std::string spectrum_text(const SampledSpectrum& spectrum) {
  if (spectrum.samples.size() == 1) return float_text(spectrum.samples[0].second);
  std::string text;
  for (const auto& [wavelength, value] : spectrum.samples)
    text += fmt::format("{}{}:{}", text.empty() ? "" : ", ", float_text(wavelength), float_text(value));
  return text;
}

std::string matrix_text(const Matrix4& m) {
  std::string text;
  for (const auto& row : m)
    for (const double value : row) text += fmt::format("{}{}", text.empty() ? "" : " ", value);
  return text;
}

class Writer {
 public:
  explicit Writer(const SceneWriting& writing) : writing_(writing) {}

  SceneDocument write(const ObjectDescription& scene) {
    count_references(scene);
    pugi::xml_document document;
    if (!writing_.comment.empty()) document.append_child(pugi::node_comment).set_value(writing_.comment.c_str());
    root_ = document.append_child("scene");
    root_.append_attribute("version") = "3.0.0";
    for (const Property& property : scene.properties) {
      const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
      if (!object || !*object || is_part_of_shapes(**object)) continue;
      if (is_shared(**object)) {
        define(**object);
      } else {
        define_parts(**object);
        write_object(root_, "", **object);
      }
    }
    std::ostringstream text;
    document.save(text, "  ", pugi::format_indent | pugi::format_no_declaration);
    result_.xml = text.str();
    return std::move(result_);
  }

 private:
  void count_references(const ObjectDescription& scene) {
    visit_properties(scene, [&](const ObjectDescription&, const Property& property) {
      const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
      if (child && *child) ++n_references_[child->get()];
    });
  }

  bool is_shared(const ObjectDescription& object) const {
    return object.kind != "emitter" && n_references_.at(&object) > 1;
  }

  /// Lights at top level that shapes reference.
  bool is_part_of_shapes(const ObjectDescription& object) const {
    return object.kind == "emitter" && n_references_.at(&object) > 1;
  }

  /// Writes objects referenced several times once, at the top of the scene.
  void define(const ObjectDescription& object) {
    if (ids_.contains(&object)) return;
    define_parts(object);
    const std::string& id = ids_[&object] = new_id(object);
    pugi::xml_node node = write_object(root_, "", object);
    node.append_attribute("id") = id.c_str();
  }

  void define_parts(const ObjectDescription& object) {
    for (const Property& property : object.properties) {
      const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
      if (!child || !*child) continue;
      if (is_shared(**child))
        define(**child);
      else
        define_parts(**child);
    }
  }

  /// The object's own id if it has one that is still free.
  std::string new_id(const ObjectDescription& object) {
    const std::string stem = object.id.empty() ? object.kind : object.id;
    std::string id = object.id.empty() ? stem + "-1" : stem;
    for (size_t& n = n_ids_[stem]; !taken_.insert(id).second;) id = fmt::format("{}-{}", stem, ++n);
    return id;
  }

  pugi::xml_node write_object(pugi::xml_node parent, const std::string& name, const ObjectDescription& object) {
    pugi::xml_node node = parent.append_child(object.kind.c_str());
    node.append_attribute("type") = object.type.c_str();
    set_name(node, name);
    for (const Property& property : object.properties) write_property(node, property);
    return node;
  }

  static void set_name(pugi::xml_node node, const std::string& name) {
    if (!name.empty() && !name.starts_with("_arg_")) node.append_attribute("name") = name.c_str();
  }

  static void add_transform(pugi::xml_node parent, const char* attribute, const std::string& text,
                            const Matrix4& matrix) {
    pugi::xml_node node = parent.append_child("transform");
    node.append_attribute(attribute) = text.c_str();
    node.append_child("matrix").append_attribute("value") = matrix_text(matrix).c_str();
  }

  void write_property(pugi::xml_node parent, const Property& property) {
    if (const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value)) {
      if (!*child) return;
      const auto id = ids_.find(child->get());
      if (id == ids_.end()) {
        write_object(parent, property.name, **child);
      } else {
        pugi::xml_node node = parent.append_child("ref");
        node.append_attribute("id") = id->second.c_str();
        set_name(node, property.name);
      }
      return;
    }
    const auto add = [&](const char* tag, const std::string& name, const std::string& value) {
      pugi::xml_node node = parent.append_child(tag);
      node.append_attribute("name") = name.c_str();
      node.append_attribute("value") = value.c_str();
    };
    const std::string& name = property.name;
    if (const bool* truth = std::get_if<bool>(&property.value)) {
      add("boolean", name, *truth ? "true" : "false");
    } else if (const int64_t* integer = std::get_if<int64_t>(&property.value)) {
      add("integer", name, fmt::format("{}", *integer));
    } else if (const double* number = std::get_if<double>(&property.value)) {
      add("float", name, fmt::format("{}", *number));
    } else if (const Vec3* vector = std::get_if<Vec3>(&property.value)) {
      add(name == "direction" ? "vector" : "point", name, vector_text(*vector));
    } else if (const ColourValue* colour = std::get_if<ColourValue>(&property.value)) {
      add("rgb", name, vector_text({colour->rgb.r, colour->rgb.g, colour->rgb.b}));
    } else if (const SampledSpectrum* spectrum = std::get_if<SampledSpectrum>(&property.value)) {
      add("spectrum", name, spectrum_text(*spectrum));
    } else if (const Transform* transform = std::get_if<Transform>(&property.value)) {
      if (transform->is_identity()) return;
      add_transform(parent, "name", name, transform->matrix());
    } else if (const KeyedTransformPtr* animation = std::get_if<KeyedTransformPtr>(&property.value)) {
      pugi::xml_node node = parent.append_child("animation");
      node.append_attribute("name") = name.c_str();
      for (const TransformKey& key : (*animation)->keys())
        add_transform(node, "time", fmt::format("{}", key.time), key.matrix);
    } else if (const std::string* text = std::get_if<std::string>(&property.value)) {
      if (name == kEmbeddedData)
        add("string", "filename", add_file(*text));
      else
        add("string", name, name == "filename" ? writing_.file_name(*text, property.where) : *text);
    }
  }

  /// Adds a file with this content; returns its name.
  std::string add_file(const std::string& bytes) {
    std::string_view content = bytes;
    const char* extension = bytes.starts_with("ply")                             ? ".ply"
                            : bytes.starts_with("VOL")                           ? ".vol"
                            : bytes.starts_with("PF") || bytes.starts_with("Pf") ? ".pfm"
                            : bytes.starts_with("P5") || bytes.starts_with("P6") ? ".ppm"
                                                                                 : ".txt";
    if (std::optional<RecodedFile> other = writing_.recode ? writing_.recode(bytes) : std::nullopt) {
      content = result_.recoded.emplace_back(std::move(other->bytes));
      extension = other->extension;
    }
    const std::string path = fmt::format("{}/{}{}", writing_.folder, key_text(content).substr(0, 16), extension);
    if (files_.insert(path).second) result_.files.push_back({path, content});
    return path;
  }

  const SceneWriting& writing_;
  SceneDocument result_;
  pugi::xml_node root_;
  std::unordered_map<const ObjectDescription*, size_t> n_references_;
  std::unordered_map<const ObjectDescription*, std::string> ids_;
  std::unordered_map<std::string, size_t> n_ids_;
  std::unordered_set<std::string> taken_;
  std::set<std::string> files_;
};

}  // namespace

SceneDocument scene_document(const ObjectDescription& scene, const SceneWriting& writing) {
  return Writer(writing).write(scene);
}

}  // namespace covary
