// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/in_place.h"
#include "passes/integrator.h"
#include "sampling/lambertian_block.h"

namespace covary {

/// What a camera path that goes on carries.
struct PathState {
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

/// Camera paths that an integrator advances together, and for each of them what its loops hand on to one another.
/// `PathType`: what a path carries, a PathState or more; `ChoiceType`: which light a vertex samples, and with which
/// numbers; `ConnectionType`: a light sample that counts if nothing lies between.
template <typename PathType, typename ChoiceType, typename ConnectionType>
struct CameraBatch : ThreadState {
  using Path = PathType;
  using LightChoice = ChoiceType;
  using Connection = ConnectionType;

  /// Makes room for n fresh paths, with so many connections of a vertex; what else the arrays hold is old and is
  /// overwritten before it is read.
  void start(size_t n, size_t n_connections_each = 1) {
    paths.resize(n), rays.resize(n);
    for (Path& path : paths) make_in_place(path, [] { return Path(); });
    if (hits.size() < n) ray_hits.resize(n), hits.resize(n), choices.resize(n), lights.resize(n);
    const size_t most = n * n_connections_each;
    if (blocked.size() < most) blocked.resize(most), connections.resize(most), shadow_rays.resize(most);
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
  std::vector<uint8_t> goes_on;  ///< whether a path is followed further
  std::vector<uint32_t> alive;   ///< places of the paths that go on
};

/// A light that was chosen.
struct EmitterChoice {
  const Emitter* emitter = nullptr;  ///< null: the surface cannot use light samples
  Vec2 u;
  float u_primitive = 0;
};

/// What a light sample adds to the radiance of which sample of the batch.
struct LightConnection {
  Spectrum radiance;
  uint32_t sample;
};

/// The batch of PathTracer.
struct PathBatch final : CameraBatch<PathState, EmitterChoice, LightConnection> {
  LambertianMeshes meshes;
  LambertianBlock block;
  std::vector<const Emitter*> connected;  ///< the lights of the connections, where lights are told apart
};

}  // namespace covary
