// SPDX-License-Identifier: Apache-2.0
// Reads Mitsuba XML from text and collects all errors, for tests of the reader.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <variant>
#include <vector>

#include "formats/xml_reader.h"
#include "support/files.h"

namespace covary::test_support {

/// A scene read from text, with all errors.
struct Read {
  SceneXml xml;
  std::string errors;
  std::vector<std::string> warnings;
};

inline Read read(const std::string& text, const std::map<std::string, std::string>& defines = {},
                 const std::string& name = "scene.xml") {
  Read result;
  Diagnostics diagnostics;
  FileResolver files;
  result.xml = read_scene_xml(text, name, defines, files, diagnostics);
  result.errors = message_of([&] { diagnostics.throw_if_errors(); });
  result.warnings = diagnostics.warnings();
  return result;
}

/// The same inside <scene version="3.0.0"> on the first line.
inline Read read_scene(const std::string& body, const std::map<std::string, std::string>& defines = {}) {
  return read("<scene version=\"3.0.0\">\n" + body + "\n</scene>\n", defines);
}

inline const ObjectDescription& child(const Read& read, size_t i = 0) {
  return *std::get<ObjectPtr>(read.xml.scene->properties.at(i).value);
}

inline const Value& value(const ObjectDescription& object, const std::string& name) {
  for (const Property& property : object.properties)
    if (property.name == name) return property.value;
  throw Error(ErrorCode::kInternal, "no property " + name);
}

template <typename T>
T value(const Read& read, const std::string& name) {
  return std::get<T>(value(child(read), name));
}

inline void expect_near(const Vec3& a, const Vec3& b) {
  EXPECT_NEAR(a.x, b.x, 1e-6f);
  EXPECT_NEAR(a.y, b.y, 1e-6f);
  EXPECT_NEAR(a.z, b.z, 1e-6f);
}

}  // namespace covary::test_support
