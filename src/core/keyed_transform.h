// SPDX-License-Identifier: Apache-2.0
// Transformations over time, given at some times and interpolated between them.
#pragma once

#include <memory>
#include <vector>

#include "core/transform.h"

namespace covary {

struct TransformKey {
  double time = 0;
  Matrix4 matrix;  ///< affine: the last row is 0 0 0 1
};

/// Between two keys the parts of M = T R S are interpolated: translation T and scale S (a symmetric matrix) linearly,
/// rotation R on the shortest arc of unit quaternions, as Mitsuba does with `<animation>`. The parts are those of the
/// polar decomposition [Shoemake1992]. Before the first key and behind the last one, the transformation rests.
class KeyedTransform {
 public:
  /// Throws Error(kInput) without keys, where times do not increase or are not finite, and for a matrix that is
  /// singular, not finite or not affine; the message names the key by its index from 0.
  explicit KeyedTransform(std::vector<TransformKey> keys);

  /// At the time of a key exactly its matrix, and between keys of the same matrix that one.
  Transform at(double time) const;
  const std::vector<TransformKey>& keys() const { return keys_; }
  double first_time() const { return keys_.front().time; }
  double last_time() const { return keys_.back().time; }

 private:
  std::vector<TransformKey> keys_;
};

using KeyedTransformPtr = std::shared_ptr<const KeyedTransform>;

}  // namespace covary
