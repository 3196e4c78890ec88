// SPDX-License-Identifier: Apache-2.0
#include "formats/pbrt_reader.h"

#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "core/content_hash.h"
#include "formats/file_resolver.h"
#include "formats/pbrt_objects.h"
#include "formats/pbrt_parameters.h"
#include "formats/pbrt_surfaces.h"
#include "formats/scene_references.h"
#include "formats/xml_values.h"

namespace covary {
namespace {

// Limits far above what scenes need, but low enough that no small file takes long or much memory.
constexpr int kMostIncludes = 1000, kDeepest = 15;
constexpr size_t kMostTextBytes = size_t{1} << 30;  // of all files together
constexpr size_t kMostObjects = 1000000, kMostStates = 1000, kMostNesting = 64;

constexpr std::string_view kDirectives =
    "Accelerator AreaLightSource AttributeBegin AttributeEnd Camera ColorSpace ConcatTransform CoordinateSystem "
    "CoordSysTransform Film Identity Import Include Integrator LightSource LookAt MakeNamedMaterial MakeNamedMedium "
    "Material MediumInterface "
    "NamedMaterial ObjectBegin ObjectEnd ObjectInstance Option PixelFilter ReverseOrientation Rotate Sampler Scale "
    "Shape Texture Transform TransformBegin TransformEnd Translate WorldBegin";

class Reader {
 public:
  Reader(FileResolver& files, Diagnostics& diagnostics) : files_(files), diagnostics_(diagnostics) {}

  SceneXml read(std::string_view text, const std::string& name) {
    const std::string folder = std::filesystem::path(name).parent_path().string();
    files_.add_folder(folder.empty() ? "." : folder);
    scene_ = make_object("scene", "scene", {name, 1, 1});
    SceneXml result;
    try {
      read_file(text, name, 0);
    } catch (const PbrtStop&) {
      return result;  // the reason has been reported
    }
    if (!in_world_) diagnostics_.error(scene_->where, "the scene has no WorldBegin");
    if (!states_.empty()) diagnostics_.error(states_.back().where, "unterminated block");
    if (group_) diagnostics_.error(group_->where, "this object has no ObjectEnd");
    if (view_.without_media) leave_media_out();
    for (const ObjectPtr& object : finish_pbrt_view(std::move(view_), scene_->where)) add(object);
    result.scene = scene_;
    result.hash = hash_bytes(digest_);
    return result;
  }

 private:
  struct State {
    PbrtPlacement placement;
    ObjectPtr material, area_light, inside, outside;
    bool material_failed = false;  // reported already; users of it stay silent
  };
  /// The last curves, to which following ones with the same material are appended.
  struct Curves {
    ObjectBuilder shape;
    ObjectPtr material, inside, outside;
    ObjectBuilder group;
    bool is_of(const State& state, const ObjectBuilder& in) const {
      return shape && material == state.material && inside == state.inside && outside == state.outside && group == in;
    }
  };
  struct SavedState {
    State state;
    bool whole;  // AttributeBegin; otherwise TransformBegin
    SourceLocation where;
  };

  void read_file(std::string_view text, const std::string& name, int depth) {
    n_text_bytes_ += text.size();
    if (n_text_bytes_ > kMostTextBytes) {
      diagnostics_.error({name, 1, 1}, fmt::format("the scene has more than {} bytes of text", kMostTextBytes));
      throw PbrtStop();
    }
    digest_ += hash_text(hash_bytes(text)) + "\n";
    PbrtTokens tokens(text, name, diagnostics_);
    while (!tokens.at_end()) {
      const PbrtToken token = tokens.next();
      if (token.kind != PbrtToken::kWord)
        tokens.stop(token, fmt::format("found '{}'; expected a directive", token.text));
      where_ = tokens.where(token);
      directive(token, tokens, depth);
    }
  }

