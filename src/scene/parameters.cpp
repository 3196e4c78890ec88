// SPDX-License-Identifier: Apache-2.0
#include "scene/parameters.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <tuple>

namespace covary {

std::string SourceLocation::text() const {
  if (line <= 0) return file;
  return fmt::format("{}:{}:{}", file, line, column);
}

namespace {

constexpr size_t kMaxShown = 100, kMaxOfKind = 5;  // errors in one message

}  // namespace

// ---- Diagnostics ----------------------------------------------------------------------------------------------------

namespace {

/// "file:line:column: message"; only the message for a place outside of files.
std::string located(const SourceLocation& where, const std::string& message) {
  return where.file.empty() ? message : where.text() + ": " + message;
}

auto place(const SourceLocation& where) { return std::tie(where.file, where.line, where.column); }

}  // namespace

void Diagnostics::error(const SourceLocation& where, const std::string& message, const std::string& kind) {
  errors_.push_back({where, message, kind});
}

void Diagnostics::warn(const SourceLocation& where, const std::string& message) {
  warnings_.push_back(located(where, message));
}

void Diagnostics::unknown(const SourceLocation& where, const std::string& what, const std::string& hint,
                          const std::string& instead) {
  if (!ignores_unknown_) return error(where, "unknown " + what + hint);
  warn_shared(where, fmt::format("unknown {} {}", what, instead));
}

void Diagnostics::warn_shared(const SourceLocation& where, const std::string& message) {
  Places& entry = shared_[message];
  if (entry.n++ == 0 || place(where) < place(entry.first)) entry.first = where;
}

void Diagnostics::append(const Diagnostics& other) {
  errors_.insert(errors_.end(), other.errors_.begin(), other.errors_.end());
  warnings_.insert(warnings_.end(), other.warnings_.begin(), other.warnings_.end());
  for (const auto& [message, entry] : other.shared_) {
    Places& own = shared_[message];
    if (own.n == 0 || place(entry.first) < place(own.first)) own.first = entry.first;
    own.n += entry.n;
  }
}

std::vector<std::string> Diagnostics::warnings() const {
  std::vector<std::pair<std::string, Places>> shared(shared_.begin(), shared_.end());
  std::stable_sort(shared.begin(), shared.end(),
                   [](const auto& a, const auto& b) { return place(a.second.first) < place(b.second.first); });
  std::vector<std::string> texts = warnings_;
  for (const auto& [message, entry] : shared)
    texts.push_back(located(entry.first, message) + (entry.n > 1 ? fmt::format(" ({} times)", entry.n) : ""));
  return texts;
}

void Diagnostics::throw_if_errors() const {
  if (errors_.empty()) return;
  std::vector<Entry> sorted = errors_;
  const auto key = [](const Entry& e) { return std::tie(e.where.file, e.where.line, e.where.column, e.message); };
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Entry& a, const Entry& b) { return key(a) < key(b); });
  sorted.erase(
      std::unique(sorted.begin(), sorted.end(), [&](const Entry& a, const Entry& b) { return key(a) == key(b); }),
      sorted.end());
  std::vector<std::string> lines;
  std::map<std::string, size_t> of_kind;
  size_t more = 0;
  for (const Entry& e : sorted) {
    if (!e.kind.empty() && ++of_kind[e.kind] > kMaxOfKind) continue;
    if (lines.size() < kMaxShown)
      lines.push_back(located(e.where, e.message));
    else
      ++more;
  }
  for (const auto& [kind, n] : of_kind)
    if (n > kMaxOfKind) lines.push_back(fmt::format("… and {} more {}", n - kMaxOfKind, kind));
  if (more > 0) lines.push_back(fmt::format("… and {} more errors", more));
  throw Error(ErrorCode::kInput, fmt::format("{}", fmt::join(lines, "\n")));
}

// ---- Parameters -----------------------------------------------------------------------------------------------------

