// SPDX-License-Identifier: Apache-2.0
#include "pbrt/pbrt_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <list>
#include <optional>

#include "core/content_hash.h"
#include "formats/file_resolver.h"
#include "formats/xml_values.h"
#include "pbrt/pbrt_world.h"

namespace covary {
namespace {

// Limits far above what scenes need, but low enough that no small file takes long or much memory.
constexpr int kMaxIncludes = 1000, kDeepest = 15;
constexpr size_t kMaxTextBytes = size_t{1} << 30;  // of all files together
constexpr size_t kMaxStates = 1000;

constexpr std::string_view kDirectives =
    "Accelerator ActiveTransform AreaLightSource Attribute AttributeBegin AttributeEnd Camera ColorSpace "
    "ConcatTransform CoordinateSystem CoordSysTransform Film Identity Import Include Integrator LightSource LookAt "
    "MakeNamedMaterial MakeNamedMedium Material MediumInterface NamedMaterial ObjectBegin ObjectEnd ObjectInstance "
    "Option PixelFilter ReverseOrientation Rotate Sampler Scale Shape Texture Transform TransformBegin TransformEnd "
    "TransformTimes Translate WorldBegin WorldEnd";

/// Colour spaces of pbrt-v4 (colorspace.cpp) to Rec. 709: inverse of Rec. 709's matrix to XYZ times that of the space,
/// adapted to D65 by Bradford's matrix where its white is another (ACES).
const std::map<std::string, ColourMatrix> kColourSpaces = {
    {"rec2020",
     {{{1.660491f, -0.587641f, -0.072850f}, {-0.124550f, 1.132900f, -0.008349f}, {-0.018151f, -0.100579f, 1.118730f}}}},
    {"dci-p3", {{{1.224940f, -0.224940f, 0}, {-0.042057f, 1.042057f, 0}, {-0.019638f, -0.078636f, 1.098274f}}}},
    {"aces2065-1",
     {{{2.521686f, -1.134131f, -0.387555f},
       {-0.276480f, 1.372719f, -0.096239f},
       {-0.015378f, -0.152975f, 1.168353f}}}}};

class Reader {
 public:
  Reader(FileResolver& files, Diagnostics& diagnostics)
      : files_(files), messages_(diagnostics), names_(files, messages_, diagnostics) {}

  SceneXml read(std::string_view text, const std::string& name) {
    const std::string folder = std::filesystem::path(name).parent_path().string();
    files_.add_folder(folder.empty() ? "." : folder);
    const ObjectBuilder scene = make_object("scene", "scene", {name, 1, 1});
    world_.emplace(names_, messages_, scene);
    SceneXml result;
    try {
      read_file(text, name, nullptr, 0);
      if (!in_world_) messages_.error(scene->where, "the scene has no WorldBegin");
      if (!states_.empty() && names_.version_3)
        messages_.warn(states_.back().where, "this block is never ended; it ends with the file, as in version 3");
      else if (!states_.empty())
        messages_.error(states_.back().where, "unterminated block");
      if (in_object_) messages_.error(object_where_, "this object has no ObjectEnd");
      view_.version_3 = names_.version_3;
      world_->finish(view_);
    } catch (const PbrtStop&) {
      messages_.flush();
      return result;  // the reason has been reported
    }
    for (const ObjectPtr& object : finish_pbrt_view(std::move(view_), scene->where, messages_))
      set_property(*scene, "", object);
    messages_.flush();
    result.scene = scene;
    result.hash = hash_bytes(digest_);
    return result;
  }

 private:
  struct SavedState {
    PbrtState state;
    bool whole;  // AttributeBegin; otherwise TransformBegin
    SourceLocation where;
  };

