// SPDX-License-Identifier: Apache-2.0
// Parameter lists of pbrt scene files: "float radius" [ 2 ].
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/colour_matrix.h"
#include "pbrt_text/pbrt_tokens.h"

namespace covary {

struct PbrtParameter {
  std::string type, name;
  SourceLocation where;
  std::vector<double> numbers;  ///< bools are 0 and 1
  std::vector<std::string> strings;
  bool used = false;
};

/// What parameters mean depends on the directives before them.
struct PbrtContext {
  size_t order = 0;                      ///< of the directive in the scene
  const ColourMatrix* rec709 = nullptr;  ///< from RGB of the colour space to linear Rec. 709; null: it is that
  const std::vector<PbrtParameter>* defaults = nullptr;  ///< of the directive Attribute
};

/// The parameters of one directive. Getters mark them as used; on a wrong type or length they record an error and
/// return the fallback.
class PbrtParameters {
 public:
  /// Reads `tokens` up to the next directive. `what` names the object in messages: Shape "sphere".
  PbrtParameters(PbrtTokens& tokens, std::string what, const SourceLocation& where, PbrtMessages& messages,
                 const PbrtContext& context = {});

  const std::string& what() const { return what_; }
  const SourceLocation& where() const { return where_; }
  /// Names the object in warnings, so that those of one kind are alike.
  void set_kind(std::string kind) { kind_ = std::move(kind); }
  size_t order() const { return context_.order; }
  PbrtMessages& messages() const { return *messages_; }
  const std::vector<PbrtParameter>& all() const { return parameters_; }
  bool has(const std::string& name) const;
  /// Whether it is given as a texture.
  bool has_texture(const std::string& name) const;
  /// For names of older versions; nothing if there is no such parameter, or one of the new name.
  void rename(const std::string& from, const std::string& to);
  void remove(const std::string& name);
  /// Adds one, as if the file gave it.
  void set(const std::string& type, const std::string& name, std::vector<double> numbers);
  void set(const std::string& name, std::vector<std::string> strings);
  /// An RGB of the colour space in linear Rec. 709.
  Spectrum to_rec709(const Spectrum& rgb) const { return context_.rec709 ? *context_.rec709 * rgb : rgb; }
  /// Null if absent; marks it as used.
  const PbrtParameter* find(const std::string& name);
  double get_float(const std::string& name, double fallback);
  int64_t get_integer(const std::string& name, int64_t fallback);
  bool get_bool(const std::string& name, bool fallback);
  std::string get_string(const std::string& name, const std::string& fallback);
  /// point3, vector3, normal3, and their older names.
  Vec3 get_vec3(const std::string& name, const Vec3& fallback);
  /// The values of an array with `width` numbers per element; empty if absent.
  std::vector<double> get_array(const std::string& name, const std::string& type, size_t width);

  void error(const std::string& message);
  /// "parameter 'NAME' of WHAT MESSAGE"
  void error_at(const PbrtParameter& parameter, const std::string& message);
  void warn(const std::string& message);
  /// A type that is not among the supported ones, which are in single quotes: an error that names them, and first those
  /// with a similar name.
  void unsupported(const std::string& supported);
  /// The same of a type that nothing here knows; or, where unknown names are ignored, a warning that says what is done
  /// instead. Returns whether they are.
  bool unknown(const std::string& supported, const std::string& instead);
  /// Marks parameters that have no effect in this renderer as used.
  void ignore(std::initializer_list<const char*> names);
  /// For objects that are refused as a whole: one message is enough.
  void ignore_all();
  /// Records an error for each unused parameter; a warning if `lenient`, for versions whose programs ignore them.
  void report_unknown(bool lenient = false);

 private:
  void read_values(PbrtTokens& tokens, PbrtParameter& parameter);
  /// The parameter, if it has one of these types and `count` values.
  const PbrtParameter* find(const std::string& name, std::initializer_list<const char*> types, size_t count);

  std::string what_, kind_;
  SourceLocation where_;
  PbrtMessages* messages_;
  PbrtContext context_;
  std::vector<PbrtParameter> parameters_;
  mutable std::vector<std::string> asked_;
};

}  // namespace covary
