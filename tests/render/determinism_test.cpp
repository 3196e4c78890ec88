// SPDX-License-Identifier: Apache-2.0
// The same scene, seed and settings give the same bits for any number of threads, any crop and any interruption.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numeric>
#include <random>
#include <thread>

#include "film/film_file.h"
#include "integrators/path_tracer.h"
#include "render_fixture.h"

namespace covary {
namespace {

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

TestScene load_room(int width, int height) {
  LoadOptions options;
  options.width = width, options.height = height;
  options.make_integrator = [](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    return scene_integrator(parameters);
  };
  return load_file(kRoom, options);
}

PassSettings pass(const TestScene& scene, Sampling sampling, uint32_t spp) {
  PassSettings settings;
  settings.sampling = sampling, settings.seed = 7, settings.spp = spp, settings.filter = scene.loaded.filter;
  return settings;
}

TEST(Determinism, OneTwoAndFiveThreads) {
  const TestScene scene = load_room(70, 45);
  for (const Sampler sampler : {Sampler::kIndependent, Sampler::kSobol})
    for (const Sampling sampling : {Sampling::kIndependent, Sampling::kCrn}) {
      std::vector<Film> films;
      for (const size_t threads : {1, 2, 5}) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        films.push_back(render(scene, 24, 7, sampling, 12, sampler));
      }
      EXPECT_TRUE(same_bits(films[0], films[1]));
      EXPECT_TRUE(same_bits(films[0], films[2]));
    }
}

/// Flat and smooth meshes, one-sided and two-sided, with constant and textured reflectance, delta and other lights; the
/// number of samples leaves blocks partly filled.
TEST(Determinism, VerticesInBlocksHaveTheBitsOfSingleOnes) {
  const std::string body = R"(
    <shape type="cube"><boolean name="flip_normals" value="true"/>
      <transform name="to_world"><scale value="4"/></transform>
      <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.5, 0.3"/></bsdf></shape>
    <shape type="rectangle"><transform name="to_world"><translate x="-1" y="0.3" z="3.5"/></transform>
      <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.2, 0.9, 0"/></bsdf></bsdf></shape>
    <shape type="obj"><string name="filename" value=")" +
                           std::string(COVARY_SOURCE_DIR) + R"(/tests/against_mitsuba/octahedron.obj"/>
      <transform name="to_world"><translate x="1" z="3"/></transform>
      <bsdf type="twosided"><bsdf type="diffuse"><texture name="reflectance" type="checkerboard">
        <transform name="to_uv"><scale x="4" y="4"/></transform></texture></bsdf></bsdf></shape>
    <shape type="sphere"><point name="center" x="0" y="-1" z="3"/><float name="radius" value="0.5"/>
      <bsdf type="roughconductor"/></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="0.5"/><rotate x="1" angle="90"/>
      <translate y="3.9" z="3"/></transform><bsdf type="diffuse"/>
      <emitter type="area"><rgb name="radiance" value="9, 8, 7"/></emitter></shape>
    <emitter type="point"><point name="position" x="-2" y="1" z="1"/></emitter>
    <emitter type="directional"><vector name="direction" x="0.1" y="-1" z="0.2"/></emitter>)";
  const std::string xml = scene_text(body, 33, 21);
  const MakeIntegrator one_by_one = [](const PathLengthSettings& lengths) {
    return std::make_shared<PathTracer<PathParts>>("path", lengths);
  };
  for (const Sampling sampling : {Sampling::kIndependent, Sampling::kCrn})
    EXPECT_TRUE(
        same_bits(render(load_text(xml), 11, 0, sampling), render(load_text(xml, 0, one_by_one), 11, 0, sampling)));
}

TEST(Determinism, AnotherSeedGivesOtherBits) {
  const TestScene scene = load_room(16, 16);
  EXPECT_FALSE(same_bits(render(scene, 2, 1), render(scene, 2, 2)));
}

TEST(Determinism, ACropIsACutOfTheFrame) {
  const TestScene scene = load_room(60, 40);
  for (const Sampler sampler : {Sampler::kIndependent, Sampler::kSobol}) {
    const Film frame = render(scene, 4, 7, Sampling::kIndependent, 2, sampler);
    const CropWindow crop{13, 9, 30, 21};
    Film part(60, 40, crop, 2);
    PassSettings settings = pass(scene, Sampling::kIndependent, 4);
    settings.sampler = sampler, settings.groups = 2;
    render_pass(scene.scene(), scene.integrator(), settings, part);
    for (int y = 0; y < crop.height; ++y)
      for (int x = 0; x < crop.width; ++x) ASSERT_EQ(part.mean(x, y), frame.mean(crop.x + x, crop.y + y));
  }
}

