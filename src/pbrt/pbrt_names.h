// SPDX-License-Identifier: Apache-2.0
// Textures, materials and media of pbrt scenes by name. They are only made when something uses them, at the end of the
// file: a name may be used before it is defined, and what is not used cannot stop a scene.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "formats/file_resolver.h"
#include "formats/object_builder.h"
#include "formats/scene_references.h"
#include "pbrt_text/pbrt_parameters.h"

namespace covary {

enum class PbrtKind { kFloatTexture, kSpectrumTexture, kMaterial, kMedium };

/// One directive that defines such an object.
struct PbrtDefinition {
  PbrtKind kind;
  std::string name, type;
  PbrtParameters parameters;
  Transform to_world;
  enum { kOpen, kBeingMade, kMade } state = kOpen;
  ObjectPtr object;  ///< null after an error
};
using PbrtDefinitionPtr = std::shared_ptr<PbrtDefinition>;

class PbrtNames {
 public:
  PbrtNames(FileResolver& files, PbrtMessages& messages, Diagnostics& diagnostics)
      : files_(files), messages_(messages), limit_(kMaxNesting, diagnostics) {}

  void define(PbrtKind kind, const std::string& name, const std::string& type, PbrtParameters parameters,
              const Transform& to_world);
  /// The object of this name that was defined last before the directive number `order`; else, the first one after it.
  /// Null if there is none.
  PbrtDefinitionPtr find(PbrtKind kind, const std::string& name, size_t order) const;
  /// Its object, made with all that it refers to; null after an error, which has been reported.
  ObjectPtr make(PbrtDefinition& definition);
  /// Names of this kind, for messages.
  std::vector<std::string> known(PbrtKind kind) const;
  /// Warns about definitions with errors that nothing uses.
  void check_unused();

  FileResolver& files() const { return files_; }
  /// The scene is of version 3, whose names and defaults differ.
  bool version_3 = false;
  /// Values of the picture per radiance, by which all that shines is multiplied; known when the world begins.
  double exposure = 1;
  /// The textures that pbrt looks up instead of these for a reflectance: those with images clamped to 1.
  std::map<ObjectPtr, ObjectPtr> reflectances;

 private:
  static constexpr size_t kMaxNesting = 64;

  FileResolver& files_;
  PbrtMessages& messages_;
  ExpansionLimit limit_;
  std::map<std::pair<PbrtKind, std::string>, std::vector<PbrtDefinitionPtr>> all_;
  size_t depth_ = 0;
};

}  // namespace covary
