// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "core/ray.h"
#include "core/spectrum.h"
#include "scene/object.h"

namespace covary {

/// A colour at every point in space.
class Volume : public SceneObject {
 public:
  virtual Spectrum eval(const Vec3& p) const = 0;
  /// Bounds on the values, per channel.
  virtual Spectrum largest() const = 0;
  virtual Spectrum smallest() const = 0;
  /// A box around the volume; eval() is also defined outside.
  virtual Bounds3 bounds() const = 0;
  virtual bool is_constant() const { return false; }
};

using VolumePtr = std::shared_ptr<const Volume>;

}  // namespace covary
