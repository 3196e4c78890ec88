// SPDX-License-Identifier: Apache-2.0
// Keyframed transformations, interpolated over time.
#pragma once

#include <memory>
#include <vector>

#include "core/transform.h"

namespace covary {

struct TransformKey {
  double time = 0;
  Matrix4 matrix;  ///< affine: the last row is 0 0 0 1
};

/// Between two keys, the parts of M = T R S are interpolated: translation T and scale S (a symmetric matrix) linearly,
/// rotation R by slerp of unit quaternions, as Mitsuba does with `<animation>`. The parts come from the polar
/// decomposition [Shoemake1992]. Constant before the first key and after the last.
class KeyedTransform {
 public:
  /// Throws Error(kInput) if there are no keys, if times do not increase or are not finite, or if a matrix is singular,
  /// not finite or not affine; the message names the key by its index from 0.
  explicit KeyedTransform(std::vector<TransformKey> keys);

  /// Exactly the key's matrix at the time of a key, and between keys with equal matrices.
  Transform at(double time) const;
  const std::vector<TransformKey>& keys() const { return keys_; }
  double first_time() const { return keys_.front().time; }
  double last_time() const { return keys_.back().time; }

 private:
  std::vector<TransformKey> keys_;
};

using KeyedTransformPtr = std::shared_ptr<const KeyedTransform>;

}  // namespace covary
