// SPDX-License-Identifier: Apache-2.0
// Layers of an independent image from any renderer, such as direct light or the light of individual lamps.
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "combine/grouped_source.h"
#include "estimators/method.h"

namespace covary {

struct LayerSource {
  std::string name;
  GroupedSource groups;
  std::optional<std::string> sum = "";  ///< layers of the same sum add up to the image; none: not a part of it (alpha)
};

/// The remainder of the image after the given layers; "Rest_lights" of the sum "lights".
inline constexpr const char* kRest = "Rest";

/// Layers that sum to the image: those of `sources`, and kRest if these leave more than a thousandth of it (less may be
/// rounding, for example in 16-bit files), for each sum.
class WholeLayers {
 public:
  /// The memory that `picture` and the sources refer to must outlive this object. Throws Error(kInput) if a layer has
  /// other pixels or groups, is a duplicate, is named kRest, or has a non-finite value where the picture is finite.
  WholeLayers(const GroupedImage& picture, std::span<const LayerSource> sources);
  std::span<const Layer> view() const { return layers_; }

 private:
  std::vector<Layer> layers_;
  std::deque<std::vector<float>> rests_;
};

}  // namespace covary
