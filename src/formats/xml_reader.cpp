// SPDX-License-Identifier: Apache-2.0
#include "formats/xml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <unordered_map>

#include "core/content_hash.h"
#include "formats/file_resolver.h"
#include "formats/forks.h"
#include "formats/scene_references.h"
#include "formats/spectrum_objects.h"
#include "formats/upgrade.h"
#include "formats/xml_document.h"
#include "formats/xml_property.h"

namespace covary {
namespace fs = std::filesystem;
namespace {

// Limits far above what scenes need, but low enough that no small file takes long or much memory.
constexpr int kMaxIncludeDepth = 15;
constexpr int kMaxIncludes = 1000;
constexpr size_t kMaxTextBytes = size_t{1} << 28;  // of all files together
constexpr size_t kMaxObjects = 1000000;
constexpr size_t kMaxNesting = 64;
constexpr int kNewestVersion = 3;

const std::vector<std::string> kObjectTags = {"scene",  "bsdf",       "texture",    "emitter",  "shape",  "sensor",
                                              "film",   "rfilter",    "integrator", "sampler",  "medium", "phase",
                                              "volume", "subsurface", "camera",     "luminaire"};
const std::vector<std::string> kOtherTags = {"boolean", "integer", "float",    "string",    "point",    "vector",
                                             "rgb",     "srgb",    "spectrum", "blackbody", "include",  "alias",
                                             "default", "path",    "ref",      "transform", "animation"};

/// What an element of this tag and type describes: colours may be written as textures, as Mitsuba's own writer does,
/// and textures as spectra. The first versions of Mitsuba had other names for sensors and emitters.
std::string kind_of(std::string_view tag, std::string_view type) {
  if (tag == "spectrum" || (tag == "texture" && type != "uniform"))
    return is_spectrum_type(type) ? "spectrum" : "texture";
  if (tag == "camera") return "sensor";
  if (tag == "luminaire") return "emitter";
  return std::string(tag);
}

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

class Reader {
 public:
  Reader(const std::map<std::string, std::string>& defines, FileResolver& files, Diagnostics& diagnostics)
      : defines_(defines), files_(files), diagnostics_(diagnostics) {
    for (const auto& [name, value] : defines) digest_ += fmt::format("{}={}\n", name, value);
  }

  SceneXml read(std::string_view text, const std::string& name) {
    const std::string folder = fs::path(name).parent_path().string();
    files_.add_folder(folder.empty() ? "." : folder);
    auto holder = std::make_shared<ObjectDescription>();
    SceneXml result;
    try {
      read_document(text, name, *holder, 0);
    } catch (const Stop&) {
      return result;
    }
    if (!holder->properties.empty()) {
      resolve_references(objects_, std::move(ids_), aliases_, diagnostics_);
      const std::vector<ObjectDescription*> ordered = break_cycles(objects_, diagnostics_);
      limit_expansion(ordered, kMaxNesting, diagnostics_);
      evaluate_spectra(ordered);
      defines_.report_unused(name, diagnostics_);
      result.scene = std::get<ObjectPtr>(holder->properties[0].value);
    }
    result.hash = hash_bytes(digest_);
    return result;
  }

 private:
  struct Document {
    XmlDocument xml;
    bool old;       // version 0.x or 1.x
    bool replaces;  // a parameter that is given again replaces the first one, with a warning: before version 3
  };
  /// Thrown when a limit is exceeded: reading stops at once, since going on would take the time and memory that it
  /// guards.
  struct Stop {};

  [[noreturn]] void stop(const SourceLocation& where, const std::string& message) {
    diagnostics_.error(where, message);
    throw Stop();
  }

  // ---- files ----

  void read_document(std::string_view text, const std::string& name, ObjectDescription& parent, int depth) {
    n_text_bytes_ += text.size();
    if (n_text_bytes_ > kMaxTextBytes)
      stop({name}, fmt::format("the scene and what it includes have more than {} bytes of text", kMaxTextBytes));
    digest_ += hash_text(hash_bytes(text)) + "\n";
    Document document{{text, name, diagnostics_}, false, false};
    const pugi::xml_node root = document.xml.root();
    if (!root) return;
    const SourceLocation where = document.xml.where(root);
    if (depth == 0 && std::string_view(root.name()) != "scene") {
      diagnostics_.error(where, fmt::format("the root element is <{}>; a scene file starts with <scene>", root.name()));
      return;
    }
    if (!contains(kObjectTags, root.name())) {
      diagnostics_.error(where, fmt::format("the root element of an included file cannot be <{}>", root.name()));
      return;
    }
    const int version = read_version(root, where);
    document.old = version < 2, document.replaces = version < 3;
    if (depth > 0 && std::string_view(root.name()) == "scene") {
      check_root_attributes(root, where);
      read_children(document, root, parent, depth, 0);  // as if the content replaced <include>
    } else {
      read_object(document, root, parent, depth, 0, true);
    }
  }