namespace {

/// "a float", "an rgb colour", "a bsdf", …: type of the value in the file, for messages.
std::string type_name(const Value& value) {
  struct Visitor {
    std::string operator()(bool) const { return "a boolean"; }
    std::string operator()(int64_t) const { return "an integer"; }
    std::string operator()(double) const { return "a float"; }
    std::string operator()(const std::string&) const { return "a string"; }
    std::string operator()(const Vec3&) const { return "a vector"; }
    std::string operator()(const ColourValue&) const { return "an rgb colour"; }
    std::string operator()(const SampledSpectrum&) const { return "a spectrum"; }
    std::string operator()(const Transform&) const { return "a transform"; }
    std::string operator()(const KeyedTransformPtr&) const { return "an animation"; }
    std::string operator()(const ObjectPtr& object) const {
      if (!object) return "a reference to nothing";
      return (object->kind == "emitter" || object->kind == "integrator" ? "an " : "a ") + object->kind;
    }
  };
  return std::visit(Visitor{}, value);
}

std::string quoted_list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "'" : ", '") + name + "'";
  return text;
}

/// "lie in [0, 1]", "be at least 0", …: the requirement on a value, where the numeric limit of a type means no bound.
template <typename T>
std::string range_text(T lowest, T highest) {
  const bool bounded_below = lowest > std::numeric_limits<T>::lowest();
  const bool bounded_above = highest < std::numeric_limits<T>::max();
  if (bounded_below && bounded_above) return fmt::format("lie in [{}, {}]", lowest, highest);
  if (bounded_below) return fmt::format("be at least {}", lowest);
  if (bounded_above) return fmt::format("be at most {}", highest);
  return "fit into a float";
}

std::string subject(const ObjectDescription& object) { return object.kind + " '" + object.type + "'"; }

}  // namespace

Parameters::Parameters(const ObjectDescription& object, ObjectFactory& factory, Diagnostics& diagnostics)
    : object_(object), factory_(factory), diagnostics_(diagnostics), used_(object.properties.size(), false) {}

const Property* Parameters::find(const std::string& name) {
  if (std::find(known_.begin(), known_.end(), name) == known_.end()) known_.push_back(name);
  for (size_t i = 0; i < object_.properties.size(); ++i) {
    const Property& property = object_.properties[i];
    if (property.name != name) continue;
    used_[i] = true;
    const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
    return object && !*object ? nullptr : &property;  // null: already reported as invalid when it was read
  }
  return nullptr;
}

bool Parameters::has(const std::string& name) {
  if (std::find(known_.begin(), known_.end(), name) == known_.end()) known_.push_back(name);
  return std::any_of(object_.properties.begin(), object_.properties.end(),
                     [&](const Property& p) { return p.name == name; });
}

void Parameters::error(const std::string& message) {
  diagnostics_.error(object_.where, subject(object_) + ": " + message);
}

void Parameters::error_at(const std::string& parameter, const std::string& message) {
  const Property* property = find(parameter);
  diagnostics_.error(property ? property->where : object_.where,
                     fmt::format("parameter '{}' of {} {}", parameter, subject(object_), message));
}

void Parameters::unknown(const std::string& what, const std::string& hint, const std::string& instead) {
  diagnostics_.unknown(object_.where, what, hint, instead);
}

void Parameters::warn(const std::string& message) {
  diagnostics_.warn(object_.where, subject(object_) + ": " + message);
}

bool Parameters::get_bool(const std::string& name, bool fallback) {
  const Property* property = find(name);
  if (!property) return fallback;
  if (const bool* value = std::get_if<bool>(&property->value)) return *value;
  error_at(name, "must be a boolean, not " + type_name(property->value));
  return fallback;
}

int Parameters::get_int(const std::string& name, int fallback, int lowest, int highest) {
  const Property* property = find(name);
  if (!property) return fallback;
  const int64_t* value = std::get_if<int64_t>(&property->value);
  if (!value) {
    error_at(name, "must be an integer, not " + type_name(property->value));
    return fallback;
  }
  if (*value < lowest || *value > highest) {
    // Without a bound of its own, a parameter is bounded by its type, which is worth a word only beyond it.
    error_at(name, *value > std::numeric_limits<int>::max()
                       ? fmt::format("is {}; it must be at most {}", *value, highest)
                       : fmt::format("is {}; it must {}", *value, range_text(lowest, highest)));
    return fallback;
  }
  return static_cast<int>(*value);
}

