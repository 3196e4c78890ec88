// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/in_place.h"
#include "passes/integrator.h"
#include "sampling/lambertian_block.h"

namespace covary {

/// State of an active camera path.
struct PathState {
  Spectrum throughput{1};
  float eta = 1;               ///< product of relative indices of refraction; undoes the radiance scaling in roulette
  Vec3 previous_p;             ///< origin of the last direction sample
  float previous_pdf = 1;      ///< its density per unit solid angle
  bool previous_delta = true;  ///< it came from a delta lobe or the camera
  bool only_null = true;       ///< only null surfaces hit so far
  bool found = false;          ///< whether the ray hit a surface
  uint32_t sample = 0;         ///< index of the sample in the batch
  uint32_t n_smooth = 0;       ///< vertices so far on surfaces with more than delta lobes
};

/// Camera paths that an integrator advances together, and the per-path arrays passed between its loops. `PathType`:
/// state of a path, a PathState or more; `ChoiceType`: the light that a vertex samples, with what else is needed;
/// `ConnectionType`: a light sample that counts if unoccluded.
template <typename PathType, typename ChoiceType, typename ConnectionType>
struct CameraBatch : ThreadState {
  using Path = PathType;
  using LightChoice = ChoiceType;
  using Connection = ConnectionType;

  /// Allocates n fresh paths, with at most this many connections per vertex; other arrays keep stale contents, which
  /// are overwritten before they are read.
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
  std::vector<Ray> rays;  ///< the next ray of each path
  std::vector<RayHit> ray_hits;
  std::vector<SurfaceHit> hits;
  std::vector<LightChoice> choices;
  std::vector<EmitterSample> lights;
  size_t n_connections = 0;
  std::vector<Connection> connections;
  std::vector<Ray> shadow_rays;  ///< one per connection
  std::vector<uint8_t> blocked;
  std::vector<uint8_t> goes_on;  ///< whether a path continues
  std::vector<uint32_t> alive;   ///< indices of the paths that continue
};

/// Contribution of a light sample to a sample of the batch.
struct LightConnection {
  Spectrum radiance;
  uint32_t sample;
};

/// The batch of PathTracer.
struct PathBatch final : CameraBatch<PathState, const Emitter*, LightConnection> {
  LambertianMeshes meshes;
  LambertianBlock block;
  std::vector<const Emitter*> connected;  ///< the lights of the connections, if lights are separated
};

}  // namespace covary