  /// Major version of the file format; the newest one after an error.
  int read_version(pugi::xml_node root, const SourceLocation& where) {
    const pugi::xml_attribute attribute = root.attribute("version");
    if (!attribute) {
      diagnostics_.error(where,
                         fmt::format("<{}> has no attribute 'version'; add version=\"3.0.0\", or \"0.6.0\" if the "
                                     "file uses names like 'toWorld'",
                                     root.name()));
      return kNewestVersion;
    }
    const std::string_view text = attribute.value();
    int parts[3] = {0, 0, 0};
    const char* p = text.data();
    const char* const end = p + text.size();
    bool valid = false;
    for (int& part : parts) {
      const auto [next, error] = std::from_chars(p, end, part);
      valid = error == std::errc() && part >= 0 && (next == end || *next == '.');
      if (!valid || next == end) break;
      p = next + 1;
      valid = false;  // a dot must be followed by a number
    }
    if (!valid) {
      diagnostics_.error(where, fmt::format("version '{}' is not of the form 3.0.0", text));
      return kNewestVersion;
    }
    if (parts[0] > kNewestVersion) {
      diagnostics_.error(where, fmt::format("version '{}' is not known; expected 0.x to {}.x", text, kNewestVersion));
      return kNewestVersion;
    }
    return parts[0];
  }

  void check_root_attributes(pugi::xml_node root, const SourceLocation& where) {
    const XmlAttributes checked(root, where, defines_, {"version", "id", "name"}, diagnostics_);
  }

  void read_include(const Document& document, pugi::xml_node node, ObjectDescription& parent, int depth) {
    const SourceLocation where = document.xml.where(node);
    const XmlAttributes attributes(node, where, defines_, {"!filename", "name"}, diagnostics_);
    if (!attributes.complete()) return;
    if (depth + 1 >= kMaxIncludeDepth) {
      diagnostics_.error(where, fmt::format("more than {} nested includes", kMaxIncludeDepth));
      return;
    }
    const std::string path = files_.resolve(attributes.get("filename"), where, diagnostics_);
    if (path.empty()) return;
    if (++n_includes_ > kMaxIncludes) stop(where, fmt::format("more than {} includes", kMaxIncludes));
    try {
      const FileView file(path);
      const size_t before = parent.properties.size();
      read_document(file.text(), path, parent, depth + 1);
      if (!attributes.get("name").empty() && parent.properties.size() == before + 1)
        parent.properties.back().name = attributes.get("name");
    } catch (const Error& error) {
      diagnostics_.error(where, error.what());
    }
  }

  // ---- elements ----

  void read_children(const Document& document, pugi::xml_node node, ObjectDescription& object, int depth,
                     size_t nesting) {
    for (const pugi::xml_node child : node.children()) {
      if (child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata) {
        if (diagnostics_.ignores_unknown())
          diagnostics_.unknown(document.xml.where(node), fmt::format("text in <{}>", node.name()), "");
        else
          diagnostics_.error(document.xml.where(node),
                             fmt::format("<{}> holds text; parameters are elements", node.name()));
        continue;
      }
      if (child.type() != pugi::node_element) continue;
      const std::string_view tag = child.name();
      if (contains(kObjectTags, tag) || (tag == "spectrum" && child.attribute("type"))) {
        read_object(document, child, object, depth, nesting + 1, false);
      } else if (tag == "include") {
        read_include(document, child, object, depth);
      } else {
        read_property(document, child, object);
      }
    }
  }

  void read_object(const Document& document, pugi::xml_node node, ObjectDescription& parent, int depth, size_t nesting,
                   bool root) {
    const SourceLocation where = document.xml.where(node);
    if (nesting > kMaxNesting) {
      diagnostics_.error(where, fmt::format("more than {} nested objects", kMaxNesting));
      return;
    }
    const bool is_scene = std::string_view(node.name()) == "scene";
    if (is_scene && !root) {
      diagnostics_.error(where, "<scene> can only be the root element");
      return;
    }
    const XmlAttributes attributes =
        root ? (is_scene ? XmlAttributes(node, where, defines_, {"version", "id", "name"}, diagnostics_)
                         : XmlAttributes(node, where, defines_, {"version", "!type", "id", "name"}, diagnostics_))
             : XmlAttributes(node, where, defines_, {"!type", "id", "name"}, diagnostics_);
    auto object = std::make_shared<ObjectDescription>();
    object->type = is_scene ? "scene" : attributes.get("type");
    object->kind = kind_of(node.name(), object->type);
    object->id = attributes.get("id");
    object->where = where;
    objects_.push_back(object);
    if (objects_.size() > kMaxObjects) stop(where, fmt::format("more than {} objects", kMaxObjects));
    if (!object->id.empty()) {
      const auto [other, inserted] = ids_.emplace(object->id, object);
      if (!inserted)
        diagnostics_.error(where,
                           fmt::format("id '{}' is used twice; first at {}", object->id, other->second->where.text()));
    }
    read_children(document, node, *object, depth, nesting);
    if (document.old) upgrade_object(*object, diagnostics_);
    adopt_forms_of_forks(*object, document.old, diagnostics_);
    if (object->kind == "bsdf" && object->type == "mixturebsdf") expand_mixture(*object, objects_, diagnostics_);
    // A missing type was reported; users of the object must not report it again.
    add(document, parent, {attributes.get("name"), attributes.complete() ? ObjectPtr(object) : ObjectPtr(), where});
  }