  void read_file(std::string_view text, const std::string& name, PbrtTokens* outer, int depth) {
    n_text_bytes_ += text.size();
    if (n_text_bytes_ > kMaxTextBytes) {
      messages_.error({name, 1, 1}, fmt::format("the scene has more than {} bytes of text", kMaxTextBytes));
      throw PbrtStop();
    }
    digest_ += hash_text(hash_bytes(text)) + "\n";
    PbrtTokens tokens(text, name, messages_, outer);
    while (!tokens.at_end() && !ended_) {
      const PbrtToken token = tokens.next();
      if (token.kind != PbrtToken::kWord)
        tokens.stop(token, fmt::format("found '{}'; expected a directive", token.text));
      where_ = tokens.where(token);
      ++order_;
      directive(token, tokens, depth);
    }
  }

  void directive(const PbrtToken& token, PbrtTokens& tokens, int depth) {
    const std::string& word = token.text;
    if (change_placement(word, tokens, where_, state_.placement, systems_, messages_)) return;
    if (block(word, tokens) || view(word, tokens) || medium(word, tokens) || world(word, tokens)) return;
    if (word == "Include" || word == "Import") {
      const PbrtState before = state_;
      include(tokens.string("a file"), tokens, depth);
      if (word == "Import") state_ = before;
    } else if (word == "ColorSpace") {
      colour_space(tokens.string("a colour space"));
    } else if (word == "Option") {
      option(tokens);
    } else if (word == "Attribute") {
      attribute(tokens);
    } else if (word == "Accelerator") {
      tokens.string("a name");
      parameters(tokens, "Accelerator");
    } else {
      const auto known = split_list(kDirectives);
      const bool version_2 = word == "Renderer" || word == "SurfaceIntegrator" || word == "VolumeIntegrator";
      tokens.stop(token, fmt::format("'{}' is not a supported directive{}", word,
                                     version_2 ? ": this is a scene of pbrt-v2; versions 3 and 4 are read"
                                               : did_you_mean(word, {known.begin(), known.end()})));
    }
  }

  void colour_space(const std::string& name) {
    const auto found = kColourSpaces.find(name);
    state_.rec709 = found == kColourSpaces.end() ? nullptr : &found->second;
    if (found == kColourSpaces.end() && name != "srgb")
      messages_.error(where_, fmt::format("colour space '{}' is not supported; supported: 'aces2065-1', 'dci-p3', "
                                          "'rec2020' and 'srgb'",
                                          name));
  }

  /// Option "name" value; also as a parameter list. Warns about those that change the picture.
  void option(PbrtTokens& tokens) {
    std::string name = tokens.string("a name"), value = "true";
    name = name.substr(name.find_last_of(" \t") + 1);
    if (tokens.peek().kind == PbrtToken::kOpen) {
      tokens.next();
      while (tokens.peek().kind != PbrtToken::kClose && tokens.peek().kind != PbrtToken::kEnd)
        value = tokens.next().text;
      tokens.next();
    } else {
      value = tokens.next().text;
    }
    if (value != "false" && (name == "disablepixeljitter" || name == "forcediffuse"))
      messages_.warn(where_, fmt::format("option '{}' has no effect here: {}", name,
                                         name == "forcediffuse" ? "materials stay what they are"
                                                                : "samples are spread over their pixels"));
  }

  void attribute(PbrtTokens& tokens) {
    const std::string target = tokens.string("a kind of object");
    const PbrtParameters given = parameters(tokens, fmt::format("Attribute \"{}\"", target));
    auto all = std::make_shared<std::vector<PbrtParameter>>(given.all());
    if (const auto& before = state_.defaults[target])
      for (const PbrtParameter& parameter : *before)
        if (!given.has(parameter.name)) all->push_back(parameter);
    state_.defaults[target] = all;
  }

