// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/in_place.h"
#include "integrators/guided_control.h"
#include "integrators/integrator.h"
#include "sampling/guiding_field.h"

namespace covary {

/// Camera paths that GuidedTracer advances together, and for each of them what its loops hand on to one another.
struct GuidedBatch final : ThreadState {
  /// What a path that goes on carries.
  struct Path {
    Spectrum throughput{1};
    Spectrum bsdf_throughput{1};  ///< what it would be if the BSDF had drawn all directions
    float eta = 1;                ///< product of relative indices, undoes the radiance scaling in roulette
    Vec3 previous_p;              ///< where the last direction sample started
    float previous_pdf = 1;       ///< its density per unit solid angle, that of the mixture of BSDF and guide
    bool previous_delta = true;   ///< it came from a delta lobe or the camera
    bool only_null = true;        ///< nothing but null surfaces met so far
    bool found = false;           ///< whether the ray hit a surface
    uint32_t sample = 0;          ///< which of the batch
    uint32_t n_smooth = 0;        ///< vertices so far on surfaces that have more than delta lobes
    uint32_t last_vertex = 0;     ///< address of the numbers of the last vertex
    bool recorded = false;        ///< the last direction sample is the last of the path's trail
  };

  /// Which light a vertex samples, and with which numbers.
  struct LightChoice {
    bool open = false;   ///< the surface can use light samples
    uint32_t light = 0;  ///< its number
    Vec2 u, u_environment;
    float u_primitive = 0;
  };

  /// A light sample that counts if nothing lies between.
  struct Connection {
    Spectrum radiance;
    uint32_t sample;
    uint32_t place;  ///< of `connection_parts`, where the vertex has a control
  };

  /// Of a light sample: what its control needs.
  struct ConnectionParts {
    Spectrum value;        ///< f/p
    uint32_t light;        ///< that was sampled, or ControlledSample::kNoLight: the environment
    float r_light;         ///< its balance weight where nothing lies between
    Spectrum direction;    ///< Σ β N λ / Σ N λ of the dense techniques that draw directions
    TechniqueDensities r;  ///< their balance weights, while coefficients are learnt
  };

  /// A direction sample whose light is known when the path has ended.
  struct Step {
    GuidingSample sample;
    Spectrum throughput;  ///< of the path behind it
    Spectrum before;      ///< radiance of the path before the direction was followed
  };
  /// Direction samples of a path that are recorded; later ones are not.
  static constexpr uint32_t kMaxSteps = 16;

  /// Makes room for n fresh paths; what else the arrays hold is old and is overwritten before it is read.
  void start(size_t n) {
    paths.resize(n), rays.resize(n);
    for (Path& path : paths) make_in_place(path, [] { return Path(); });
    if (hits.size() < n)
      ray_hits.resize(n), hits.resize(n), choices.resize(n), lights.resize(n), environments.resize(n), leaves.resize(n),
          vertices.resize(n);
    for (size_t i = 0; i < n; ++i) vertices[i].active = false;
    control_steps.clear(), control_samples.clear();
    if (blocked.size() < 2 * n) blocked.resize(2 * n), connections.resize(2 * n), shadow_rays.resize(2 * n);
    n_connections = 0;
    if (!recording) return;
    n_steps.assign(n, 0);
    if (steps.size() < n * kMaxSteps) steps.resize(n * kMaxSteps);
  }
  /// Keeps the first n paths.
  void resize(size_t n) { paths.resize(n), rays.resize(n); }
  /// The last step of a path's trail.
  Step& last_step(uint32_t sample) { return steps[sample * kMaxSteps + n_steps[sample] - 1]; }

  std::vector<Path> paths;
  std::vector<Ray> rays;  ///< the next one of each path
  std::vector<RayHit> ray_hits;
  std::vector<SurfaceHit> hits;
  std::vector<LightChoice> choices;
  std::vector<EmitterSample> lights, environments;
  std::vector<uint32_t> leaves;  ///< of the guiding field
  size_t n_connections = 0;
  std::vector<Connection> connections;
  std::vector<Ray> shadow_rays;  ///< one of each connection
  std::vector<uint8_t> blocked;
  std::vector<uint32_t> alive;  ///< places of the paths that go on
  std::vector<uint32_t> ended;  ///< samples of paths that ended at their last vertex, which has a control
  std::vector<ControlledVertexState> vertices;  ///< the last one of each path, by Path::sample
  std::vector<ConnectionParts> connection_parts;

  bool recording = false;
  std::vector<uint32_t> n_steps;       ///< of each path's trail, by Path::sample
  std::vector<Step> steps;             ///< kMaxSteps for each path
  std::vector<GuidingSample> records;  ///< of paths that have ended, until they are collected

  bool recording_control = false;
  std::vector<ControlStep> control_steps;  ///< of this batch
  std::vector<uint32_t> control_samples;   ///< Path::sample of each of them
  SystemSums sums;                         ///< until they are collected
};

}  // namespace covary