  /// Reads anything that is not an object.
  void read_property(const Document& document, pugi::xml_node node, ObjectDescription& owner) {
    const std::string tag = node.name();
    const SourceLocation where = document.xml.where(node);
    if (tag != "transform" && tag != "animation") {
      for (const pugi::xml_node child : node.children())
        if (child.type() == pugi::node_element)
          diagnostics_.error(document.xml.where(child),
                             fmt::format("<{}> cannot stand inside <{}>", child.name(), tag));
    }
    if (contains(transform_tags(), tag)) {
      diagnostics_.error(where, fmt::format("<{}> can only stand inside <transform>", tag));
    } else if (!contains(kOtherTags, tag)) {
      std::vector<std::string> tags = kOtherTags;
      tags.insert(tags.end(), kObjectTags.begin(), kObjectTags.end());
      diagnostics_.unknown(where, fmt::format("element <{}>", tag), did_you_mean(tag, tags));
    } else if (tag == "default") {
      const XmlAttributes attributes(node, where, defines_, {"!name", "!value"}, diagnostics_);
      if (!attributes.complete()) return;
      if (attributes.get("name").empty()) {
        diagnostics_.error(where, "<default> needs a name that is not empty");
      } else {
        defines_.add_default(attributes.get("name"), attributes.get("value"));
      }
    } else if (tag == "alias") {
      const XmlAttributes attributes(node, where, defines_, {"!id", "!as"}, diagnostics_);
      if (attributes.complete()) aliases_.push_back({attributes.get("id"), attributes.get("as"), where});
    } else if (tag == "path") {
      read_path(node, where, owner);
    } else if (tag == "ref") {
      const XmlAttributes attributes(node, where, defines_, {"!id", "name"}, diagnostics_);
      if (!attributes.complete()) return;
      auto reference = std::make_shared<ObjectDescription>();  // placeholder until everything is read
      reference->kind = "ref", reference->id = attributes.get("id"), reference->where = where;
      add(document, owner, {attributes.get("name"), ObjectPtr(reference), where});
    } else {
      add(document, owner, PropertyReader(defines_, files_, diagnostics_, document.old).read(document.xml, node));
    }
  }

  void read_path(pugi::xml_node node, const SourceLocation& where, const ObjectDescription& owner) {
    const XmlAttributes attributes(node, where, defines_, {"!value"}, diagnostics_);
    if (!attributes.complete()) return;
    if (owner.kind != "scene") {
      diagnostics_.error(where, "<path> can only stand inside <scene>");
      return;
    }
    const fs::path value(attributes.get("value"));
    const fs::path folder = value.is_absolute() ? value : fs::path(where.file).parent_path() / value;
    std::error_code ignored;
    if (fs::is_directory(folder, ignored)) {
      files_.add_folder(folder.string());
    } else {
      diagnostics_.warn(where, fmt::format("folder '{}' not found", folder.string()));  // a missing file is an error
    }
  }

  /// Appends a property whose name must not be in use.
  void add(const Document& document, ObjectDescription& owner, Property property) {
    const auto same = [&](const Property& other) { return other.name == property.name; };
    const auto first = property.name.empty() ? owner.properties.end() : std::ranges::find_if(owner.properties, same);
    if (first == owner.properties.end()) return owner.properties.push_back(std::move(property));
    const std::string message = fmt::format("parameter '{}' of {} '{}' is given twice; first at {}", property.name,
                                            owner.kind, owner.type, first->where.text());
    if (!document.replaces) return diagnostics_.error(property.where, message);
    diagnostics_.warn(property.where, message + "; the last one counts, as in Mitsuba before version 3");
    *first = std::move(property);
  }

  /// Replaces <spectrum type="…"> objects by plain values wherever they are used. `objects`: each after what it holds.
  void evaluate_spectra(const std::vector<ObjectDescription*>& objects) {
    const auto is_spectrum = [](const Property& property) {
      const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
      return child && *child && (*child)->kind == "spectrum";
    };
    for (ObjectDescription* object : objects) {
      for (Property& property : object->properties)
        if (is_spectrum(property)) {
          Value value = spectrum_value(std::get<ObjectPtr>(property.value), diagnostics_);
          if (object->kind != "scene") property.value = std::move(value);  // there, it waits for references
        }
      if (object->kind == "scene") std::erase_if(object->properties, is_spectrum);
    }
  }

  XmlDefines defines_;
  FileResolver& files_;
  Diagnostics& diagnostics_;
  std::string digest_;
  SceneObjects objects_;  // all of them
  ObjectIds ids_;
  std::vector<SceneAlias> aliases_;
  size_t n_text_bytes_ = 0;
  int n_includes_ = 0;
};

}  // namespace

SceneXml read_scene_xml(std::string_view text, const std::string& name,
                        const std::map<std::string, std::string>& defines, FileResolver& files,
                        Diagnostics& diagnostics) {
  return Reader(defines, files, diagnostics).read(text, name);
}

}  // namespace covary
