// SPDX-License-Identifier: Apache-2.0
// The description of one object of a scene file, and typed access to its parameters. Plugins (BSDFs, textures, …) are
// constructed from Parameters only; they never see XML. Parameters that a plugin does not query are reported as
// unknown, with the queried names as suggestions.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
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
  /// `ignores_unknown`: what unknown() gets are warnings instead of errors.
  explicit Diagnostics(bool ignores_unknown = false) : ignores_unknown_(ignores_unknown) {}
  bool ignores_unknown() const { return ignores_unknown_; }

  /// Of errors with the same `kind`, a plural such as "files not found in 'a'", the first five are told and the others
  /// counted.
  void error(const SourceLocation& where, const std::string& message, const std::string& kind = "");
  /// Something that nothing here knows: `what`, e.g. "parameter 'x' of bsdf 'y'", as an error "unknown WHAT" followed
  /// by `hint`, or as a warning that names the first place and the number of places. `instead` ends the warning.
  void unknown(const SourceLocation& where, const std::string& what, const std::string& hint,
               const std::string& instead = "is ignored");
  /// Harmless problem; callers should count repeated messages of one kind and report them once.
  void warn(const SourceLocation& where, const std::string& message);
  /// The same, of a kind that many objects share: told once, with the first place and the number of places.
  void warn_shared(const SourceLocation& where, const std::string& message);
  /// Takes over all entries of `other`; for objects constructed in parallel.
  void append(const Diagnostics& other);
  bool has_errors() const { return !errors_.empty(); }
  /// Throws Error(kInput) with all errors, sorted by file and line, one per line as "file:line:column: message"; after
  /// 100 errors, the number of remaining ones.
  void throw_if_errors() const;
  /// Warnings in the order of their recording, then the shared ones, by place.
  std::vector<std::string> warnings() const;

 private:
  struct Entry {
    SourceLocation where;
    std::string message, kind;
  };
  struct Places {
    SourceLocation first;
    size_t n = 0;
  };
  bool ignores_unknown_;
  std::vector<Entry> errors_;
  std::vector<std::string> warnings_;
  std::map<std::string, Places> shared_;  // by message
};

/// A spectrum given by pairs of wavelength (nm) and value, strictly increasing in wavelength, linearly interpolated,
/// zero outside. A single pair is a constant spectrum (its wavelength is ignored): <spectrum value="0.5">.
struct SampledSpectrum {
  std::vector<std::pair<float, float>> samples;
};
/// <rgb>: three numbers interpreted as linear RGB.
struct ColourValue {
  Spectrum rgb;
};

struct ObjectDescription;
using ObjectPtr = std::shared_ptr<const ObjectDescription>;

/// A null ObjectPtr stands for a value that could not be read; the reason is in the diagnostics, and getters behave as
/// if the parameter were absent.
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

/// How a sampled spectrum is converted to RGB. Reflectances are lit by D65, the white of linear RGB, and clamped to [0,
/// 1]; so are indices of refraction, but without the upper limit. Emission is converted as it is.
enum class SpectrumRole { kReflectance, kEmission, kIndex };

class ObjectFactory;

/// Typed access. Every getter marks the name as known; if a required parameter is missing, has the wrong type or is out
/// of range, it records this in Diagnostics and returns a usable default, so that all problems are found in one run.
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
  /// One of `choices`; for anything else, an error that lists them.
  std::string get_choice(const std::string& name, const std::string& fallback, const std::vector<std::string>& choices);
  std::string require_string(const std::string& name);
  Vec3 get_vec3(const std::string& name, const Vec3& fallback);
  Transform get_transform(const std::string& name);  ///< identity when absent
  /// An <animation>; null when absent, or if it is a <transform>, which get_transform() returns.
  KeyedTransformPtr find_animation(const std::string& name);
  /// A colour that cannot be textured: number, rgb or spectrum.
  Spectrum get_spectrum(const std::string& name, const Spectrum& fallback, SpectrumRole role);
  /// A texture; numbers and colours become ConstantTexture.
  TexturePtr get_texture(const std::string& name, const Spectrum& fallback,
                         SpectrumRole role = SpectrumRole::kReflectance);
  TexturePtr get_texture(const std::string& name, float fallback);
  /// Same, but null when absent.
  TexturePtr find_texture(const std::string& name, SpectrumRole role = SpectrumRole::kReflectance);
  /// File relative to the scene's search paths; "" and an error if it does not exist.
  std::string require_file(const std::string& name);

  /// All nested objects of class T not taken by another getter, in file order ("bsdf" inside "twosided"). `kind` is
  /// their required tag, e.g. "bsdf".
  template <typename T>
  std::vector<std::shared_ptr<const T>> children(const std::string& kind) {
    std::vector<std::shared_ptr<const T>> result;
    for (const std::shared_ptr<const SceneObject>& object : child_objects(kind))
      if (auto typed = std::dynamic_pointer_cast<const T>(object)) result.push_back(std::move(typed));
    return result;
  }

  /// Whether the parameter is a nested object or a reference to one.
  bool holds_object(const std::string& name);
  /// The nested object with this name, null when absent; an error if it is not a <kind>.
  std::shared_ptr<const SceneObject> find_object(const std::string& name, const std::string& kind);

  /// Records an error about this object, or about one of its parameters.
  void error(const std::string& message);
  void error_at(const std::string& parameter, const std::string& message);
  void warn(const std::string& message);
  /// Diagnostics::unknown() about this object.
  void unknown(const std::string& what, const std::string& hint, const std::string& instead);
  bool ignores_unknown() const { return diagnostics_.ignores_unknown(); }
  /// Whatever is not queried is not reported: it belongs to a plugin that another one replaces.
  void ignore_rest() { used_.assign(used_.size(), true); }
  /// Reports every property that was not queried. The factory calls it after constructing the plugin.
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

/// Constructs scene objects from descriptions, each only once (objects referenced by id are shared). Implemented by io.
class ObjectFactory {
 public:
  virtual ~ObjectFactory() = default;
  /// Null if the object could not be constructed; the reason is in the diagnostics.
  virtual std::shared_ptr<const SceneObject> make(const ObjectPtr& description) = 0;
  /// Absolute path of a file named in the scene; nullopt if there is no such file.
  virtual std::optional<std::string> resolve_file(const std::string& name, const SourceLocation& where) = 0;
};

/// One line of a module's registry: plugin name and factory function. `make` returns null after recording an error.
template <typename T>
struct Plugin {
  const char* name;
  std::shared_ptr<T> (*make)(Parameters& parameters);
};

/// Linear Rec. 709 RGB of a sampled spectrum (CIE 1931 2° observer), with negative components clamped to 0. A constant
/// reflectance or index of 1 gives (1,1,1), to within 0.2 % when sampled. A constant emission of 1 has Y = 1 and the
/// chromaticity of illuminant E, which is not neutral in this space: (1.205, 0.948, 0.909).
Spectrum spectrum_to_rgb(const SampledSpectrum& spectrum, SpectrumRole role);

}  // namespace covary