float Parameters::get_float(const std::string& name, float fallback, float lowest, float highest) {
  const Property* property = find(name);
  if (!property) return fallback;
  float value = 0;
  if (const double* number = std::get_if<double>(&property->value)) {
    value = static_cast<float>(*number);
    if (std::isinf(value)) {
      error_at(name, fmt::format("is {:g}, which is too large for a float", *number));
      return fallback;
    }
  } else if (const int64_t* integer = std::get_if<int64_t>(&property->value)) {
    value = static_cast<float>(*integer);
  } else {
    error_at(name, "must be a float, not " + type_name(property->value));
    return fallback;
  }
  if (!(value >= lowest && value <= highest) || !std::isfinite(value)) {
    error_at(name, fmt::format("is {}; it must {}", value, range_text(lowest, highest)));
    return fallback;
  }
  return value;
}

std::string Parameters::get_string(const std::string& name, const std::string& fallback) {
  const Property* property = find(name);
  if (!property) return fallback;
  if (const std::string* value = std::get_if<std::string>(&property->value)) return *value;
  error_at(name, "must be a string, not " + type_name(property->value));
  return fallback;
}

std::string Parameters::get_choice(const std::string& name, const std::string& fallback,
                                   const std::vector<std::string>& choices) {
  std::string value = get_string(name, fallback);
  if (std::find(choices.begin(), choices.end(), value) != choices.end()) return value;
  error_at(name,
           fmt::format("is '{}'; expected one of {}{}", value, quoted_list(choices), did_you_mean(value, choices)));
  return fallback;
}

std::string Parameters::require_string(const std::string& name) {
  if (find(name)) return get_string(name, "");
  if (!has(name)) error(fmt::format("the string '{}' is missing", name));
  return "";
}

Vec3 Parameters::get_vec3(const std::string& name, const Vec3& fallback) {
  const Property* property = find(name);
  if (!property) return fallback;
  if (const Vec3* value = std::get_if<Vec3>(&property->value)) return *value;
  error_at(name, "must be a point or vector, not " + type_name(property->value));
  return fallback;
}

Transform Parameters::get_transform(const std::string& name) {
  const Property* property = find(name);
  if (!property) return {};
  if (const Transform* value = std::get_if<Transform>(&property->value)) return *value;
  error_at(name, "must be a transform, not " + type_name(property->value));
  return {};
}

KeyedTransformPtr Parameters::find_animation(const std::string& name) {
  const Property* property = find(name);
  const KeyedTransformPtr* value = property ? std::get_if<KeyedTransformPtr>(&property->value) : nullptr;
  return value ? *value : nullptr;
}

Spectrum Parameters::get_spectrum(const std::string& name, const Spectrum& fallback, SpectrumRole role) {
  const Property* property = find(name);
  if (!property) return fallback;
  if (const double* number = std::get_if<double>(&property->value)) return Spectrum(static_cast<float>(*number));
  if (const int64_t* integer = std::get_if<int64_t>(&property->value)) return Spectrum(static_cast<float>(*integer));
  if (const SampledSpectrum* spectrum = std::get_if<SampledSpectrum>(&property->value))
    return spectrum_to_rgb(*spectrum, role);
  if (const ColourValue* colour = std::get_if<ColourValue>(&property->value)) {
    const Spectrum& c = colour->rgb;
    if (role == SpectrumRole::kReflectance && !(c.r >= 0 && c.g >= 0 && c.b >= 0 && max_component(c) <= 1)) {
      error_at(name, fmt::format("is the colour ({}, {}, {}); reflectances must lie in [0, 1]", c.r, c.g, c.b));
      return fallback;
    }
    return c;
  }
  if (const ObjectPtr* object = std::get_if<ObjectPtr>(&property->value); object && (*object)->kind == "texture") {
    const auto texture = std::dynamic_pointer_cast<const Texture>(factory_.make(*object));
    if (!texture) return fallback;  // already reported
    if (texture->is_constant()) return texture->eval(SurfaceHit{});
  }
  error_at(name, "must be a float, rgb colour or spectrum, not " + type_name(property->value));
  return fallback;
}

