// SPDX-License-Identifier: Apache-2.0
// Light passes with the light tracer of tests/support: expected images, identical bits, and invalid splats.
#include "passes/light_pass.h"

#include <tbb/global_control.h>

#include <cmath>
#include <random>
#include <tuple>

#include "film/film_file.h"
#include "film/splat_layer.h"
#include "render_fixture.h"
#include "statistics/p_values.h"
#include "support/light_tracer.h"

namespace covary {
namespace {

using test_support::corner_text, test_support::LightTracer;

/// The scene with a light tracer for all pixels of its film; LightTracing::kOff gives `path`.
TestScene light_scene(const std::string& text, LightTracing mode = LightTracing::kOn, float share = 1) {
  TestScene scene = load_text(text, 0, [&](PathLengthSettings lengths) {
    lengths.max_depth = 4, lengths.rr_depth = PathLengthSettings::kUnlimited;
    return std::make_shared<LightTracer>(LightTracingSettings{mode}, lengths, share);
  });
  const Film film = new_film(scene);
  dynamic_cast<LightTracingIntegrator&>(*scene.loaded.integrator).fix_light_tracing(film.counts().size(), false);
  return scene;
}

const LightTracingIntegrator& tracer(const TestScene& scene) { return *light_tracer(scene.integrator()); }

PassSettings light_settings(const TestScene& scene, uint32_t bundles, uint64_t seed = 7) {
  PassSettings settings;
  settings.seed = seed, settings.pass = kLightPass, settings.spp = bundles, settings.filter = scene.loaded.filter;
  return settings;
}

Film light_film(const TestScene& scene, uint32_t bundles, int groups, uint64_t seed = 7) {
  Film film = new_film(scene, groups);
  EXPECT_TRUE(render_light_pass(scene.scene(), tracer(scene), light_settings(scene, bundles, seed), film).complete);
  return film;
}

/// Compares two films with many groups: the mean square of the pixels' differences over their standard errors (about 1
/// if only noise differs), the largest of them, and the same for the image mean.
struct Difference {
  double mean_square = 0, largest = 0, image = 0;
};
Difference difference(const Film& a, const Film& b) {
  Difference d;
  size_t n = 0;
  statistics::Moments image_a, image_b;
  for (int g = 0; g < a.groups(); ++g) {
    double sum_a = 0, sum_b = 0;
    for (int y = 0; y < a.height(); ++y)
      for (int x = 0; x < a.width(); ++x) sum_a += mean(a.group_mean(x, y, g)), sum_b += mean(b.group_mean(x, y, g));
    image_a.add(sum_a), image_b.add(sum_b);
  }
  const auto score = [](const statistics::Moments& u, const statistics::Moments& v) {
    return std::abs(u.mean() - v.mean()) / std::sqrt(u.variance_of_mean() + v.variance_of_mean());
  };
  d.image = score(image_a, image_b);
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x) {
      statistics::Moments u, v;
      for (int g = 0; g < a.groups(); ++g) u.add(mean(a.group_mean(x, y, g))), v.add(mean(b.group_mean(x, y, g)));
      if (u.variance_of_mean() + v.variance_of_mean() == 0) continue;
      const double z = score(u, v);
      d.mean_square += z * z, d.largest = std::max(d.largest, z), ++n;
    }
  d.mean_square /= static_cast<double>(n);
  return d;
}

TEST(LightPass, HasTheImageOfPathTracing) {
  const std::string thin_lens = "<float name='aperture_radius' value='0.05'/><float name='focus_distance' value='4'/>";
  for (const auto& [filter, type, sensor] : {std::tuple{"box", "perspective", ""},
                                             {"tent", "perspective", ""},
                                             {"gaussian", "thinlens", thin_lens.c_str()}}) {
    const std::string text = corner_text(16, 12, filter, type, sensor);
    const TestScene path = light_scene(text, LightTracing::kOff);
    ASSERT_EQ(light_tracer(path.integrator()), nullptr);
    const Film camera = render(path, 64 * 16, 3, Sampling::kIndependent, 64);
    for (const float share : {1.0f, 0.97f}) {  // the second loses light
      const Difference d = difference(light_film(light_scene(text, LightTracing::kOn, share), 64 * 16, 64), camera);
      EXPECT_LT(d.mean_square, share == 1 ? 1.15 : 1.4) << filter;
      EXPECT_LT(d.largest, 4.5) << filter;
      EXPECT_EQ(d.image < 3.5, share == 1) << filter << " " << d.image;
    }
  }
}

/// Films record the radiance times their matrix, which may be negative: of camera samples, of light paths, and of
/// replayed ones.
TEST(LightPass, FilmsRecordTheirResponse) {
  const std::string plain_text = corner_text(16, 12, "box"), film = "<film type='hdrfilm'>";
  std::string text = plain_text;
  text.insert(text.find(film) + film.size(),
              "<transform name='response'><matrix value='.5 -2 .25 0  .1 1.5 0 0  0 -.25 2 0  0 0 0 1'/></transform>");
  const Spectrum rows[] = {{0.5f, -2, 0.25f}, {0.1f, 1.5f, 0}, {0, -0.25f, 2}};
  for (const LightTracing mode : {LightTracing::kOff, LightTracing::kOn}) {
    const TestScene plain = light_scene(plain_text, mode), balanced = light_scene(text, mode);
    const auto film_of = [&](const TestScene& scene) {
      return mode == LightTracing::kOn ? light_film(scene, 16, 4) : render(scene, 4, 3);
    };
    const Film a = film_of(plain), b = film_of(balanced);
    int n_negative = 0;
    for (int y = 0; y < 12; ++y)
      for (int x = 0; x < 16; ++x) {
        const Spectrum radiance = a.mean(x, y), recorded = b.mean(x, y);
        n_negative += recorded.r < 0;
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(recorded[c], rows[c].r * radiance.r + rows[c].g * radiance.g + rows[c].b * radiance.b,
                      1e-5f * (1 + 3 * max_component(radiance)));
      }
    EXPECT_GT(n_negative, 20);
  }
  const TestScene scene = light_scene(text, LightTracing::kOff);
  PassSettings settings;
  settings.seed = 3, settings.filter = scene.loaded.filter;
  const Film one = render(scene, 1, 3);
  EXPECT_EQ(replay_sample(scene.scene(), scene.integrator(), settings, 7, 5, 0).value, one.mean(7, 5));
}

TEST(LightPass, ACropHasTheImageOfItsPixels) {
  const TestScene whole = light_scene(corner_text(16, 12, "gaussian"));
  const CropWindow crop{3, 2, 9, 8};
  Film part(16, 12, crop, 4);
  const PassSettings settings = light_settings(whole, 16);
  EXPECT_TRUE(render_light_pass(whole.scene(), tracer(whole), settings, part).complete);
  const Film frame = light_film(whole, 16, 4);
  for (int y = 0; y < crop.height; ++y)
    for (int x = 0; x < crop.width; ++x) ASSERT_EQ(part.mean(x, y), frame.mean(crop.x + x, crop.y + y));
}

TEST(LightPass, RoundsGrowFourfold) {
  const auto ends = [](int groups) {
    std::vector<uint32_t> all;
    for (uint32_t count = 0; all.size() < 8; all.push_back(count)) count = light_round_end(count, groups);
    return all;
  };
  EXPECT_EQ(ends(1), (std::vector<uint32_t>{1, 4, 16, 64, 256, 1024, 2048, 3072}));
  EXPECT_EQ(ends(12), (std::vector<uint32_t>{12, 48, 192, 768, 1020, 2040, 3060, 4080}));
  EXPECT_EQ(ends(1024), (std::vector<uint32_t>{1024, 2048, 3072, 4096, 5120, 6144, 7168, 8192}));
  EXPECT_EQ(light_round_end(20, 5), 80u) << "from the middle of a round to its end";
  EXPECT_EQ(light_round_end(UINT32_MAX - 3, 2), UINT32_MAX - 1);
}

TEST(LightPass, OneTwoAndSevenThreads) {
  const TestScene scene = light_scene(corner_text(16, 12, "gaussian"), LightTracing::kOn, 0.5f);
  for (const int groups : {1, 12}) {
    std::vector<Film> films;
    for (const size_t threads : {1, 2, 7}) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      films.push_back(light_film(scene, 240, groups));
    }
    EXPECT_TRUE(same_bits(films[0], films[1]));
    EXPECT_TRUE(same_bits(films[0], films[2]));
    EXPECT_EQ(light_paths(films[0]), 240u * kBundlePaths);
    EXPECT_FALSE(same_bits(films[0], light_film(scene, 240, groups, 8))) << "another seed";
  }
}

