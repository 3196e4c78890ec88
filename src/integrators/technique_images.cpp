// SPDX-License-Identifier: Apache-2.0
#include "integrators/technique_images.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "film/splat_layer.h"
#include "integrators/bidirectional_tracer.h"

namespace covary {
namespace {

/// What a technique adds to a pixel of the window.
struct Addition {
  int s, t, x, y;
  Spectrum value;
  float weight;
};

/// The additions of what is traced now, for one thread.
struct Recording {
  CropWindow window;
  std::vector<Addition> additions;
  int x = 0, y = 0;  // pixel of the samples

  void add(int s, int t, int to_x, int to_y, const Spectrum& value, double weight) {
    if (s + t - 1 <= kTechniqueEdges && is_finite(value))
      additions.push_back({s, t, to_x, to_y, value, static_cast<float>(weight)});
  }
};

/// The parts of `bdpt`, which write down every addition.
struct RecordingParts : BidirectionalParts {
  Recording* recording = nullptr;
  void record(int s, int t, const Spectrum& value, double weight) const {
    recording->add(s, t, recording->x, recording->y, value, weight);
  }
  void record_splat(int s, const SplatPixel& pixel, const Spectrum& value, double weight) const {
    recording->add(s, 1, pixel.x - recording->window.x, pixel.y - recording->window.y, value, weight);
  }
};

/// The integrator with a recording of its own.
struct Recorder {
  Recorder(const Scene& scene, const LightTracingIntegrator& original, const CropWindow& window)
      : recording{window, {}}, tracer(*original.bidirectional(), parts(&recording)) {
    tracer.prepare(scene);
    const uint64_t n_pixels = uint64_t(window.width) * window.height;
    if (original.traces_light()) tracer.fix_light_tracing(n_pixels, false);
    context = std::make_unique<PathContext>(tracer);
  }
  static RecordingParts parts(Recording* recording) {
    RecordingParts result;
    result.recording = recording;
    return result;
  }

  Recording recording;
  BidirectionalTracer<RecordingParts> tracer;
  std::unique_ptr<PathContext> context;
};

class Techniques {
 public:
  Techniques(const Scene& scene, const LightTracingIntegrator& tracer, const PassSettings& settings,
             const CropWindow& window)
      : scene_(scene), tracer_(tracer), settings_(settings), window_(window), spp_(settings.spp.largest()) {
    for (int n = 2; n <= kTechniqueEdges + 1; ++n)
      for (int s = 0; s < n; ++s) {
        const Image black(window.width, window.height, 3);
        images_.push_back({s, n - s, black, black});
      }
  }

  std::vector<TechniqueImage> render() {
    parallel_for(window_.height, [&](int y) {
      Recorder recorder(scene_, tracer_, window_);
      recorder.context->stop = settings_.stop;
      for (int x = 0; x < window_.width && !stopped(); ++x) trace_pixel(x, y, recorder);
    });
    if (tracer_.traces_light()) trace_light();
    std::erase_if(images_, [](const TechniqueImage& image) {
      const std::vector<float>& data = image.unweighted.data;
      return std::all_of(data.begin(), data.end(), [](float value) { return value == 0; });
    });
    return std::move(images_);
  }

 private:
  bool stopped() const { return settings_.stop && settings_.stop->load(std::memory_order_relaxed); }

  void trace_pixel(int x, int y, Recorder& recorder) {
    recorder.recording.x = x, recorder.recording.y = y;
    for (uint32_t s = 0; s < spp_ && !stopped(); ++s) {
      CameraSample sample = camera_sample(scene_, settings_, window_.x + x, window_.y + y, s);
      recorder.tracer.trace(scene_, {&sample, 1}, *recorder.context);
    }
    add(recorder.recording, 1 / static_cast<float>(spp_));
  }

  /// Bundles are traced by many threads and added in their order.
  void trace_light() {
    const double n_paths = std::max(1.0, tracer_.light_paths_per_spp() * spp_);
    const auto n_bundles = static_cast<uint32_t>(std::ceil(n_paths / kBundlePaths));
    constexpr uint32_t kRound = 64;
    std::vector<std::unique_ptr<Recorder>> recorders(kRound);
    for (auto& recorder : recorders) {
      recorder = std::make_unique<Recorder>(scene_, tracer_, window_);
      recorder->context->stop = settings_.stop;
    }
    for (uint32_t first = 0; first < n_bundles && !stopped(); first += kRound) {
      const uint32_t n = std::min(kRound, n_bundles - first);
      parallel_for(n, [&](uint32_t i) {
        const LightPaths paths{
            settings_.seed, kLightPass, uint64_t{first + i} * kBundlePaths, kBundlePaths, SplatFilter(settings_.filter),
            window_};
        std::vector<LightSplat> splats;
        recorders[i]->tracer.trace_light_paths(scene_, paths, splats, *recorders[i]->context);
      });
      for (uint32_t i = 0; i < n; ++i) add(recorders[i]->recording, 1 / (static_cast<float>(n_bundles) * kBundlePaths));
    }
  }

  void add(Recording& recording, float scale) {
    for (const Addition& a : recording.additions) {
      const int n = a.s + a.t;  // the techniques of shorter paths come first
      TechniqueImage& image = images_[static_cast<size_t>(n * (n - 1) / 2 - 1 + a.s)];
      for (int c = 0; c < 3; ++c) {
        image.unweighted.pixel(a.x, a.y)[c] += a.value[c] * scale;
        image.weighted.pixel(a.x, a.y)[c] += a.value[c] * a.weight * scale;
      }
    }
    recording.additions.clear();
  }

  const Scene& scene_;
  const LightTracingIntegrator& tracer_;
  const PassSettings& settings_;
  CropWindow window_;
  uint32_t spp_;
  std::vector<TechniqueImage> images_;
};

}  // namespace

bool has_techniques(const Integrator& integrator) {
  return integrator.light_tracing() && integrator.light_tracing()->bidirectional();
}

std::vector<TechniqueImage> render_techniques(const Scene& scene, const Integrator& integrator,
                                              const PassSettings& settings, const CropWindow& window) {
  if (!has_techniques(integrator)) throw Error(ErrorCode::kUsage, "images of techniques need the integrator 'bdpt'");
  return Techniques(scene, *integrator.light_tracing(), settings, window).render();
}

}  // namespace covary
