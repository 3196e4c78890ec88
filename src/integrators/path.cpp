// SPDX-License-Identifier: Apache-2.0
// `path`: path tracing (path_tracer.h) with uniform light selection, the power heuristic and BSDF sampling; in scenes
// with participating media, by medium_path.h.
#include <algorithm>

#include "integrators/medium_path.h"
#include "integrators/path_tracer.h"

namespace covary {
namespace {

constexpr int kDirectEdges = 2;  // camera, one surface, light

struct Plain : PathParts {
  static constexpr bool kInBlocks = true;
};

/// Separates radiance by the lights it comes from.
struct ByLight : Plain {
  std::shared_ptr<const LightParts> parts;
  void begin(size_t n_samples, PathContext& context) const { parts->begin(n_samples, context); }
  void add_light(const Emitter* light, uint32_t sample, const Spectrum& radiance, PathContext& context) const {
    if (light && !is_black(radiance)) parts->add(*light, sample, radiance, context);
  }
  void connect_with(const Emitter& light, size_t n, PathBatch& batch) const {
    if (batch.connected.size() <= n) batch.connected.resize(batch.connections.size());
    batch.connected[n] = &light;
  }
  const Emitter* light_of(size_t n, const PathBatch& batch) const { return batch.connected[n]; }
};

const LightParts* light_parts(const PathParts&) { return nullptr; }
const LightParts* light_parts(const ByLight& by_light) { return by_light.parts.get(); }

/// Path tracing whose surfaces are traced by PathTracer<Parts>.
template <typename Parts>
class PathIntegrator final : public Integrator {
 public:
  explicit PathIntegrator(const PathLengthSettings& lengths, Parts parts = {})
      : lengths_(lengths), parts_(parts), surfaces_("path", lengths, parts) {}

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<PathIntegrator>(lengths_, parts_); }
  void prepare(const Scene& scene) override { surfaces_.prepare(scene); }
  std::unique_ptr<ThreadState> make_thread_state() const override { return surfaces_.make_thread_state(); }
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    if (!scene.has_media()) {
      surfaces_.trace(scene, samples, context);
    } else if (lengths_.max_depth > 0) {
      parts_.begin(samples.size(), context);
      for (uint32_t i = 0; i < samples.size(); ++i)
        MediumPath(scene, lengths_, samples[i], context, light_parts(parts_), i).trace();
    }
  }
  std::shared_ptr<Integrator> by_light(std::span<const std::string> groups) const override {
    return std::make_shared<PathIntegrator<ByLight>>(lengths_, ByLight{{}, std::make_shared<LightParts>(groups)});
  }
  std::shared_ptr<Integrator> of_direct_light() const override {
    PathLengthSettings direct = lengths_;
    direct.max_depth = std::min(direct.max_depth, kDirectEdges);
    return std::make_shared<PathIntegrator<Plain>>(direct);
  }
  bool sees_media() const override { return true; }
  std::string description() const override { return surfaces_.description(); }

 private:
  PathLengthSettings lengths_;
  Parts parts_;
  PathTracer<Parts> surfaces_;
};

}  // namespace

std::shared_ptr<Integrator> make_path(Settings&, const PathLengthSettings& lengths) {
  return std::make_shared<PathIntegrator<Plain>>(lengths);
}

}  // namespace covary
