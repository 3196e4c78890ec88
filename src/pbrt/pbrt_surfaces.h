// SPDX-License-Identifier: Apache-2.0
// Materials of shapes in pbrt scenes: the default, `alpha`, and textures at the texture coordinates that shapes have in
// pbrt.
#pragma once

#include <map>
#include <utility>

#include "pbrt/pbrt_objects.h"

namespace covary {

class PbrtSurfaces {
 public:
  explicit PbrtSurfaces(PbrtMessages& messages) : messages_(messages) {}
  /// The material of a shape at `where` with `alpha` and texture coordinates `uv`; `material` may be null: pbrt's
  /// default. Warns about what looks different.
  ObjectPtr make(const ObjectPtr& material, const Value& alpha, PbrtUv uv, const SourceLocation& where);
  /// The area light of a shape with `alpha`: it emits that part of its light, or all of it, unseen, if that is 0. Then
  /// light from inside a sphere does not come out of it, as pbrt samples the half that is seen.
  static ObjectPtr masked_light(const ObjectPtr& light, const Value& alpha, ObjectDescription& shape);
  /// The same object with textures looked up at pbrt's coordinates.
  ObjectPtr fit(const ObjectPtr& object, PbrtUv uv);

 private:
  ObjectPtr default_material(const SourceLocation& where);

  PbrtMessages& messages_;
  ObjectPtr default_;
  std::map<std::pair<ObjectPtr, PbrtUv>, ObjectPtr> fitted_;
};

}  // namespace covary
