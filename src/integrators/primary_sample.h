// SPDX-License-Identifier: Apache-2.0
// The first random numbers that a path reads, as coordinates of its sample (primary sample space). They are functions
// of the sample's address, so nothing needs recording while paths are traced.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "passes/integrator.h"

namespace covary {

/// Address of the first vertex on a surface with more than delta lobes; paths count such vertices from here, and those
/// on mirrors and glass separately.
inline constexpr uint32_t kFirstSurfaceVertex = 1;
/// Address of the first vertex on a surface with delta lobes only.
inline constexpr uint32_t kDeltaVertices = 1u << 20;

/// Two numbers that are read together.
struct PrimaryPair {
  uint32_t vertex;
  Event event;
};
/// In reading order. Numbers that make discrete choices (light, part of a light, lobe) are left out, because a value is
/// not a smooth function of them, and so is the lens position, which most cameras do not read.
inline constexpr std::array<PrimaryPair, 3> kPrimaryPairs = {{
    {0, Event::kPixel},
    {kFirstSurfaceVertex, Event::kLightPosition},
    {kFirstSurfaceVertex, Event::kDirection},
}};
inline constexpr int kPrimaryDimensions = 2 * kPrimaryPairs.size();

/// The first `dimensions` coordinates of each sample, each in [0, 1), as [sample][dimension]; 1 … kPrimaryDimensions.
inline void primary_coordinates(std::span<const CameraSample> samples, int dimensions,
                                std::vector<float>& coordinates) {
  coordinates.clear();
  for (const CameraSample& sample : samples)
    for (int i = 0; i < dimensions; i += 2) {
      const PrimaryPair& pair = kPrimaryPairs[i / 2];
      const Vec2 u = sample.random.get_2d(pair.vertex, pair.event);
      coordinates.push_back(u.x);
      if (i + 1 < dimensions) coordinates.push_back(u.y);
    }
}

}  // namespace covary
