// SPDX-License-Identifier: Apache-2.0
// Auxiliary features: what a denoiser may read of the surfaces behind the pixels, as layers of files. The one list of
// their names, covary's and other renderers'.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

namespace covary {

namespace feature {
/// Indices into kAuxiliaryFeatures.
enum Index : size_t { kAlbedo, kNormal, kPosition, kDenoisingAlbedo, kDenoisingNormal, kCount };
}  // namespace feature

struct AuxiliaryFeature {
  const char* name;   ///< in messages
  const char* layer;  ///< in covary's own films
  bool is_colour;     ///< converted to the colour space of the picture
  /// The last parts of its layers' names, of all renderers in docs/other-renderers.md; the first in a file counts.
  std::span<const std::string_view> names;
  /// The same of what is seen through mirrors and glass, which other renderers' files may have in its place.
  feature::Index behind = feature::kCount;
};

extern const std::array<AuxiliaryFeature, feature::kCount> kAuxiliaryFeatures;

/// The auxiliary image of one channel that says how much of a pixel surfaces cover; it guides no denoiser.
inline constexpr const char* kAlpha = "A";

}  // namespace covary