  bool block(const std::string& word, PbrtTokens& tokens) {
    if (word == "AttributeBegin" || word == "TransformBegin") {
      push(word == "AttributeBegin");
    } else if (word == "AttributeEnd" || word == "TransformEnd") {
      pop(word == "AttributeEnd");
    } else if (word == "WorldBegin") {
      if (in_world_) messages_.error(where_, "a second WorldBegin");
      in_world_ = true;
      state_.placement.to_world = Transform();
      state_.placement.at_start = state_.placement.at_end = true;
      systems_["world"] = Transform();
    } else if (word == "WorldEnd") {  // version 3; another picture may follow
      ended_ = true;
    } else if (word == "ObjectBegin") {
      const std::string name = tokens.string("a name");
      push(true);
      world_->begin_object(name, where_);
      in_object_ = true, object_where_ = where_;
    } else if (word == "ObjectEnd") {
      if (!world_->end_object())
        messages_.error(where_, "ObjectEnd without ObjectBegin");
      else
        pop(true);
      in_object_ = false;
    } else if (word == "ObjectInstance") {
      const std::string name = tokens.string("the name of an object");
      if (!state_.placement.flat) world_->place_instance(name, state_.placement.to_world, where_);
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
    note_version(word, type);
    if (in_world_) {
      p.error("stands behind WorldBegin");
    } else if (word == "Camera") {
      if (state_.placement.flat) p.error("has a singular transformation");
      read_pbrt_camera(type, p, state_.placement.to_world, files_, view_);
      world_->camera_medium(view_.sensor, state_.outside);
      systems_["camera"] = state_.placement.to_world.inverse();
    } else {
      reader->second(type, p, view_);
    }
    p.report_unknown(names_.version_3);
    return true;
  }

  bool medium(const std::string& word, PbrtTokens& tokens) {
    if (word == "MakeNamedMedium") {
      const std::string name = tokens.string("a name");
      PbrtParameters p = parameters(tokens, fmt::format("{} \"{}\"", word, name), "medium");
      const std::string type = p.get_string("type", "");
      names_.define(PbrtKind::kMedium, name, type, std::move(p), state_.placement.to_world);
    } else if (word == "MediumInterface") {
      const std::string inside = tokens.string("the name of a medium");
      const std::string outside =
          tokens.peek().kind == PbrtToken::kString ? tokens.string("the name of a medium") : inside;
      state_.inside = inside.empty() ? nullptr : use(inside);
      state_.outside = outside.empty() ? nullptr : use(outside);
    } else {
      return false;
    }
    return true;
  }

  bool world(const std::string& word, PbrtTokens& tokens) {
    if (word == "Texture") {
      read_texture(tokens);
      return true;
    }
    if (word == "NamedMaterial") {
      state_.material = use(tokens.string("the name of a material"));
      return true;
    }
    static const std::map<std::string, std::string> kTargets = {{"Material", "material"},
                                                                {"MakeNamedMaterial", "material"},
                                                                {"Shape", "shape"},
                                                                {"LightSource", "light"},
                                                                {"AreaLightSource", "light"}};
    const auto target = kTargets.find(word);
    if (target == kTargets.end()) return false;
    const std::string type = tokens.string(word == "MakeNamedMaterial" ? "a name" : "a type");
    PbrtParameters p = parameters(tokens, fmt::format("{} \"{}\"", word, type), target->second);
    if (!in_world_) p.error("stands before WorldBegin");
    if (word == "Material") {
      note_version("Material", type);
      auto own = std::make_shared<PbrtDefinition>(
          PbrtDefinition{PbrtKind::kMaterial, "", type, std::move(p), state_.placement.to_world});
      state_.material = std::make_shared<PbrtUse>(PbrtUse{own, "", order_, where_});
    } else if (word == "MakeNamedMaterial") {
      const std::string kind = p.get_string("type", "");
      note_version("Material", kind);
      names_.define(PbrtKind::kMaterial, type, kind, std::move(p), state_.placement.to_world);
    } else if (word == "AreaLightSource") {
      state_.area_light = std::make_shared<PbrtAreaLight>(PbrtAreaLight{type, std::move(p)});
    } else if (state_.placement.flat) {
      p.ignore_all();
    } else if (word == "LightSource") {
      world_->light(type, std::move(p), state_.placement.to_world);
    } else {
      world_->shape(type, p, state_);
    }
    return true;
  }

  void read_texture(PbrtTokens& tokens) {
    const std::string name = tokens.string("a name");
    std::string kind = tokens.string("'float' or 'spectrum'");
    if (kind == "color") kind = "spectrum";  // version 3
    const std::string type = tokens.string("a type");
    PbrtParameters p = parameters(tokens, fmt::format("Texture \"{}\" \"{}\"", kind, type), "texture");
    if (kind != "float" && kind != "spectrum")
      p.error("has an unknown kind; expected \"float\" or \"spectrum\"");
    else
      names_.define(kind == "float" ? PbrtKind::kFloatTexture : PbrtKind::kSpectrumTexture, name, type, std::move(p),
                    state_.placement.to_world);
  }

  void include(const std::string& name, PbrtTokens& tokens, int depth) {
    const SourceLocation where = where_;
    if (depth + 1 >= kDeepest || ++n_includes_ > kMaxIncludes) {
      messages_.error(where, fmt::format("more than {} files inside each other, or {} in all", kDeepest, kMaxIncludes));
      throw PbrtStop();
    }
    Diagnostics missing;
    const std::string path = files_.resolve(name, where, missing);
    try {
      missing.throw_if_errors();
      const FileView file(path);
      const std::string& kept = file_names_.emplace_back(path);  // tokens refer to it
      read_file(file.text(), kept, &tokens, depth + 1);
    } catch (const Error& error) {
      const std::string text = error.what(), place = where.text() + ": ";
      messages_.error(where, text.starts_with(place) ? text.substr(place.size()) : text);
    }
  }

  PbrtUsePtr use(const std::string& name) { return std::make_shared<PbrtUse>(PbrtUse{nullptr, name, order_, where_}); }
  /// Version 3 does not say so; it has names of its own.
  void note_version(const std::string& directive, const std::string& type) {
    names_.version_3 |= is_pbrt_3(directive, type);
    view_.version_3 = names_.version_3;
  }
  PbrtParameters parameters(PbrtTokens& tokens, std::string what, const std::string& target = "") {
    PbrtContext context{order_, state_.rec709, nullptr};
    if (const auto found = state_.defaults.find(target); found != state_.defaults.end())
      context.defaults = found->second.get();
    return {tokens, std::move(what), where_, messages_, context};
  }
  void push(bool whole) {
    if (states_.size() >= kMaxStates) {
      messages_.error(where_, fmt::format("more than {} nested blocks", kMaxStates));
      throw PbrtStop();
    }
    states_.push_back({state_, whole, where_});
  }
  void pop(bool whole) {
    if (states_.empty() || states_.back().whole != whole) {
      messages_.error(where_, "the end of a block that was never begun");
      throw PbrtStop();
    }
    if (whole)
      state_ = std::move(states_.back().state);
    else
      state_.placement = states_.back().state.placement;
    states_.pop_back();
  }

  FileResolver& files_;
  PbrtMessages messages_;
  PbrtNames names_;
  std::optional<PbrtWorld> world_;
  std::string digest_;
  PbrtView view_;
  PbrtState state_;
  std::vector<SavedState> states_;
  PbrtSystems systems_;
  std::list<std::string> file_names_;
  SourceLocation where_, object_where_;  // of the directive
  size_t order_ = 0;                     // its number
  bool in_world_ = false, in_object_ = false, ended_ = false;
  size_t n_text_bytes_ = 0;
  int n_includes_ = 0;
};

}  // namespace

SceneXml read_scene_pbrt(std::string_view text, const std::string& name, FileResolver& files,
                         Diagnostics& diagnostics) {
  return Reader(files, diagnostics).read(text, name);
}

}  // namespace covary