TEST(Determinism, PointsOfSequencesNeedTheGroupsOfTheFilm) {
  const TestScene scene = load_room(16, 16);
  Film film = new_film(scene, 2);
  PassSettings settings = pass(scene, Sampling::kIndependent, 4);
  settings.sampler = Sampler::kSobol;
  EXPECT_THROW(render_pass(scene.scene(), scene.integrator(), settings, film), Error);
}

// A render stopped after random numbers of tiles, written, read and continued until it is complete.
void interrupt_twenty_times(Sampler sampler) {
  const TestScene scene = load_room(70, 45);
  constexpr uint32_t kSpp = 60;
  Film whole = new_film(scene, 12);
  PassSettings settings = pass(scene, Sampling::kCrn, kSpp);
  settings.sampler = sampler, settings.groups = 12;
  int n_tiles = 0;
  std::atomic<int> tiles{0};
  settings.progress = [&](uint64_t, uint64_t) { ++tiles; };
  render_pass(scene.scene(), scene.integrator(), settings, whole);
  n_tiles = tiles;

  const std::string file = test_support::test_file("film.exr");
  std::mt19937 random(5);
  Film film = new_film(scene, 12);
  int interruptions = 0;
  for (bool complete = false; !complete;) {
    std::atomic<bool> stop{false};
    std::atomic<int> left{interruptions < 20 ? 1 + static_cast<int>(random() % (n_tiles / 24)) : n_tiles};
    settings.stop = &stop;
    settings.progress = [&](uint64_t, uint64_t) {
      if (--left <= 0) stop = true;
    };
    complete = render_pass(scene.scene(), scene.integrator(), settings, film).complete;
    if (!complete) ++interruptions;
    write_film(file, film);
    film = read_film(file);
  }
  EXPECT_EQ(interruptions, 20);
  EXPECT_TRUE(same_bits(film, whole));
}
TEST(Determinism, TwentyInterruptions) { interrupt_twenty_times(Sampler::kIndependent); }
TEST(Determinism, TwentyInterruptionsOfSequences) { interrupt_twenty_times(Sampler::kSobol); }

/// The value of a sample of the integrator below, with so many digits that any other order of additions shows.
Spectrum value_of(const CameraSample& sample) {
  const Vec2 u = sample.random.get_2d(1, Event::kLightPosition);
  return Spectrum(1 / (u.x + 1e-3f), u.y, sample.random.get_1d(1, Event::kLobe) / 3);
}

/// An integrator that traces no rays, for tests of how samples are added to the film.
class Numbers final : public Integrator {
 public:
  std::shared_ptr<Integrator> clone() const override { return std::make_shared<Numbers>(); }
  void trace(const Scene&, std::span<CameraSample> samples, PathContext&) const override {
    for (CameraSample& sample : samples) sample.radiance = value_of(sample);
  }
  std::string description() const override { return "numbers"; }
};

/// A map of random sample counts, 0 … most.
std::vector<uint32_t> uneven_map(const Film& film, uint32_t most) {
  std::vector<uint32_t> map(film.counts().size());
  for (size_t i = 0; i < map.size(); ++i) map[i] = static_cast<uint32_t>(mix64(i) % (most + 1));
  return map;
}

// For any number of groups, any step size, and any split of a wave.
TEST(Determinism, AnySplitGivesTheBitsOfOneGo) {
  const TestScene scene = load_room(40, 21);
  const Numbers numbers;
  for (const int groups : {1, 2, 3, 5, 12}) {
    PassSettings settings = pass(scene, Sampling::kIndependent, 200);
    Film whole = new_film(scene, groups);
    for (const bool map : {false, true}) {
      if (map) settings.spp = SampleTarget(uneven_map(whole, 200)), whole = new_film(scene, groups);
      EXPECT_TRUE(render_pass(scene.scene(), numbers, settings, whole).complete);
      for (size_t i = 0; i < whole.counts().size(); ++i) ASSERT_EQ(whole.counts()[i], settings.spp.at(i));
      for (const std::vector<uint32_t>& steps :
           std::vector<std::vector<uint32_t>>{{100}, {1, 2, 3, 5, 7, 11, 13, 17}, {199}, {25, 96, 97, 150}, {16, 17}}) {
        Film film = new_film(scene, groups);
        for (uint32_t limit : steps) {
          settings.limit = limit;
          EXPECT_TRUE(render_pass(scene.scene(), numbers, settings, film).complete);
          for (size_t i = 0; i < film.counts().size(); ++i)
            ASSERT_EQ(film.counts()[i], std::min(limit, settings.spp.at(i)));
        }
        settings.limit = UINT32_MAX;
        render_pass(scene.scene(), numbers, settings, film);
        EXPECT_TRUE(same_bits(film, whole)) << groups << " groups, first step " << steps[0];
      }
    }
  }
}

