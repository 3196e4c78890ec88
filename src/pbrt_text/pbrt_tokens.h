// SPDX-License-Identifier: Apache-2.0
// Tokens of pbrt scene files.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// Thrown to stop reading at an invalid token; the reason is in the diagnostics.
struct PbrtStop {};

/// Passes problems on to diagnostics: errors at once, warnings at the end, those of one text together.
class PbrtMessages {
 public:
  explicit PbrtMessages(Diagnostics& diagnostics) : diagnostics_(&diagnostics) {}
  void error(const SourceLocation& where, const std::string& message) { diagnostics_->error(where, message); }
  void warn(const SourceLocation& where, const std::string& message);
  bool ignores_unknown() const { return diagnostics_->ignores_unknown(); }
  /// The warnings so far, each text once, with the number of its other places.
  void flush();
  /// Takes the errors of `act` to other diagnostics, and drops its warnings.
  template <typename Act>
  void redirected(Diagnostics& diagnostics, const Act& act) {
    Diagnostics* const before = std::exchange(diagnostics_, &diagnostics);
    silent_ = true;
    act();
    silent_ = false;
    diagnostics_ = before;
  }

 private:
  struct Repeated {
    std::string message;
    SourceLocation first;
    size_t count = 1;
  };
  Diagnostics* diagnostics_;
  bool silent_ = false;  // warnings are dropped
  std::vector<Repeated> warnings_;
  std::map<std::string, size_t> indices_;
};

struct PbrtToken {
  enum Kind { kEnd, kWord, kString, kOpen, kClose } kind = kEnd;
  std::string text;  ///< strings without their quotes
  int line = 0, column = 0;
  const std::string* file = nullptr;
};

/// Splits text into tokens; "#" starts a comment. An included file is followed by the rest of the one that includes it:
/// a directive's parameters may go on there.
class PbrtTokens {
 public:
  /// `text`, `file`, `outer` (may be null) must outlive the tokens.
  PbrtTokens(std::string_view text, const std::string& file, PbrtMessages& messages, PbrtTokens* outer = nullptr);
  /// Throws PbrtStop after an error for an unterminated string.
  PbrtToken next();
  const PbrtToken& peek();
  SourceLocation where(const PbrtToken& token) const { return {*token.file, token.line, token.column}; }
  [[noreturn]] void stop(const PbrtToken& token, const std::string& message) const;
  const std::string& file() const { return file_; }
  /// Whether this file has ended; peek() then looks at the outer one.
  bool at_end();

  /// The next token, which must be a string; `what` says what is expected.
  std::string string(const char* what);
  /// The next token, which must be a finite number.
  double number();
  /// `count` numbers, with or without brackets.
  std::vector<double> numbers(size_t count);

 private:
  char take();
  void skip_blanks();
  PbrtToken read();
  std::string_view text_;
  const std::string& file_;
  PbrtMessages& messages_;
  PbrtTokens* outer_;
  size_t place_ = 0;
  int line_ = 1, column_ = 1;
  bool peeked_ = false;
  PbrtToken next_;
};

}  // namespace covary