  void directive(const PbrtToken& token, PbrtTokens& tokens, int depth) {
    const std::string& word = token.text;
    if (change_placement(word, tokens, where_, state_.placement, systems_, diagnostics_)) return;
    if (block(word, tokens) || view(word, tokens) || medium(word, tokens) || world(word, tokens)) return;
    if (word == "Include" || word == "Import") {
      const State before = state_;
      include(tokens.string("a file"), depth);
      if (word == "Import") state_ = before;
    } else if (word == "ColorSpace") {
      if (const std::string name = tokens.string("a colour space"); name != "srgb")
        diagnostics_.error(where_, fmt::format("colour space '{}' is not supported; supported: 'srgb'", name));
    } else if (word == "Option") {
      parameters(tokens, "Option").ignore({});
    } else if (word == "Accelerator") {
      tokens.string("a name");
      parameters(tokens, "Accelerator");
    } else {
      const auto known = split_list(kDirectives);
      tokens.stop(token, fmt::format("'{}' is not a supported directive{}", word,
                                     did_you_mean(word, {known.begin(), known.end()})));
    }
  }

  bool block(const std::string& word, PbrtTokens& tokens) {
    if (word == "AttributeBegin" || word == "TransformBegin") {
      push(word == "AttributeBegin");
    } else if (word == "AttributeEnd" || word == "TransformEnd") {
      pop(word == "AttributeEnd");
    } else if (word == "WorldBegin") {
      if (in_world_) diagnostics_.error(where_, "a second WorldBegin");
      in_world_ = true;
      state_.placement.to_world = Transform();
      systems_["world"] = Transform();
    } else if (word == "ObjectBegin") {
      const std::string name = tokens.string("a name");
      push(true);
      if (group_) diagnostics_.error(where_, "an object inside an object");
      group_ = make_object("shape", "shapegroup", where_);
      group_->id = name;
      if (!groups_.emplace(name, group_).second)
        diagnostics_.error(where_, fmt::format("a second object has the name '{}'", name));
    } else if (word == "ObjectEnd") {
      if (!group_) {
        diagnostics_.error(where_, "ObjectEnd without ObjectBegin");
        return true;
      }
      pop(true);
      if (group_->properties.empty()) {
        groups_[group_->id] = nullptr;  // its instances place nothing
      } else {
        add(group_);
      }
      group_ = nullptr;
    } else if (word == "ObjectInstance") {
      place_instance(tokens.string("the name of an object"));
    } else {
      return false;
    }
    return true;
  }

  bool view(const std::string& word, PbrtTokens& tokens) {
    using Read = void (*)(const std::string&, PbrtParameters&, PbrtView&);
    static const std::map<std::string, Read> kReaders = {{"Film", read_pbrt_film},
                                                         {"PixelFilter", read_pbrt_filter},
                                                         {"Sampler", read_pbrt_sampler},
                                                         {"Integrator", read_pbrt_integrator}};
    const auto reader = kReaders.find(word);
    if (reader == kReaders.end() && word != "Camera") return false;
    const std::string type = tokens.string("a type");
    PbrtParameters p = parameters(tokens, fmt::format("{} \"{}\"", word, type));
    if (in_world_) {
      p.error("stands behind WorldBegin");
    } else if (word == "Camera") {
      read_pbrt_camera(type, p, state_.placement.to_world, view_);
      if (state_.outside && view_.sensor) {
        set_property(*view_.sensor, "", state_.outside);
        with_media_.push_back(view_.sensor);
      }
      systems_["camera"] = state_.placement.to_world.inverse();
    } else {
      reader->second(type, p, view_);
    }
    p.report_unknown();
    return true;
  }

  bool medium(const std::string& word, PbrtTokens& tokens) {
    if (word == "MakeNamedMedium") {
      const std::string name = tokens.string("a name");
      PbrtParameters p = parameters(tokens, fmt::format("{} \"{}\"", word, name));
      const ObjectBuilder made = make_pbrt_medium(p.get_string("type", ""), p);
      if (made) made->id = name;
      names_.media[name] = made;
      p.report_unknown();
    } else if (word == "MediumInterface") {
      const std::string inside = tokens.string("the name of a medium");
      const std::string outside =
          tokens.peek().kind == PbrtToken::kString ? tokens.string("the name of a medium") : inside;
      state_.inside = named_medium(inside);
      state_.outside = named_medium(outside);
    } else {
      return false;
    }
    return true;
  }

