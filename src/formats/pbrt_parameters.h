// SPDX-License-Identifier: Apache-2.0
// Tokens and parameter lists of pbrt-v4 scene files: "float radius" [ 2 ].
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// Thrown to stop reading at an invalid token; the reason is in the diagnostics.
struct PbrtStop {};

struct PbrtToken {
  enum Kind { kEnd, kWord, kString, kOpen, kClose } kind = kEnd;
  std::string text;  ///< strings without their quotes
  int line = 0, column = 0;
};

/// Splits text into tokens; "#" starts a comment.
class PbrtTokens {
 public:
  PbrtTokens(std::string_view text, std::string file, Diagnostics& diagnostics)
      : text_(text), file_(std::move(file)), diagnostics_(diagnostics) {}
  /// Throws PbrtStop after an error for an unterminated string.
  PbrtToken next();
  PbrtToken peek();
  SourceLocation where(const PbrtToken& token) const { return {file_, token.line, token.column}; }
  [[noreturn]] void stop(const PbrtToken& token, const std::string& message) const;
  const std::string& file() const { return file_; }
  bool at_end() { return peek().kind == PbrtToken::kEnd; }

  /// The next token, which must be a string; `what` says what is expected.
  std::string string(const char* what);
  /// The next token, which must be a finite number.
  double number();
  /// `count` numbers, with or without brackets.
  std::vector<double> numbers(size_t count);

 private:
  char take();
  std::string_view text_;
  std::string file_;
  Diagnostics& diagnostics_;
  size_t place_ = 0;
  int line_ = 1, column_ = 1;
  bool peeked_ = false;
  PbrtToken next_;
};

struct PbrtParameter {
  std::string type, name;
  SourceLocation where;
  std::vector<double> numbers;  ///< bools are 0 and 1
  std::vector<std::string> strings;
  bool used = false;
};

/// The parameters of one directive. Getters mark them as used; on a wrong type or length they record an error and
/// return the fallback.
class PbrtParameters {
 public:
  /// Reads `tokens` up to the next directive. `what` names the object in messages: Shape "sphere".
  PbrtParameters(PbrtTokens& tokens, std::string what, const SourceLocation& where, Diagnostics& diagnostics);

  const std::string& what() const { return what_; }
  const SourceLocation& where() const { return where_; }
  bool has(const std::string& name) const;
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
  /// Marks parameters that have no effect in this renderer as used.
  void ignore(std::initializer_list<const char*> names);
  /// Records an error for each unused parameter.
  void report_unknown();

 private:
  void read_values(PbrtTokens& tokens, PbrtParameter& parameter);
  /// The parameter, if it has one of these types and `count` values.
  const PbrtParameter* find(const std::string& name, std::initializer_list<const char*> types, size_t count);

  std::string what_;
  SourceLocation where_;
  Diagnostics& diagnostics_;
  std::vector<PbrtParameter> parameters_;
  std::vector<std::string> asked_;
};

}  // namespace covary
