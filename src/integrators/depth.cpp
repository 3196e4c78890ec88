// SPDX-License-Identifier: Apache-2.0
// `depth`: the distance from the near plane to the first surface along each camera ray, 0 if there is none.
#include "integrators/path_lengths.h"
#include "integrators/path_steps.h"
#include "passes/integrator.h"

namespace covary {
namespace {

class DepthIntegrator final : public Integrator {
 public:
  std::shared_ptr<Integrator> clone() const override { return std::make_shared<DepthIntegrator>(); }
  std::unique_ptr<ThreadState> make_thread_state() const override { return std::make_unique<PathBatch>(); }
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    PathBatch& batch = context.state_as<PathBatch>();
    batch.start(samples.size());
    for (uint32_t i = 0; i < samples.size(); ++i) batch.rays[i] = samples[i].ray;
    scene.nearest(batch.rays, batch.ray_hits, false);
    context.n_rays += samples.size();
    for (size_t i = 0; i < samples.size(); ++i)
      if (batch.ray_hits[i].found()) samples[i].radiance = Spectrum(batch.ray_hits[i].t);
  }
  bool sees_media() const override { return true; }  // distances do not depend on them
  std::string description() const override { return "depth"; }
};

}  // namespace

std::shared_ptr<Integrator> make_depth(Settings&, const PathLengthSettings&) {
  return std::make_shared<DepthIntegrator>();
}

}  // namespace covary
