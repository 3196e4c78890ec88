// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/in_place.h"
#include "integrators/integrator.h"

namespace covary {

/// Camera paths that PathTracer advances together, and for each of them what its loops hand on to one another.
struct PathBatch final : ThreadState {
  /// What a path that goes on carries.
  struct Path {
    Spectrum throughput{1};
    float eta = 1;               ///< product of relative indices, undoes the radiance scaling in roulette
    Vec3 previous_p;             ///< where the last direction sample started
    float previous_pdf = 1;      ///< its density per unit solid angle
    bool previous_delta = true;  ///< it came from a delta lobe or the camera
    bool only_null = true;       ///< nothing but null surfaces met so far
    bool found = false;          ///< whether the ray hit a surface
    uint32_t sample = 0;         ///< which of the batch
    uint32_t n_smooth = 0;       ///< vertices so far on surfaces that have more than delta lobes
  };

  /// Which light a vertex samples, and with which numbers.
  struct LightChoice {
    const Emitter* emitter = nullptr;  ///< null: the surface cannot use light samples
    Vec2 u;
    float u_primitive = 0;
  };

  /// A light sample that counts if nothing lies between.
  struct Connection {
    Spectrum radiance;
    uint32_t sample;
  };

  /// Makes room for n fresh paths; what else the arrays hold is old and is overwritten before it is read.
  void start(size_t n) {
    paths.resize(n), rays.resize(n);
    for (Path& path : paths) make_in_place(path, [] { return Path(); });
    if (hits.size() < n) ray_hits.resize(n), hits.resize(n), choices.resize(n), lights.resize(n);
    if (blocked.size() < n) blocked.resize(n), connections.resize(n), shadow_rays.resize(n);
    n_connections = 0;
  }
  /// Keeps the first n paths.
  void resize(size_t n) { paths.resize(n), rays.resize(n); }

  std::vector<Path> paths;
  std::vector<Ray> rays;  ///< the next one of each path
  std::vector<RayHit> ray_hits;
  std::vector<SurfaceHit> hits;
  std::vector<LightChoice> choices;
  std::vector<EmitterSample> lights;
  size_t n_connections = 0;
  std::vector<Connection> connections;
  std::vector<Ray> shadow_rays;  ///< one of each connection
  std::vector<uint8_t> blocked;
  std::vector<uint32_t> alive;  ///< places of the paths that go on
};

}  // namespace covary
