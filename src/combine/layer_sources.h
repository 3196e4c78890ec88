// SPDX-License-Identifier: Apache-2.0
// Layers of an independent image from any renderer, such as direct light or the light of individual lamps.
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "combine/grouped_source.h"
#include "combine/input_checks.h"
#include "estimators/method.h"

namespace covary {

struct LayerSource {
  std::string name;
  GroupedSource groups;
  std::optional<std::string> sum = "";  ///< layers of the same sum add up to the image; none: not a part of it (alpha)
};

/// Finds values of layers that are not finite where the image is.
class LayerChecks {
 public:
  explicit LayerChecks(std::span<const LayerSource> sources) : sources_(sources), bad_(sources.size()) {}
  /// Rows first … of the image; each once.
  void add_rows(int first, const GroupedImage& picture);
  void report(const ImageNames& picture, std::vector<Finding>& findings) const;

 private:
  struct BadValues {
    long pixels = 0;
    int x = 0, y = 0, group = 0;  ///< the first
  };
  std::span<const LayerSource> sources_;
  std::vector<BadValues> bad_;
};

/// The remainder of the image after the given layers; "Rest_lights" of the sum "lights".
inline constexpr const char* kRest = "Rest";

/// Layers that sum to the image: those of `sources`, and kRest if these leave more than a thousandth of it (less may be
/// rounding, for example in 16-bit files), for each sum.
class WholeLayers {
 public:
  /// The memory that `picture` and the sources refer to must outlive this object. Throws Error(kInput) if a layer has
  /// other pixels or groups, is a duplicate, or is named kRest. A value that is not finite is left out: it becomes the
  /// mean of the other groups', or 0.
  WholeLayers(const GroupedImage& picture, std::span<const LayerSource> sources);
  std::span<const Layer> view() const { return layers_; }

 private:
  std::vector<Layer> layers_;
  std::deque<std::vector<float>> rests_, mended_;
};

}  // namespace covary
