// SPDX-License-Identifier: Apache-2.0
// Splats: contributions of light paths to arbitrary pixels.
//
// A light film is a Film beside the camera's, with its own groups and count. One of its samples is a bundle of
// kBundlePaths light paths: bundle b holds the consecutive paths from b * kBundlePaths on, belongs to group b % groups,
// and its value at a pixel is the sum of its splats there divided by kBundlePaths. So every pixel has the same count,
// means are normalised by the film's own number of light paths, and reading, writing, merging and estimators work as
// for any film.
//
// The bits do not depend on threads or interruptions: each bundle collects its splats in a list; after a round of
// bundles, the lists are summed in path order, in double precision, one band of rows at a time, and only then does the
// film change. Rounds end at the same counts however often a render is interrupted.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "film/film.h"

namespace covary {

inline constexpr uint32_t kBundlePaths = 256;

namespace film_key {
inline constexpr const char* kLight = "light_film";  ///< "added": the image is the sum of a film and a light film
}  // namespace film_key

/// Whether a film with this attribute `settings` is accompanied by a light film.
inline bool has_light_film(std::string_view settings) {
  return settings.find("light_tracing=on") != std::string_view::npos;
}

/// Number of light paths in a light film.
inline uint64_t light_paths(const Film& film) {
  return film.counts().empty() ? 0 : uint64_t{film.count(0, 0)} * kBundlePaths;
}

/// A splat that is negative or not finite. It is left out and counted.
struct BadSplat {
  uint64_t path;
  int x, y;  ///< pixel in the full frame
  Spectrum value;
};

struct SplatCounts {
  uint64_t n_splats = 0;  ///< within the film's crop, without bad ones
  uint64_t n_not_finite = 0, n_negative = 0;
  std::vector<BadSplat> bad_splats;  ///< the first few, in path order
};

class SplatLayer {
 public:
  /// Bundles per round: 2^18 paths, and some 16 MB of splats.
  static constexpr uint32_t kRoundBundles = 1024;

  /// Continues `film`, which must outlive the layer. Marks it as a light film. Throws Error(kInput) when its pixels
  /// differ in count, or when it has samples and is not a light film with bundles of this size. `allows_negative`:
  /// negative splats are no bad ones.
  explicit SplatLayer(Film& film, bool allows_negative = false);

  /// Begins the next round on the way to `target` bundles (a multiple of the film's groups), discarding what an
  /// unfinished round has collected. Returns false if the film already has that many.
  bool begin_round(uint32_t target);
  /// The bundles of the round.
  uint32_t first_bundle() const { return first_; }
  uint32_t end_bundle() const { return end_; }

  /// Adds `value` (radiance at one pixel from a single light path, not divided by the number of paths) at pixel (x, y)
  /// of the full frame; ignored outside the crop. The paths of a bundle must be added in ascending order from one
  /// thread; different bundles may be added from different threads.
  void add(uint64_t path, int x, int y, const Spectrum& value);

  /// Adds the round to the film. All its bundles must be complete.
  void finish_round();
  /// Of the finished rounds.
  const SplatCounts& counts() const { return counts_; }

 private:
  struct Splat {
    uint32_t pixel;  // in the film, row by row
    Spectrum value;
  };
  struct Bundle {
    std::vector<Splat> splats;
    std::vector<BadSplat> bad;
  };
  void add_band(int first_row, int end_row);
  void count_splats();

  Film& film_;
  bool allows_negative_;
  uint32_t first_ = 0, end_ = 0;
  std::vector<Bundle> bundles_;
  SplatCounts counts_;
};

}  // namespace covary