TEST(LightPass, InterruptionsLeaveNoTrace) {
  const TestScene scene = light_scene(corner_text(16, 12, "tent"));
  const Film whole = light_film(scene, 240, 12);
  const std::string file = test_support::test_file("light.exr");
  std::mt19937 random(5);
  Film film = new_film(scene, 12);
  uint64_t n_paths = 0;
  int interruptions = 0;
  for (bool complete = false; !complete;) {
    std::atomic<bool> stop{false};
    std::atomic<int> left{static_cast<int>(random() % 250)};  // bundles until the stop; the largest round has 144
    PassSettings settings = light_settings(scene, 240);
    settings.stop = &stop;
    settings.progress = [&](uint64_t, uint64_t) {
      if (--left <= 0) stop = true;
    };
    const PassResult result = render_light_pass(scene.scene(), tracer(scene), settings, film);
    n_paths += result.n_samples;
    complete = result.complete;
    interruptions += complete ? 0 : 1;
    write_film(file, film);
    film = read_film(file);
  }
  EXPECT_GT(interruptions, 1);
  EXPECT_EQ(n_paths, 240u * kBundlePaths);
  EXPECT_TRUE(same_bits(film, whole));
}

TEST(LightPass, EndsWhenTimeIsOver) {
  const TestScene scene = light_scene(corner_text(16, 12, "box"));
  Film film = new_film(scene);
  PassSettings settings = light_settings(scene, 4000);
  settings.seconds = 1e-9;  // over when the first bundle is done, however fast
  EXPECT_FALSE(render_light_pass(scene.scene(), tracer(scene), settings, film).complete);
  EXPECT_LT(light_paths(film), 4000u * kBundlePaths);
}

