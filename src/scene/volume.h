// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "core/ray.h"
#include "core/spectrum.h"
#include "scene/object.h"

namespace covary {

/// A colour at each point of space.
class Volume : public SceneObject {
 public:
  virtual Spectrum eval(const Vec3& p) const = 0;
  /// No value lies above or below these, channel by channel.
  virtual Spectrum largest() const = 0;
  virtual Spectrum smallest() const = 0;
  /// A box around the volume; eval() has values outside, too.
  virtual Bounds3 bounds() const = 0;
  virtual bool is_constant() const { return false; }
};

using VolumePtr = std::shared_ptr<const Volume>;

}  // namespace covary
