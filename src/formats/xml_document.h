// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// Recognises other file types mistaken for a scene: "an EXR image"; "" if unknown.
std::string kind_of_file(std::string_view text);

/// A parsed XML file that knows the line and column of its elements.
class XmlDocument {
 public:
  /// Records malformed XML in `diagnostics`; root() is then empty.
  XmlDocument(std::string_view text, const std::string& name, Diagnostics& diagnostics);

  pugi::xml_node root() const { return root_; }
  /// Location of the element's '<'.
  SourceLocation where(pugi::xml_node element) const;
  const std::string& name() const { return name_; }

 private:
  SourceLocation at(size_t offset) const;
  std::string name_;
  std::string buffer_;  // modified by the parser; offsets stay valid
  std::vector<size_t> line_starts_;
  pugi::xml_document document_;
  pugi::xml_node root_;
};

/// Substitution of $name in attribute values. Defines given from outside take precedence over <default>.
class XmlDefines {
 public:
  explicit XmlDefines(const std::map<std::string, std::string>& defines);

  /// <default>: sets `name` unless already set.
  void add_default(const std::string& name, const std::string& value);
  /// `text` with every $name replaced by its value, longest match first; "\$" stands for "$". Throws Error(kInput) if a
  /// name is not defined, or if substituted values are too long, individually or in total.
  std::string substitute(std::string_view text);
  /// Records an error for each unused define from outside.
  void report_unused(const std::string& file, Diagnostics& diagnostics) const;

 private:
  struct Entry {
    std::string value;
    bool external = false, has_default = false, used = false;
  };
  std::map<std::string, Entry> entries_;
  size_t n_substituted_ = 0;  // characters substituted so far
};

/// Attributes of one element after substitution.
class XmlAttributes {
 public:
  /// `accepted`: names, required ones with a leading '!'. Unknown, duplicate and missing attributes are recorded.
  XmlAttributes(pugi::xml_node element, const SourceLocation& where, XmlDefines& defines,
                std::initializer_list<std::string_view> accepted, Diagnostics& diagnostics);

  /// Whether all required attributes are present and every substitution succeeded.
  bool complete() const { return complete_; }
  const std::string* find(std::string_view name) const;
  /// The attribute's text, or `fallback`.
  std::string get(std::string_view name, const std::string& fallback = "") const;

 private:
  std::vector<std::pair<std::string, std::string>> values_;
  bool complete_ = true;
};

}  // namespace covary
