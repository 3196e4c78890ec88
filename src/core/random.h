// SPDX-License-Identifier: Apache-2.0
// Addressable random numbers. Every number a path reads is a pure function of
//     (seed, pass, pixel or none, sample, dimension),
// so that results do not depend on threads, tiles or order, any sample can be replayed alone, and common random numbers
// differ from independent ones only in leaving the pixel out of the key.
//
// The dimension is itself an address (subpath, vertex along it, event at that vertex). Paths of neighbouring pixels
// read the same number for the same event even if one of them has drawn fewer numbers before it.
//
// With Sampler::kSobol, the numbers that the samples of a group read for one event are points of one scrambled Sobol'
// sequence (core/sobol.h); groups, events, pixels, passes and seeds each have scrambles of their own.
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

/// What a random number decides. Each path vertex has kEventsPerVertex addresses.
enum class Event : uint32_t {
  kPixel,           ///< position inside the pixel (vertex 0)
  kLens,            ///< position on the lens (vertex 0)
  kLightChoice,     ///< which emitter
  kLightPosition,   ///< where on the emitter
  kLightPrimitive,  ///< which part of the emitter (triangle), and other choices emitters make
  kLightDirection,  ///< direction of emission (light subpaths)
  kLobe,            ///< which lobe of the BSDF
  kDirection,       ///< direction within the lobe
  kRoulette,        ///< Russian roulette
  kTechnique,       ///< choice between BSDF and guiding
  kGuide,           ///< direction from guiding
  kConnection,      ///< choices of bidirectional connections
  kDistance,        ///< to the next collision with a medium (streams within a flight: medium_flight.h)
  kCollision,       ///< what happens there; at vertex 0: the channel by which distances are sampled
  kShadowDistance,  ///< as kDistance, on the way to a light sample
};
inline constexpr uint32_t kEventsPerVertex = 16;

/// The end of the path from which the subpath's vertices are counted.
enum class Subpath : uint32_t { kCamera, kLight };

enum class Sampling : uint32_t { kIndependent, kCrn };

/// How the numbers of a pixel's samples relate to each other: independent, or points of one sequence per group.
enum class Sampler : uint32_t { kIndependent, kSobol };

/// The random numbers of one path, initially of its camera subpath. Cheap to copy; stateless.
class PathRandom {
 public:
  /// Key of a path. `pass` numbers the passes of a plan; `pixel` is y * width + x in the full frame, so that crops read
  /// the same numbers, and is ignored for common random numbers.
  PathRandom(Sampling sampling, uint64_t seed, uint32_t pass, uint64_t pixel, uint64_t sample)
      : key_(combine64(combine64(combine64(seed, pass), sampling == Sampling::kCrn ? ~uint64_t{0} : pixel), sample)),
        sampling_(sampling) {}

  /// The numbers of the path that is sample `index` of a group, for Sampler::kSobol; a sequence serves at most 2^32 - 1
  /// samples. Other arguments as above.
  static PathRandom sobol(Sampling sampling, uint64_t seed, uint32_t pass, uint64_t pixel, uint32_t group,
                          uint32_t index) {
    constexpr uint64_t kGroups = uint64_t{1} << 63;  // in place of sample numbers, which are smaller
    PathRandom random(sampling, seed, pass, pixel, kGroups + group);
    random.reversed_index_ = reverse_bits(index);
    return random;
  }

  Sampling sampling() const { return sampling_; }
  /// Equal if and only if all numbers are.
  bool operator==(const PathRandom&) const = default;

  /// The numbers of a subpath of the same path; no two subpaths share any. Call it on the numbers as constructed.
  /// `index` distinguishes subpaths of the same kind.
  PathRandom subpath(Subpath kind, uint32_t index = 0) const {
    PathRandom random = *this;
    random.key_ += ((uint64_t{index} * kSubpathKinds + static_cast<uint32_t>(kind)) << 32) * kStep;
    return random;
  }

  /// Whether the numbers are points of Sobol' sequences.
  bool in_sequence() const { return reversed_index_ != kNoIndex; }
  /// Faster access for loops over many paths, only if !in_sequence(): the key of a vertex, and one or two numbers of an
  /// event there.
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
  /// Dimensions (vertex times kEventsPerVertex plus event) are below 2^32.
  static uint64_t event_bits(uint64_t vertex_key, Event event) {
    return mix64(vertex_key + (static_cast<uint64_t>(event) + 1) * kStep);
  }
  static constexpr uint64_t kStep = 0x9e3779b97f4a7c15ull;  // odd, so no two dimensions share a number
  static constexpr uint32_t kSubpathKinds = 2;
  static constexpr uint32_t kNoIndex = ~uint32_t{0};
  uint64_t key_;
  uint32_t reversed_index_ = kNoIndex;  // index in the sequences of its group
  Sampling sampling_;
};

}  // namespace covary
