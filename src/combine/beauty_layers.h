// SPDX-License-Identifier: Apache-2.0
// Layers that make up a picture, as renderers split it: by lights, or by kinds of light, some of which are divided by
// the colour of the surface. Names by renderer: docs/other-renderers.md.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "combine/layer_sources.h"
#include "film/pictures.h"

namespace covary {

/// Layers that add up to the picture, each times `colour`, if that is named.
struct BeautyLayer {
  std::string name, colour;
  std::string sum;  ///< "lights", "components" or "direct": those of one name add up
};

/// By the names that Blender and Arnold give them; empty if there are none.
std::vector<BeautyLayer> find_beauty_layers(const Picture& picture, const std::vector<ExrFile::Channel>& channels);

/// Layers of several renders of a picture, to be denoised with it.
class BeautyLayers {
 public:
  /// `names`: of layers that add up to the picture, or "all" for those of find_beauty_layers(). `with_alpha`: also the
  /// picture's alpha, if the renders differ in it. Throws like GroupedFile, and Error(kInput) if "all" finds none.
  BeautyLayers(const std::vector<std::string>& files, const Picture& picture, const std::vector<std::string>& names,
               bool with_alpha);

  /// Valid as long as this object.
  std::vector<LayerSource> sources() const;
  /// Makes of the denoised layers what files hold: divides by colours, and limits alpha to 0 to 1.
  void finish(std::map<std::string, Image>& layers) const;

 private:
  struct Entry {
    BeautyLayer layer;
    const GroupedFile *file = nullptr, *colour = nullptr;
  };
  void add(const std::vector<std::string>& files, const BeautyLayer& layer);
  std::deque<GroupedFile> files_;
  std::vector<Entry> entries_;
  std::string alpha_;
};

}  // namespace covary
