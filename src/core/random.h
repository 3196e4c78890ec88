// SPDX-License-Identifier: Apache-2.0
// Random numbers with addresses. Every number a path reads is a pure function of
//     (seed, pass, pixel or none, sample, dimension),
// so that a result does not depend on threads, tiles or order, any sample can be replayed alone, and common random
// numbers differ from independent ones in one thing only: the pixel is left out of the key.
//
// The dimension is itself an address (subpath, vertex of it, event at that vertex). Two neighbouring pixels' paths
// read the same number for the same event although one of them may have drawn fewer numbers before it.
//
// With Sampler::kSobol the numbers that the samples of a group read for one event are points of one scrambled Sobol'
// sequence (core/sobol.h); groups, events, pixels, passes and seeds have scrambles of their own.
#pragma once

#include <cstdint>

#include "core/sobol.h"
#include "core/vec.h"

namespace covary {

/// 64-bit finaliser with full avalanche ("variant 13" of D. Stafford, as used by SplitMix64).
inline uint64_t mix64(uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}
/// Key of the pair (a, b); not symmetric.
inline uint64_t combine64(uint64_t a, uint64_t b) {
  return mix64(mix64(a + 0x9e3779b97f4a7c15ull) ^ (b * 0xd1342543de82ef95ull + 0x632be59bd9b4e019ull));
}

/// What a random number decides. One vertex of a path has kEventsPerVertex addresses.
enum class Event : uint32_t {
  kPixel,           ///< position inside the pixel (vertex 0)
  kLens,            ///< position on the lens (vertex 0)
  kLightChoice,     ///< which emitter
  kLightPosition,   ///< where on the emitter
  kLightPrimitive,  ///< which part of the emitter (triangle), and further needs of emitters
  kLightDirection,  ///< direction of emission (light subpaths)
  kLobe,            ///< which lobe of the BSDF
  kDirection,       ///< direction within the lobe
  kRoulette,        ///< survival
  kTechnique,       ///< choice between BSDF and guiding
  kGuide,           ///< direction from guiding
  kConnection,      ///< choices of bidirectional connections
  kDistance,        ///< to the next collision with a medium (streams of flights: medium_flight.h)
  kCollision,       ///< what happens there; at vertex 0: the channel after which distances are drawn
  kShadowDistance,  ///< as kDistance, on the way to a light sample
};
inline constexpr uint32_t kEventsPerVertex = 16;

/// Where the part of a path begins whose vertices are counted.
enum class Subpath : uint32_t { kCamera, kLight };

enum class Sampling : uint32_t { kIndependent, kCrn };

/// How the numbers of a pixel's samples relate to each other: not at all, or as points of a sequence for each group.
enum class Sampler : uint32_t { kIndependent, kSobol };

/// Stream of the numbers of one path, at first those of its camera subpath. Copying is cheap; there is no state.
class PathRandom {
 public:
  /// Key of a path. `pass` numbers the passes of a plan; `pixel` is y * width + x in the full frame, so that crops see
  /// the same numbers; ignored for common random numbers.
  PathRandom(Sampling sampling, uint64_t seed, uint32_t pass, uint64_t pixel, uint64_t sample)
      : key_(combine64(combine64(combine64(seed, pass), sampling == Sampling::kCrn ? ~uint64_t{0} : pixel), sample)),
        sampling_(sampling) {}

  /// The numbers of the path that is sample `index` of a group of samples, for Sampler::kSobol; at most 2^32 - 1 have
  /// the numbers of one sequence. The rest as above.
  static PathRandom sobol(Sampling sampling, uint64_t seed, uint32_t pass, uint64_t pixel, uint32_t group,
                          uint32_t index) {
    constexpr uint64_t kGroups = uint64_t{1} << 63;  // in the place of samples, which are fewer
    PathRandom random(sampling, seed, pass, pixel, kGroups + group);
    random.reversed_index_ = reverse_bits(index);
    return random;
  }

  Sampling sampling() const { return sampling_; }
  /// Equal: all numbers are.
  bool operator==(const PathRandom&) const = default;

  /// The numbers of a subpath of the same path, which share none with another subpath's. Call it on the numbers as
  /// constructed. `index` tells several of one kind apart.
  PathRandom subpath(Subpath kind, uint32_t index = 0) const {
    PathRandom random = *this;
    random.key_ += ((uint64_t{index} * kSubpathKinds + static_cast<uint32_t>(kind)) << 32) * kStep;
    return random;
  }

  /// Whether the numbers are points of sequences.
  bool in_sequence() const { return reversed_index_ != kNoIndex; }
  /// The same numbers for loops over many paths, where they are not points of sequences: the key of a vertex, and the
  /// one number, or the two, of an event there.
  uint64_t vertex_key(uint32_t vertex) const { return key_ + uint64_t{vertex * kEventsPerVertex} * kStep; }
  static float first_number(uint64_t vertex_key, Event event) {
    return to_unit(static_cast<uint32_t>(event_bits(vertex_key, event) >> 32));
  }
  static Vec2 two_numbers(uint64_t vertex_key, Event event) {
    const uint64_t z = event_bits(vertex_key, event);
    return {to_unit(static_cast<uint32_t>(z >> 32)), to_unit(static_cast<uint32_t>(z))};
  }

  /// One number in [0, 1), a multiple of 2^-24.
  float get_1d(uint32_t vertex, Event event) const {
    const uint64_t z = event_bits(vertex_key(vertex), event);
    return to_unit(in_sequence() ? sobol_first(reversed_index_, z) : static_cast<uint32_t>(z >> 32));
  }
  /// Two independent numbers in [0, 1).
  Vec2 get_2d(uint32_t vertex, Event event) const {
    uint64_t z = event_bits(vertex_key(vertex), event);
    if (in_sequence()) z = sobol_point(reversed_index_, z);
    return {to_unit(static_cast<uint32_t>(z >> 32)), to_unit(static_cast<uint32_t>(z))};
  }

 private:
  static float to_unit(uint32_t u) { return static_cast<float>(u >> 8) * 0x1p-24f; }
  /// Dimensions, numbers of vertices times kEventsPerVertex and more, are less than 2^32.
  static uint64_t event_bits(uint64_t vertex_key, Event event) {
    return mix64(vertex_key + (static_cast<uint64_t>(event) + 1) * kStep);
  }
  static constexpr uint64_t kStep = 0x9e3779b97f4a7c15ull;  // odd, so no two dimensions share a number
  static constexpr uint32_t kSubpathKinds = 2;
  static constexpr uint32_t kNoIndex = ~uint32_t{0};
  uint64_t key_;
  uint32_t reversed_index_ = kNoIndex;  // in the sequences of its group
  Sampling sampling_;
};

}  // namespace covary
