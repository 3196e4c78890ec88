// SPDX-License-Identifier: Apache-2.0
// Layers of an independent image from any renderer, such as direct light or the light of single lamps.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "combine/grouped_source.h"
#include "estimators/estimator.h"

namespace covary {

struct LayerSource {
  std::string name;
  GroupedSource groups;
};

/// The rest of the image that the given layers leave.
inline constexpr const char* kRest = "Rest";

/// Layers that add up to the image: those of `sources`, and kRest if these leave more than a thousandth of it (less may
/// be rounding, for example of 16-bit files).
class WholeLayers {
 public:
  /// What `picture` and the sources point to must live as long. Throws Error(kInput) if a layer has other pixels or
  /// groups, is named twice or kRest, or has a value that is not finite where the picture's is.
  WholeLayers(const GroupedImage& picture, std::span<const LayerSource> sources);
  std::span<const Layer> view() const { return layers_; }

 private:
  std::vector<Layer> layers_;
  std::vector<float> rest_;
};

}  // namespace covary
