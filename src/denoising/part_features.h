// SPDX-License-Identifier: Apache-2.0
// The features of all samples or of a half of them.
#pragma once

#include <array>

#include "estimators/method.h"

namespace covary {

/// The feature of all samples (`part` 0), or of a half of them (1, 2), if there is one.
Image feature_of_part(const Features& features, feature::Index kind, int part);

/// All features of a part.
class PartFeatures {
 public:
  /// The features must outlive this object.
  PartFeatures(const Features& features, int part);
  PartFeatures(const PartFeatures&) = delete;
  PartFeatures& operator=(const PartFeatures&) = delete;
  const Features& view() const { return view_; }

 private:
  std::array<Image, feature::kCount> images_;  // those that differ
  Features view_;
};

}  // namespace covary