  ObjectPtr named_medium(const std::string& name) {
    const auto found = names_.media.find(name);
    if (found == names_.media.end() && !name.empty())
      diagnostics_.error(where_, fmt::format("no medium before this one has the name '{}'", name));
    return found == names_.media.end() ? nullptr : found->second;
  }

  bool world(const std::string& word, PbrtTokens& tokens) {
    if (word == "Texture") {
      read_texture(tokens);
      return true;
    }
    if (word == "NamedMaterial") {
      const std::string name = tokens.string("the name of a material");
      const auto found = names_.materials.find(name);
      if (found == names_.materials.end())
        diagnostics_.error(where_, fmt::format("no material has the name '{}'", name));
      state_.material = found == names_.materials.end() ? nullptr : found->second;
      state_.material_failed = !state_.material;
      return true;
    }
    if (word != "Material" && word != "MakeNamedMaterial" && word != "Shape" && word != "LightSource" &&
        word != "AreaLightSource")
      return false;
    const std::string type = tokens.string(word == "MakeNamedMaterial" ? "a name" : "a type");
    PbrtParameters p = parameters(tokens, fmt::format("{} \"{}\"", word, type));
    if (!in_world_) p.error("stands before WorldBegin");
    if (word == "Material") {
      state_.material = limited(make_pbrt_material(type, p, names_));
      state_.material_failed = !state_.material;
    } else if (word == "MakeNamedMaterial") {
      const ObjectBuilder material = limited(make_pbrt_material(p.get_string("type", ""), p, names_));
      if (material) material->id = type;
      names_.materials[type] = material;
    } else if (word == "AreaLightSource") {
      state_.area_light = make_pbrt_area_light(type, p, view_.exposure());
    } else if (word == "LightSource") {
      if (const ObjectPtr light = make_pbrt_light(type, p, state_.placement.to_world, view_.exposure())) add(light);
    } else {
      read_shape(type, p);
    }
    p.report_unknown();
    return true;
  }

  /// As some integrators of pbrt do.
  void leave_media_out() {
    if (with_media_.empty()) return;
    diagnostics_.warn(view_.integrator->where,
                      "this integrator of pbrt leaves media out: so do we; 'volpath' has them");
    for (const ObjectBuilder& object : with_media_)
      std::erase_if(object->properties, [](const Property& p) {
        const ObjectPtr* child = std::get_if<ObjectPtr>(&p.value);
        return child && *child && (*child)->kind == "medium";
      });
  }

  void read_texture(PbrtTokens& tokens) {
    const std::string name = tokens.string("a name"), kind = tokens.string("'float' or 'spectrum'");
    const std::string type = tokens.string("a type");
    PbrtParameters p = parameters(tokens, fmt::format("Texture \"{}\" \"{}\"", kind, type));
    if (kind != "float" && kind != "spectrum") {
      p.error("has an unknown kind; expected \"float\" or \"spectrum\"");
      return;
    }
    if (const ObjectBuilder texture = limited(make_pbrt_texture(type, p, names_))) {
      texture->id = name;
      (kind == "float" ? names_.float_textures : names_.spectrum_textures)[name] = texture;
    }
    p.report_unknown();
  }

  void read_shape(const std::string& type, PbrtParameters& p) {
    const auto alpha = float_value(p, "alpha", 1, names_);
    const auto [shape, uv] = make_pbrt_shape(type, p, state_.placement, files_);
    if (!shape || !alpha) return;
    const bool opaque = std::holds_alternative<double>(*alpha) && std::get<double>(*alpha) >= 1;
    if (type == "curve" && opaque && !state_.area_light && curves_.is_of(state_, group_) &&
        join_pbrt_curves(*curves_.shape, *shape))
      return;
    curves_ = {type == "curve" && opaque ? shape : nullptr, state_.material, state_.inside, state_.outside, group_};
    if (!state_.material_failed) set_property(*shape, "", surfaces_.make(state_.material, *alpha, uv, p));
    if (state_.inside || state_.outside) with_media_.push_back(shape);
    if (state_.inside) set_property(*shape, "interior", state_.inside);
    if (state_.outside) set_property(*shape, "exterior", state_.outside);
    if (state_.area_light && group_)
      p.warn("emits no light, because it is part of an object that has instances");
    else if (state_.area_light)
      set_property(*shape, "", state_.area_light);
    if (group_) {
      count();
      set_property(*group_, "", ObjectPtr(shape));
    } else {
      add(shape);
    }
  }

