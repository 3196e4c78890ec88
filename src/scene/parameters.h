// SPDX-License-Identifier: Apache-2.0
// The description of one object of a scene file, and typed access to its parameters. Plugins (BSDFs, textures, …) are
// made from Parameters only; they never see XML. Whatever a plugin does not ask for is reported as an unknown
// parameter, with the names it did ask for as suggestions.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/keyed_transform.h"
#include "core/spectrum.h"
#include "core/transform.h"
#include "scene/object.h"
#include "scene/texture.h"

namespace covary {

struct SourceLocation {
  std::string file;
  int line = 0, column = 0;
  std::string text() const;  ///< "file:line:column"
};

/// Collects all problems of a scene so that they can be reported at once.
class Diagnostics {
 public:
  void error(const SourceLocation& where, const std::string& message);
  /// Harmless; a repeated message of the same kind should be counted by the caller and given once.
  void warn(const SourceLocation& where, const std::string& message);
  /// Takes over everything `other` holds; for objects that are made in parallel.
  void append(const Diagnostics& other);
  bool has_errors() const { return !errors_.empty(); }
  /// Throws Error(kInput) with all errors, sorted by file and line, one a line "file:line:column: message"; of more
  /// than 100 their number stands in place of the rest.
  void throw_if_errors() const;
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  struct Entry {
    SourceLocation where;
    std::string message;
  };
  std::vector<Entry> errors_;
  std::vector<std::string> warnings_;
};

/// A spectrum given by wavelength (nm) and value pairs, strictly increasing in wavelength, linear in between and zero
/// outside. A single pair is a constant spectrum (its wavelength does not matter): <spectrum value="0.5">.
struct SampledSpectrum {
  std::vector<std::pair<float, float>> samples;
};
/// <rgb>: three numbers taken as linear RGB.
struct ColourValue {
  Spectrum rgb;
};

struct ObjectDescription;
using ObjectPtr = std::shared_ptr<const ObjectDescription>;

/// A null ObjectPtr stands for a value that could not be read; the reason is in the diagnostics, and getters then
/// behave as if the parameter were absent.
using Value = std::variant<bool, int64_t, double, std::string, Vec3, ColourValue, SampledSpectrum, Transform,
                           KeyedTransformPtr, ObjectPtr>;

struct Property {
  std::string name;  ///< "" or "_arg_N" for nested objects without a name
  Value value;
  SourceLocation where;
};

/// One object of the file: <kind type="type" id="id" name="name"> … </kind>, references resolved.
struct ObjectDescription {
  std::string kind;  ///< "bsdf", "texture", "shape", "emitter", "sensor", "film", "rfilter", "sampler", "integrator", …
  std::string type, id;
  SourceLocation where;
  std::vector<Property> properties;
};

/// How a sampled spectrum becomes RGB. Reflectances are seen under D65, the white of linear RGB, and clamped to [0, 1];
/// indices of refraction likewise, but they may exceed 1. Emission is taken as it is.
enum class SpectrumRole { kReflectance, kEmission, kIndex };

class ObjectFactory;

/// Typed access. Every getter marks the name as known; a missing required parameter, a wrong type or a value out of
/// range is recorded in Diagnostics and the getter returns a usable default, so that all problems are found in one run.
class Parameters {
 public:
  Parameters(const ObjectDescription& object, ObjectFactory& factory, Diagnostics& diagnostics);

  const ObjectDescription& object() const { return object_; }
  const std::string& type() const { return object_.type; }
  bool has(const std::string& name);

  bool get_bool(const std::string& name, bool fallback);
  int get_int(const std::string& name, int fallback, int lowest, int highest);
  float get_float(const std::string& name, float fallback, float lowest = -kInfinity, float highest = kInfinity);
  std::string get_string(const std::string& name, const std::string& fallback);
  /// One of `choices`; anything else is an error that lists them.
  std::string get_choice(const std::string& name, const std::string& fallback, const std::vector<std::string>& choices);
  std::string require_string(const std::string& name);
  Vec3 get_vec3(const std::string& name, const Vec3& fallback);
  Transform get_transform(const std::string& name);  ///< identity when absent
  /// An <animation>; null when absent, and where it is a <transform>, which get_transform() then gives.
  KeyedTransformPtr find_animation(const std::string& name);
  /// A colour that may not be textured: number, rgb or spectrum.
  Spectrum get_spectrum(const std::string& name, const Spectrum& fallback, SpectrumRole role);
  /// A texture; numbers and colours become ConstantTexture.
  TexturePtr get_texture(const std::string& name, const Spectrum& fallback,
                         SpectrumRole role = SpectrumRole::kReflectance);
  TexturePtr get_texture(const std::string& name, float fallback);
  /// The same, null when absent.
  TexturePtr find_texture(const std::string& name, SpectrumRole role = SpectrumRole::kReflectance);
  /// File relative to the scene's search paths; "" and an error when it does not exist.
  std::string require_file(const std::string& name);

  /// All nested objects of class T that no other getter has taken, in file order ("bsdf" inside "twosided").
  /// `kind` is the tag they must have, e.g. "bsdf".
  template <typename T>
  std::vector<std::shared_ptr<const T>> children(const std::string& kind) {
    std::vector<std::shared_ptr<const T>> result;
    for (const std::shared_ptr<const SceneObject>& object : child_objects(kind))
      if (auto typed = std::dynamic_pointer_cast<const T>(object)) result.push_back(std::move(typed));
    return result;
  }

  /// Whether the parameter is a nested object, or a reference to one.
  bool holds_object(const std::string& name);
  /// The nested object of that name, null when absent; an error where it is not a <kind>.
  std::shared_ptr<const SceneObject> find_object(const std::string& name, const std::string& kind);

  /// Records an error about this object, or about one of its parameters.
  void error(const std::string& message);
  void error_at(const std::string& parameter, const std::string& message);
  void warn(const std::string& message);
  /// Reports every property nobody asked for. The factory calls it after the plugin was made.
  void report_unknown();

 private:
  std::vector<std::shared_ptr<const SceneObject>> child_objects(const std::string& kind);
  const Property* find(const std::string& name);

  const ObjectDescription& object_;
  ObjectFactory& factory_;
  Diagnostics& diagnostics_;
  std::vector<std::string> known_;
  std::vector<bool> used_;
};

/// Makes scene objects out of descriptions, each only once (objects referenced by id are shared). Implemented by io.
class ObjectFactory {
 public:
  virtual ~ObjectFactory() = default;
  /// Null when the object could not be made; the reason is then in the diagnostics.
  virtual std::shared_ptr<const SceneObject> make(const ObjectPtr& description) = 0;
  /// Absolute path of a file named in the scene; nullopt when no such file exists.
  virtual std::optional<std::string> resolve_file(const std::string& name, const SourceLocation& where) = 0;
};

/// One line of a module's registry: plugin name and how to make it. `make` returns null after recording an error.
template <typename T>
struct Plugin {
  const char* name;
  std::shared_ptr<T> (*make)(Parameters& parameters);
};

/// Linear Rec. 709 RGB of a sampled spectrum (CIE 1931 2° observer), negative components clamped to 0. A reflectance or
/// index of 1 everywhere maps to (1,1,1), within 0.2 % when it is sampled. An emission of 1 everywhere has Y = 1 and
/// the chromaticity of illuminant E, which is not neutral in this space: (1.205, 0.948, 0.909).
Spectrum spectrum_to_rgb(const SampledSpectrum& spectrum, SpectrumRole role);

}  // namespace covary
