// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace covary {

/// Base of everything a scene file can name: textures, reflectance models, emitters, shapes.
class SceneObject {
 public:
  virtual ~SceneObject() = default;
};

}  // namespace covary
