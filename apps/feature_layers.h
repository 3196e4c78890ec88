// SPDX-License-Identifier: Apache-2.0
// Layers of an image that guide a denoiser, by each renderer's names.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "denoising/render_features.h"
#include "estimators/method.h"
#include "film/pictures.h"

namespace covary {

/// Albedo and normal of the first surface that is not a mirror or glass, or else of the first one; position of the
/// first one.
enum class FeatureKind { kAlbedo, kNormal, kPosition };

/// The feature layer of the image at `path` by the renderers' names (table in docs/other-renderers.md), of the
/// picture's view and view layer; if there are several, the first in the table. An albedo is converted to `colours`,
/// the space of the picture. Pixels with values that are not finite are told as a warning, and become NaN. Throws
/// like read_image().
std::optional<Image> find_feature(const std::string& path, const ImageInfo& info, FeatureKind kind,
                                  const ColourSpace& colours, const Picture& picture = {});

/// A feature named by the user, likewise: a layer of the image at `path`, or a separate file, whose frame must have the
/// same size; of a larger data window, the pixels of the image. Throws like read_image() and common_window().
Image named_feature(const std::string& path, const ImageInfo& info, FeatureKind kind, const ColourSpace& colours,
                    const std::string& layer_or_file);

/// The image with 0 in place of NaN.
std::optional<Image> filled(std::optional<Image> feature);

/// The layers of --features.
struct FeatureImages {
  std::optional<Image> albedo, normal;                      // first hits, if the file has both
  std::optional<Image> denoising_albedo, denoising_normal;  // first rough surfaces behind mirrors and glass
  bool clean = false;                                       // without noise, as in covary's own films
  std::optional<Image> position;
  Features view() const {
    const auto or_null = [](const std::optional<Image>& image) { return image ? &*image : nullptr; };
    Features features{or_null(albedo),           or_null(normal),   or_null(denoising_albedo),
                      or_null(denoising_normal), or_null(position), clean};
    if (!albedo) features.normal = nullptr;
    return features;
  }
};

/// Throws Error(kInput) if the file has no albedo, or other pixels than `place`.
FeatureImages read_features(const std::string& path, const ImagePlace& place, const ColourSpace& colours);

/// What finds the features of a picture in several renders of it.
struct FeatureSearch {
  std::vector<std::string> files;
  Picture picture;
  ColourSpace colours;         ///< of the picture
  std::string albedo, normal;  ///< layers or files; "": by the renderers' names
  bool none = false;
};

/// The features of a picture, from the files that have it. `are_groups`: each file is one group of its samples.
class FeatureLayers {
 public:
  FeatureLayers(const FeatureSearch& search, bool are_groups);
  /// Valid as long as this object lives and stays where it is.
  Features view() { return features_.view(); }
  std::optional<Image> take(feature::Index kind) { return features_.take(kind); }
  std::string text() const;

 private:
  bool are_own_ = false;  // files of covary
  RenderFeatures features_;
};

}  // namespace covary