/// Which of two coincident surfaces a ray meets follows from rounding, and may not depend on the rays beside it.
TEST(Determinism, CoincidentSurfacesLookTheSameInAnyBatch) {
  std::string body = R"(<emitter type="constant"/>)";
  for (int i = 0; i < 200; ++i)
    body +=
        fmt::format(R"(<shape type="rectangle"><transform name="to_world"><rotate z="1" angle="{}"/><scale value="0.7"/>
      <translate x="{}" y="{}"/><rotate x="1" y="0.3" angle="40"/><translate z="4"/></transform>
      <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="{}"/></bsdf></bsdf></shape>)",
                    37 * i, std::fmod(0.618034 * i, 4.0) - 2, 0.02 * i - 2, i % 2 ? "0.9, 0.1, 0.1" : "0.1, 0.1, 0.9");
  const TestScene scene = load_text(scene_text(body, 120, 90));
  PassSettings settings = pass(scene, Sampling::kIndependent, 9);
  Film whole = new_film(scene, 1), in_steps = new_film(scene, 1);
  render_pass(scene.scene(), scene.integrator(), settings, whole);
  for (const uint32_t limit : {1, 2, 3, 5, 7, 9}) {
    settings.limit = limit;
    render_pass(scene.scene(), scene.integrator(), settings, in_steps);
  }
  EXPECT_TRUE(same_bits(whole, in_steps));
}

// Stops in the middle of waves, with different counts per pixel.
TEST(Determinism, StopsInWavesOfAMapLeaveTheBits) {
  const TestScene scene = load_room(70, 45);
  const Numbers numbers;
  for (const int groups : {1, 3, 12}) {
    PassSettings settings = pass(scene, Sampling::kCrn, 0);
    Film whole = new_film(scene, groups), film = whole;
    settings.spp = SampleTarget(uneven_map(whole, 90));
    uint64_t total = 0, last = 0;
    settings.progress = [&](uint64_t done, uint64_t of) { last = std::max(last, done), total = of; };
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(render_pass(scene.scene(), numbers, settings, whole).n_samples, total);
    EXPECT_EQ(last, total);
    EXPECT_EQ(total, std::accumulate(whole.counts().begin(), whole.counts().end(), uint64_t{0}));

    std::mt19937 random(5);
    uint64_t n_samples = 0;
    for (bool complete = false; !complete;) {
      std::atomic<bool> stop{false};
      int left = 1 + static_cast<int>(random() % 25);
      settings.stop = &stop;
      settings.progress = [&](uint64_t, uint64_t of) {
        EXPECT_EQ(of, total - n_samples) << "what was still to be done when the call began";
        if (--left <= 0) stop = true;
      };
      const PassResult result = render_pass(scene.scene(), numbers, settings, film);
      n_samples += result.n_samples;
      complete = result.complete;
    }
    EXPECT_EQ(n_samples, total);
    EXPECT_TRUE(same_bits(film, whole)) << groups;
  }
}

TEST(Determinism, AMapsPixelsAreThoseOfUniformFilms) {
  const TestScene scene = load_room(33, 20);
  Film film = new_film(scene, 5);
  PassSettings settings = pass(scene, Sampling::kIndependent, 0);
  settings.spp = SampleTarget(uneven_map(film, 12));
  EXPECT_TRUE(render_pass(scene.scene(), scene.integrator(), settings, film).complete);
  for (uint32_t spp : {1u, 7u, 12u}) {
    const Film uniform = render(scene, spp, 7, Sampling::kIndependent, 5);
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 33; ++x) {
        if (film.count(x, y) != spp) continue;
        ASSERT_EQ(film.mean(x, y), uniform.mean(x, y));
        for (int g = 0; g < 5; ++g) ASSERT_EQ(film.group_mean(x, y, g), uniform.group_mean(x, y, g));
      }
  }
  Film other(33, 20, {3, 2, 10, 10}, 5);
  EXPECT_TRUE(test_support::contains(
      test_support::message_of([&] { render_pass(scene.scene(), scene.integrator(), settings, other); }),
      "another size than the film"));
}

