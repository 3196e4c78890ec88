// SPDX-License-Identifier: Apache-2.0
// JSON whose members know their line, and a reader of objects that reports every mistake with its location.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace covary::lab {

struct LocatedJson {
  std::string name;  ///< file name, for messages
  nlohmann::ordered_json value;
  std::map<std::string, int> lines;  ///< of each value by JSON pointer: "/scenes/0/file"; "" is the whole
};

/// Throws Error(kInput) with the line if the text is not JSON, nests deeper than kMaxJsonDepth, or a key appears twice
/// in an object.
LocatedJson parse_located(const std::string& text, const std::string& name);

/// The value as JSON text, shortened for messages.
std::string shown(const nlohmann::ordered_json& value);

/// Reads one object member by member. Mistakes are added to `problems` as "file:line: where: what"; a member that
/// nobody asked for is one.
class ObjectReader {
 public:
  ObjectReader(const LocatedJson& document, std::string pointer, std::vector<std::string>& problems);

  /// The member's value, or null if missing. The name counts as known.
  const nlohmann::ordered_json* find(const std::string& name);
  std::optional<std::string> text(const std::string& name);
  /// Like text(), but missing or empty is a mistake.
  std::string required_text(const std::string& name);
  std::optional<double> positive(const std::string& name);
  /// A whole number in [lowest, highest].
  std::optional<int64_t> whole(const std::string& name, int64_t lowest, int64_t highest);
  std::vector<std::string> texts(const std::string& name);
  /// Pointers to the elements of an array member; empty if missing. An element of another type is a mistake.
  std::vector<std::string> objects(const std::string& name);
  /// Pointer to an object member; empty if missing.
  std::optional<std::string> object(const std::string& name);

  /// Adds a problem at a member, or at the object itself if `name` is empty.
  void problem(const std::string& name, const std::string& text);
  /// Call after reading everything: reports unknown members.
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
