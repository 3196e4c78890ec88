// SPDX-License-Identifier: Apache-2.0
// Bidirectional path tracing against `path`, and each technique against whole paths with explicit densities
// (reference_bdpt.h). Exact up to rounding; no statistics.
#include "bdpt_scenes.h"
#include "integrators/bidirectional_tracer.h"
#include "integrators/path_tracer.h"
#include "reference_bdpt.h"

namespace covary {
namespace {

using reference_bdpt::Contribution;
using reference_bdpt::Contributions;

/// The techniques s <= 1 only.
struct WithoutLightSubpaths : BidirectionalParts {
  int max_light_vertices() const { return 1; }
};

/// Records the contribution of each technique.
struct RecordingParts : BidirectionalParts {
  Contributions* contributions = nullptr;
  void record(int s, int t, const Spectrum& value, double weight) const {
    const bool fresh = contributions->emplace(std::pair{s, t}, Contribution{value, weight}).second;
    EXPECT_TRUE(fresh) << "technique (" << s << ", " << t << ") twice";
  }
};

struct Scenery {
  const char* name;
  std::string (*body)();
  bool hide_emitters = false;
  const char* lens = "";
};
void PrintTo(const Scenery& scenery, std::ostream* out) { *out << scenery.name; }

const Scenery kSceneries[] = {
    {"area_lights", [] { return materials() + area_lights(); }},
    {"more_materials", [] { return more_materials() + kPoint; }},
    {"all_lights", [] { return materials() + area_lights() + kConstant + kPoint + kSpot + kDirectional; }},
    {"delta_lights", [] { return materials() + kPoint + kSpot + kDirectional; }},
    {"environment", [] { return materials() + kConstant; }, false, kThinLens},
    {"thin_lens", [] { return materials() + area_lights() + kPoint; }, false, kThinLens},
    {"hidden_lights",
     [] { return materials() + area_lights() + kConstant + sphere("0", "0", "2", "0.2", area_light(9)); }, true}};

class Bdpt : public ::testing::TestWithParam<Scenery> {
 protected:
  std::string text(int max_depth, const std::string& more = "") const {
    const std::string hide = "<boolean name='hide_emitters' value='true'/>";
    return bdpt_scene(GetParam().body(), kSize, max_depth, (GetParam().hide_emitters ? hide : "") + more, "",
                      GetParam().lens);
  }
  static constexpr int kSize = 16;
};

double scale_of(const Spectrum& s) { return std::max(1e-6, static_cast<double>(max_component(s))); }

// Both use the same random numbers, densities and heuristic.
TEST_P(Bdpt, WithoutLightSubpathsItIsThePathTracer) {
  const std::string xml = text(-1, "<integer name='rr_depth' value='3'/>");
  const TestScene path = load_text(xml, 0, [](const PathLengthSettings& lengths) {
    return std::make_shared<PathTracer<PathParts>>("path", lengths);
  });
  const TestScene bdpt = load_text(xml, 0, [](const PathLengthSettings& lengths) {
    return std::make_shared<BidirectionalTracer<WithoutLightSubpaths>>(BidirectionalSettings{lengths, {}});
  });
  PassSettings settings;
  int n_lit = 0;
  for (const Sampling sampling : {Sampling::kIndependent, Sampling::kCrn}) {
    settings.sampling = sampling;
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)
        for (uint64_t sample = 0; sample < 8; ++sample) {
          const Spectrum a = replay_sample(path.scene(), path.integrator(), settings, x, y, sample).value;
          const Spectrum b = replay_sample(bdpt.scene(), bdpt.integrator(), settings, x, y, sample).value;
          for (int c = 0; c < 3; ++c) ASSERT_NEAR(a[c], b[c], 1e-5 * scale_of(a)) << x << ' ' << y << ' ' << sample;
          n_lit += !is_black(a);
        }
  }
  EXPECT_GT(n_lit, 1000);
}

/// Counts pairs of contributions that differ. Sampled directions differ a little from those between the vertices found,
/// because rays start at an offset from surfaces: so a few of many do differ, at grazing angles.
struct Agreement {
  int n = 0, n_off = 0;
  void add(const Spectrum& got, const Spectrum& expected, double weight_difference) {
    ++n;
    double difference = weight_difference;
    for (int c = 0; c < 3; ++c)
      difference = std::max(difference, std::abs(got[c] / scale_of(expected) - expected[c] / scale_of(expected)));
    if (!(difference < 0.01)) ++n_off;
  }
  void check() const { EXPECT_LE(n_off, 0.01 * n) << "of " << n; }
};

reference_bdpt::Settings reference_settings(const Scenery& scenery, int max_depth, double light_paths) {
  reference_bdpt::Settings settings;
  settings.max_depth = max_depth, settings.light_paths_per_spp = light_paths;
  settings.hide_emitters = scenery.hide_emitters;
  return settings;
}

BidirectionalSettings tracer_settings(const PathLengthSettings& lengths) { return {lengths, {LightTracing::kOn, 1}}; }

// Each technique finds the path that it should, with the value and the weight of the explicit densities, so the weights
// of all techniques of a path sum to one.
TEST_P(Bdpt, TechniquesEqualDensitiesWrittenOut) {
  constexpr int kMaxDepth = 5;
  for (const bool light_tracing : {false, true}) {
    Contributions found;
    const TestScene scene =
        load_text(text(kMaxDepth, "<integer name='rr_depth' value='100'/>"), 0, [&](const PathLengthSettings& lengths) {
          RecordingParts parts;
          parts.contributions = &found;
          auto tracer = std::make_shared<BidirectionalTracer<RecordingParts>>(tracer_settings(lengths), parts);
          if (light_tracing) tracer->fix_light_tracing(kSize * kSize, false);
          return tracer;
        });
    const reference_bdpt::Sampler reference(
        scene.scene(), reference_settings(GetParam(), kMaxDepth, light_tracing ? kSize * kSize : 0));
    PassSettings settings;
    settings.filter = scene.loaded.filter;
    std::map<std::pair<int, int>, int> counts;
    Agreement agreement;
    for (int i = 0; i < 4000; ++i) {
      const int x = i % kSize, y = i / kSize % kSize;
      found.clear();
      const ReplayedSample replayed = replay_sample(scene.scene(), scene.integrator(), settings, x, y, i);
      const PathRandom random(settings.sampling, 0, 0, static_cast<uint64_t>(y) * kSize + x, i);
      const CameraSample sample{
          scene.scene().camera().ray(replayed.position, random.get_2d(0, Event::kLens)), random, {}};
      const Contributions expected = reference.camera_sample(sample);
      for (const auto& [technique, contribution] : expected) found.emplace(technique, Contribution{});
      for (const auto& [technique, got] : found) {
        const auto match = expected.find(technique);
        const Contribution reference_value = match == expected.end() ? Contribution{} : match->second;
        if (scale_of(got.value) < 1e-5 && scale_of(reference_value.value) < 1e-5) continue;
        ++counts[technique];
        agreement.add(got.value, reference_value.value, std::abs(got.weight - reference_value.weight));
      }
    }
    agreement.check();
    EXPECT_GT(counts[std::pair(2, 2)], 20);
    EXPECT_GT(counts[std::pair(3, 3)], 4);
  }
}

TEST_P(Bdpt, SplatsEqualDensitiesWrittenOut) {
  constexpr int kMaxDepth = 5;
  const TestScene scene =
      load_text(text(kMaxDepth, "<integer name='rr_depth' value='100'/>"), 0, [&](const PathLengthSettings& lengths) {
        auto tracer = std::make_shared<BidirectionalTracer<BidirectionalParts>>(tracer_settings(lengths));
        tracer->fix_light_tracing(kSize * kSize, false);
        return tracer;
      });
  const auto& tracer = dynamic_cast<const LightTracingIntegrator&>(scene.integrator());
  const reference_bdpt::Sampler reference(scene.scene(), reference_settings(GetParam(), kMaxDepth, kSize * kSize));
  const LightPaths paths{7, kLightPass, 0, 20000, SplatFilter(scene.loaded.filter), {0, 0, kSize, kSize}};
  PathContext context(tracer);
  std::vector<LightSplat> splats;
  tracer.trace_light_paths(scene.scene(), paths, splats, context);
  std::map<std::pair<uint64_t, int>, Spectrum> by_pixel;  // path, pixel
  for (const LightSplat& splat : splats) by_pixel[{splat.path, splat.y * kSize + splat.x}] += splat.value;
  Agreement agreement;
  for (uint64_t i = 0; i < paths.count; ++i) {
    std::map<int, Spectrum> expected;
    for (const auto& [s, splat] : reference.light_path(paths.random(i))) {
      const auto& [film, contribution] = splat;
      if (film.x >= 0 && film.x < kSize && film.y >= 0 && film.y < kSize)
        expected[static_cast<int>(film.y) * kSize + static_cast<int>(film.x)] +=
            contribution.value * static_cast<float>(contribution.weight);
    }
    for (const auto& [pixel, value] : expected) agreement.add(by_pixel[{i, pixel}], value, 0);
  }
  agreement.check();
  EXPECT_GT(agreement.n, 200);
  EXPECT_LE(by_pixel.size(), 1.01 * agreement.n);
}

// Samples traced in a batch (with common random numbers: that share a light subpath) equal those traced alone.
TEST_P(Bdpt, SamplesDoNotDependOnTheirBatch) {
  const TestScene scene = load_text(text(-1), 0, [](const PathLengthSettings& lengths) {
    return std::make_shared<BidirectionalTracer<BidirectionalParts>>(BidirectionalSettings{lengths, {}});
  });
  for (const Sampling sampling : {Sampling::kIndependent, Sampling::kCrn}) {
    PassSettings settings;
    settings.sampling = sampling, settings.spp = 5, settings.filter = scene.loaded.filter;
    Film film = new_film(scene, 5);
    render_pass(scene.scene(), scene.integrator(), settings, film);
    for (int y = 0; y < kSize; y += 3)
      for (int x = 0; x < kSize; ++x)
        for (int sample = 0; sample < 5; ++sample)
          ASSERT_EQ(film.group_mean(x, y, sample),
                    replay_sample(scene.scene(), scene.integrator(), settings, x, y, sample).value);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Bdpt, ::testing::ValuesIn(kSceneries),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace covary