TexturePtr Parameters::find_texture(const std::string& name, SpectrumRole role) {
  const Property* property = find(name);
  if (!property) return nullptr;
  const ObjectPtr* object = std::get_if<ObjectPtr>(&property->value);
  if (!object) {
    if (std::holds_alternative<bool>(property->value) || std::holds_alternative<std::string>(property->value) ||
        std::holds_alternative<Vec3>(property->value) || std::holds_alternative<Transform>(property->value)) {
      error_at(name, "must be a texture, float, rgb colour or spectrum, not " + type_name(property->value));
      return nullptr;
    }
    return std::make_shared<ConstantTexture>(get_spectrum(name, Spectrum(0), role));
  }
  if ((*object)->kind != "texture") {
    error_at(name, "must be a texture, float, rgb colour or spectrum, not " + type_name(property->value));
    return nullptr;
  }
  return std::dynamic_pointer_cast<const Texture>(factory_.make(*object));
}

TexturePtr Parameters::get_texture(const std::string& name, const Spectrum& fallback, SpectrumRole role) {
  if (TexturePtr texture = find_texture(name, role)) return texture;
  return std::make_shared<ConstantTexture>(fallback);
}

TexturePtr Parameters::get_texture(const std::string& name, float fallback) {
  return get_texture(name, Spectrum(fallback));
}

bool Parameters::holds_object(const std::string& name) {
  const Property* property = find(name);
  return property && std::holds_alternative<ObjectPtr>(property->value);
}

std::shared_ptr<const SceneObject> Parameters::find_object(const std::string& name, const std::string& kind) {
  const Property* property = find(name);
  if (!property) return nullptr;
  const ObjectPtr* object = std::get_if<ObjectPtr>(&property->value);
  if (object && (*object)->kind == kind) return factory_.make(*object);
  error_at(name, fmt::format("must be a {}, not {}", kind, type_name(property->value)));
  return nullptr;
}

std::string Parameters::require_file(const std::string& name) {
  const Property* property = find(name);
  const std::string file = require_string(name);
  if (file.empty()) {
    if (property && std::holds_alternative<std::string>(property->value)) error_at(name, "must not be empty");
    return "";
  }
  return factory_.resolve_file(file, property->where).value_or("");
}

std::vector<std::shared_ptr<const SceneObject>> Parameters::child_objects(const std::string& kind) {
  std::vector<std::shared_ptr<const SceneObject>> result;
  for (size_t i = 0; i < object_.properties.size(); ++i) {
    const ObjectPtr* object = std::get_if<ObjectPtr>(&object_.properties[i].value);
    if (used_[i] || !object || !*object || (*object)->kind != kind) continue;
    used_[i] = true;
    result.push_back(factory_.make(*object));
  }
  return result;
}

void Parameters::report_unknown() {
  std::vector<std::string> known = known_;
  std::sort(known.begin(), known.end());
  for (size_t i = 0; i < object_.properties.size(); ++i) {
    if (used_[i]) continue;
    const Property& property = object_.properties[i];
    const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
    if (object && !*object) continue;  // already reported as invalid when it was read
    if (property.name.empty()) {
      const std::string nested = object ? subject(**object) : type_name(property.value);
      if (diagnostics_.ignores_unknown())
        diagnostics_.unknown(property.where, fmt::format("part {} of {}", nested, subject(object_)), "");
      else
        diagnostics_.error(property.where, fmt::format("{} cannot hold {}", subject(object_), nested));
      continue;
    }
    std::string hint = did_you_mean(property.name, known);
    if (hint.empty()) hint = known.empty() ? "; it has no parameters" : "; known: " + quoted_list(known);
    diagnostics_.unknown(property.where, fmt::format("parameter '{}' of {}", property.name, subject(object_)), hint);
  }
}

}  // namespace covary
