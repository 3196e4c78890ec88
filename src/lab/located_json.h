// SPDX-License-Identifier: Apache-2.0
// JSON whose members know their line, and a reader of objects that collects every mistake with its place.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace covary::lab {

struct LocatedJson {
  std::string name;  ///< of the file, for messages
  nlohmann::ordered_json value;
  std::map<std::string, int> lines;  ///< of each value by JSON pointer: "/scenes/0/file"; "" is the whole
};

/// Throws Error(kInput) with the line where the text is not JSON, nests deeper than kMaxJsonDepth, or a key stands
/// twice in an object.
LocatedJson parse_located(const std::string& text, const std::string& name);

/// The value as JSON text, shortened for messages.
std::string shown(const nlohmann::ordered_json& value);

/// Reads one object member by member. Mistakes are added to `problems` as "file:line: where: what"; a member nobody
/// asked for is one of them.
class ObjectReader {
 public:
  ObjectReader(const LocatedJson& document, std::string pointer, std::vector<std::string>& problems);

  /// The member's value, or null where it is missing. The name counts as known.
  const nlohmann::ordered_json* find(const std::string& name);
  std::optional<std::string> text(const std::string& name);
  /// As text(), and missing or empty is a mistake.
  std::string required_text(const std::string& name);
  std::optional<double> positive(const std::string& name);
  /// A whole number in [lowest, highest].
  std::optional<int64_t> whole(const std::string& name, int64_t lowest, int64_t highest);
  std::vector<std::string> texts(const std::string& name);
  /// Pointers to the elements of an array member; empty where it is missing. An element of another type is a mistake.
  std::vector<std::string> objects(const std::string& name);
  /// Pointer of a member that is an object; empty where it is missing.
  std::optional<std::string> object(const std::string& name);

  /// Adds a problem at a member, or at the object itself where `name` is empty.
  void problem(const std::string& name, const std::string& text);
  /// To be called when everything was asked for: reports the members that nobody knows.
  void finish();

 private:
  template <typename Is>
  const nlohmann::ordered_json* typed(const std::string& name, Is&& is, const std::string& expected);

  const LocatedJson& document_;
  std::string pointer_;
  std::vector<std::string>& problems_;
  const nlohmann::ordered_json& object_;
  std::vector<std::string> known_;
};

}  // namespace covary::lab
