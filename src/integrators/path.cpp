// SPDX-License-Identifier: Apache-2.0
// `path`: path tracing (path_tracer.h) with uniform light selection, the power heuristic and BSDF sampling; where a
// scene has participating media, by medium_path.h.
#include <algorithm>

#include "integrators/medium_path.h"
#include "integrators/path_tracer.h"

namespace covary {
namespace {

constexpr int kDirectEdges = 2;  // of paths from the camera by one surface to a light

class PathIntegrator final : public Integrator {
 public:
  explicit PathIntegrator(const PathLengthSettings& lengths) : lengths_(lengths), surfaces_("path", lengths) {}

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<PathIntegrator>(lengths_); }
  void prepare(const Scene& scene) override { surfaces_.prepare(scene); }
  std::unique_ptr<ThreadState> make_thread_state() const override { return surfaces_.make_thread_state(); }
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    if (!scene.has_media()) {
      surfaces_.trace(scene, samples, context);
    } else if (lengths_.max_depth > 0) {
      for (CameraSample& sample : samples) MediumPath(scene, lengths_, sample, context).trace();
    }
  }
  std::shared_ptr<Integrator> of_direct_light() const override {
    PathLengthSettings direct = lengths_;
    direct.max_depth = std::min(direct.max_depth, kDirectEdges);
    return std::make_shared<PathIntegrator>(direct);
  }
  bool sees_media() const override { return true; }
  std::string description() const override { return surfaces_.description(); }

 private:
  PathLengthSettings lengths_;
  PathTracer<PathParts> surfaces_;
};

}  // namespace

std::shared_ptr<Integrator> make_path(Settings&, const PathLengthSettings& lengths) {
  return std::make_shared<PathIntegrator>(lengths);
}

}  // namespace covary