TEST(LightPass, ReplayListsThePathsSplats) {
  const TestScene scene = light_scene(corner_text(16, 12, "gaussian"));
  const Film film = light_film(scene, 1, 1);
  Film replayed = new_film(scene);
  SplatLayer layer(replayed);
  ASSERT_TRUE(layer.begin_round(1));
  const PassSettings settings = light_settings(scene, 1);
  for (uint64_t path = 0; path < kBundlePaths; ++path) {
    const ReplayedLightPath one = replay_light_path(scene.scene(), tracer(scene), settings, film.crop(), path);
    EXPECT_GT(one.n_rays, 0u);
    for (const LightSplat& splat : one.splats) layer.add(splat.path, splat.x, splat.y, splat.value);
  }
  layer.finish_round();
  EXPECT_TRUE(same_bits(film, replayed));
}

/// Produces splats, some of them invalid, in an arbitrary order of paths.
class BadSplats final : public LightTracingIntegrator {
 public:
  BadSplats() : LightTracingIntegrator({}) {}
  std::shared_ptr<Integrator> clone() const override { return std::make_shared<BadSplats>(); }
  void trace(const Scene&, std::span<CameraSample>, PathContext&) const override {}
  void trace_light_paths(const Scene&, const LightPaths& paths, std::vector<LightSplat>& splats,
                         PathContext&) const override {
    for (uint64_t path = paths.first + paths.count; path-- > paths.first;) {
      splats.push_back({path, 3, 4, Spectrum(1)});
      if (path % 1000 == 17) splats.push_back({path, 5, 6, Spectrum(1, std::nanf(""), 1)});
      if (path % 1000 == 18) splats.push_back({path, 5, 6, Spectrum(-1)});
    }
  }
  std::string description() const override { return light_tracing_text(); }
};

TEST(LightPass, BadSplatsAreCountedAndLeftOut) {
  const TestScene scene = light_scene(corner_text(16, 12, "box"));
  BadSplats bad;
  EXPECT_EQ(bad.description(), "light_tracing=off");
  bad.fix_light_tracing(192, true);
  EXPECT_EQ(light_tracer(bad), nullptr) << "beside common random numbers";
  bad.fix_light_tracing(192, false);
  EXPECT_EQ(bad.description(), "light_tracing=on light_paths_per_spp=192");
  Film film = new_film(scene);
  const PassResult result = render_light_pass(scene.scene(), bad, light_settings(scene, 16), film);
  EXPECT_EQ(result.n_samples, 4096u);
  EXPECT_EQ(result.n_not_finite, 5u);
  EXPECT_EQ(result.n_negative, 5u);
  ASSERT_EQ(result.bad_samples.size(), 10u);
  EXPECT_EQ(result.bad_samples[0].sample, 17u);
  EXPECT_EQ(result.bad_samples[0].x, 5);
  EXPECT_EQ(result.bad_samples[9].sample, 4018u);
  EXPECT_EQ(film.mean(3, 4), Spectrum(1));
  EXPECT_EQ(film.mean(5, 6), Spectrum(0));
}

}  // namespace
}  // namespace covary
