// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pugixml.hpp>
#include <string>
#include <vector>

#include "formats/file_resolver.h"
#include "formats/xml_document.h"
#include "scene/parameters.h"

namespace covary {

/// Elements allowed inside <transform>.
const std::vector<std::string>& transform_tags();

/// Reads elements that hold one value: numbers, strings, points, colours, spectra and transforms.
class PropertyReader {
 public:
  /// `old`: the file is of version 0.x or 1.x.
  PropertyReader(XmlDefines& defines, FileResolver& files, Diagnostics& diagnostics, bool old)
      : defines_(defines), files_(files), diagnostics_(diagnostics), old_(old) {}

  /// The property described by `node`. After recording an error its value is a null ObjectPtr, which keeps the
  /// parameter known, but without a value.
  Property read(const XmlDocument& document, pugi::xml_node node);

 private:
  Value read_spectrum(const XmlAttributes& attributes, const SourceLocation& where);
  /// The product of the operations, the first one applied first. Invalid ones are recorded and skipped.
  Transform read_transform(const XmlDocument& document, pugi::xml_node node);
  /// Reads <transform time="…"> children, which animate to_world.
  Value read_animation(const XmlDocument& document, pugi::xml_node node);
  Transform read_operation(pugi::xml_node node, const std::string& tag, const SourceLocation& where);

  XmlDefines& defines_;
  FileResolver& files_;
  Diagnostics& diagnostics_;
  bool old_;
};

}  // namespace covary