  void place_instance(const std::string& name) {
    const auto found = groups_.find(name);
    if (found == groups_.end() || found->second == group_) {
      diagnostics_.error(where_, fmt::format("no object before this one has the name '{}'", name));
      return;
    }
    if (group_) {
      diagnostics_.error(where_, "an instance inside an object is not supported");
      return;
    }
    if (!found->second) return;
    auto instance = make_object("shape", "instance", where_,
                                {{"to_world", state_.placement.to_world}, {"", ObjectPtr(found->second)}});
    add(instance);
  }

  void include(const std::string& name, int depth) {
    const SourceLocation where = where_;
    if (name.ends_with(".gz")) {
      diagnostics_.error(where, "compressed files are not supported; use 'gunzip'");
      return;
    }
    if (depth + 1 >= kDeepest || ++n_includes_ > kMostIncludes) {
      diagnostics_.error(where,
                         fmt::format("more than {} files inside each other, or {} in all", kDeepest, kMostIncludes));
      throw PbrtStop();
    }
    const std::string path = files_.resolve(name, where, diagnostics_);
    if (path.empty()) return;
    try {
      const FileView file(path);
      read_file(file.text(), path, depth + 1);
    } catch (const Error& error) {
      diagnostics_.error(where, error.what());
    }
  }

  /// Null if it holds too many objects, which is an error.
  ObjectBuilder limited(ObjectBuilder object) { return object && limit_.add(*object) ? object : nullptr; }
  PbrtParameters parameters(PbrtTokens& tokens, std::string what) {
    return {tokens, std::move(what), where_, diagnostics_};
  }
  void push(bool whole) {
    if (states_.size() >= kMostStates) {
      diagnostics_.error(where_, fmt::format("more than {} nested blocks", kMostStates));
      throw PbrtStop();
    }
    states_.push_back({state_, whole, where_});
  }
  void pop(bool whole) {
    if (states_.empty() || states_.back().whole != whole) {
      diagnostics_.error(where_, "the end of a block that was never begun");
      throw PbrtStop();
    }
    if (whole)
      state_ = std::move(states_.back().state);
    else
      state_.placement.to_world = states_.back().state.placement.to_world;
    states_.pop_back();
  }
  void count() {
    if (++n_objects_ <= kMostObjects) return;
    diagnostics_.error(where_, fmt::format("more than {} objects", kMostObjects));
    throw PbrtStop();
  }
  void add(const ObjectPtr& object) {
    count();
    set_property(*scene_, "", object);
  }

  FileResolver& files_;
  Diagnostics& diagnostics_;
  ExpansionLimit limit_{kMostNesting, diagnostics_};
  std::string digest_;
  ObjectBuilder scene_, group_;
  PbrtView view_;
  PbrtNames names_;
  State state_;
  Curves curves_;
  std::vector<SavedState> states_;
  PbrtSystems systems_;
  std::map<std::string, ObjectBuilder> groups_;
  PbrtSurfaces surfaces_;
  std::vector<ObjectBuilder> with_media_;
  SourceLocation where_;  // of the directive
  bool in_world_ = false;
  size_t n_text_bytes_ = 0, n_objects_ = 0;
  int n_includes_ = 0;
};

}  // namespace

SceneXml read_scene_pbrt(std::string_view text, const std::string& name, FileResolver& files,
                         Diagnostics& diagnostics) {
  return Reader(files, diagnostics).read(text, name);
}

}  // namespace covary