TEST(Determinism, WavesDoubleUntilAboutSixteenSamples) {
  const auto ends = [](int groups) {
    std::vector<uint32_t> all;
    for (uint32_t count = 0; all.size() < 6; all.push_back(count)) count = wave_end(count, groups);
    return all;
  };
  EXPECT_EQ(ends(1), (std::vector<uint32_t>{1, 2, 4, 8, 16, 32}));
  EXPECT_EQ(ends(5), (std::vector<uint32_t>{5, 10, 15, 30, 45, 60}));
  EXPECT_EQ(ends(12), (std::vector<uint32_t>{12, 24, 36, 48, 60, 72}));
  EXPECT_EQ(ends(40), (std::vector<uint32_t>{40, 80, 120, 160, 200, 240}));
  EXPECT_EQ(wave_end(7, 1), 8u) << "from the middle of a wave to its end";
}

TEST(Determinism, StoppedInAWaveNoPixelHasLessThanHalfTheSamplesOfAnother) {
  const TestScene scene = load_room(64, 48);
  for (const int n_tiles : {15, 30, 40, 50}) {  // a wave has 12 tiles; the first takes one sample per pixel
    Film film = new_film(scene);
    PassSettings settings = pass(scene, Sampling::kIndependent, 1u << 30);
    std::atomic<bool> stop{false};
    std::atomic<int> left{n_tiles};
    settings.stop = &stop;
    settings.progress = [&](uint64_t, uint64_t) {
      if (--left <= 0) stop = true;
    };
    EXPECT_FALSE(render_pass(scene.scene(), scene.integrator(), settings, film).complete);
    const auto [lowest, highest] = std::minmax_element(film.counts().begin(), film.counts().end());
    EXPECT_GE(*lowest, 1u);
    EXPECT_LE(*highest, 2 * *lowest);
  }
}

TEST(Determinism, TimeLimitStopsAfterATile) {
  const TestScene scene = load_room(64, 48);
  Film film = new_film(scene);
  PassSettings settings = pass(scene, Sampling::kIndependent, 1u << 30);
  settings.seconds = 1e-9;  // over when the first tile is done, however fast
  const PassResult result = render_pass(scene.scene(), scene.integrator(), settings, film);
  EXPECT_FALSE(result.complete);
  EXPECT_GE(result.n_samples, 256u);
  EXPECT_EQ(*std::max_element(film.counts().begin(), film.counts().end()), 1u);
}

TEST(Determinism, ReplayGivesTheSampleThatEntersTheFilm) {
  const TestScene scene = load_room(20, 20);
  const Film film = render(scene, 1, 7);
  const ReplayedSample sample =
      replay_sample(scene.scene(), scene.integrator(), pass(scene, Sampling::kIndependent, 1), 11, 13, 0);
  EXPECT_EQ(sample.value, film.mean(11, 13));
  EXPECT_GT(sample.n_rays, 0u);
}

TEST(Determinism, DoublingAllLightsDoublesTheImage) {
  const auto text = [](const char* radiance) {
    return scene_text(
        std::string("<shape type='sphere'><point name='center' x='0' y='0' z='5'/><bsdf type='plastic'/></shape>"
                    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/>"
                    "<translate y='3' z='4'/></transform><emitter type='area'><rgb name='radiance' value='") +
            radiance + "'/></emitter></shape>",
        20, 20);
  };
  const Film one = render(load_text(text("1.5")), 8, 0), two = render(load_text(text("3")), 8, 0);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 20; ++x) ASSERT_EQ(two.mean(x, y), one.mean(x, y) * 2);
}

TEST(CommonRandomNumbers, AFlatUniformlyLitWallIsFlat) {
  // A wall that fills the view, lit only by a constant environment: all pixels' paths see the same.
  const TestScene scene = load_text(
      scene_text("<shape type='rectangle'><transform name='to_world'><scale value='1000'/><rotate y='1' "
                 "angle='180'/><translate z='1'/></transform>"
                 "<bsdf type='diffuse'><rgb name='reflectance' value='0.5'/></bsdf></shape><emitter type='constant'/>",
                 24, 16, 3, "<float name='fov' value='20'/>"));
  const Film crn = render(scene, 24, 5, Sampling::kCrn, 12);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 24; ++x)
      for (int t = 0; t < 12; ++t) ASSERT_EQ(crn.group_mean(x, y, t), crn.group_mean(0, 0, t));
  // Planted bug: independent random numbers, which do not give a flat image.
  const Film independent = render(scene, 24, 5, Sampling::kIndependent, 12);
  EXPECT_NE(independent.group_mean(0, 0, 0), independent.group_mean(1, 0, 0));
}

TEST(CommonRandomNumbers, TwoRendersAreTheSame) {
  const TestScene scene = load_room(30, 20);
  EXPECT_TRUE(same_bits(render(scene, 12, 9, Sampling::kCrn, 12), render(scene, 12, 9, Sampling::kCrn, 12)));
}

}  // namespace
}  // namespace covary
