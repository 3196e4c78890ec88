// SPDX-License-Identifier: Apache-2.0
// Polynomial control variates in renders: samples and coordinates of real pixels, exactness, identical bits, noise.
#include "estimators/polynomials.h"

#include <tbb/global_control.h>

#include <chrono>
#include <thread>

#include "estimators/reference_polynomials.h"
#include "film/film_file.h"
#include "integrators/primary_sample.h"
#include "render_fixture.h"
#include "statistics/p_values.h"

namespace covary {
namespace {

/// The same fit as in a render.
PixelEstimate estimate(int dimensions) {
  return [dimensions](std::span<const CameraSample> samples) {
    std::vector<Spectrum> values;
    for (const CameraSample& sample : samples) values.push_back(sample.radiance);
    std::vector<float> coordinates;
    primary_coordinates(samples, dimensions, coordinates);
    return polynomials(values, coordinates, dimensions);
  };
}

PassSettings pass(const TestScene& scene, uint32_t spp, int dimensions, uint64_t seed = 7) {
  PassSettings settings;
  settings.seed = seed, settings.spp = spp, settings.filter = scene.loaded.filter;
  settings.estimate = estimate(dimensions);
  return settings;
}

Film render(const TestScene& scene, const Integrator& integrator, const PassSettings& settings) {
  Film film = new_film(scene);
  EXPECT_TRUE(render_pass(scene.scene(), integrator, settings, film).complete);
  return film;
}

/// A wall lit by a small rectangle that the camera does not see: direct light is smooth in all random numbers of light
/// sampling.
TestScene lit_wall(int width, int height) {
  return load_text(scene_text(
      "<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate y='1' angle='180'/>"
      "<translate z='4'/></transform><bsdf type='diffuse'><rgb name='reflectance' value='0.8, 0.5, "
      "0.2'/></bsdf></shape>"
      "<shape type='rectangle'><transform name='to_world'><scale value='0.5'/><translate x='0.4' y='1.2' z='2.5'/>"
      "</transform><emitter type='area'><rgb name='radiance' value='9'/></emitter></shape>",
      width, height, 2, "<float name='fov' value='20'/>"));
}

/// Radiance is a polynomial of degree 2 in six random numbers, at the addresses that a path uses.
class PolynomialIntegrator final : public Integrator {
 public:
  /// `with_bad`: one sample in 64 is NaN.
  explicit PolynomialIntegrator(bool with_bad = false) : with_bad_(with_bad) {}
  std::shared_ptr<Integrator> clone() const override { return std::make_shared<PolynomialIntegrator>(with_bad_); }
  void trace(const Scene&, std::span<CameraSample> samples, PathContext&) const override {
    for (CameraSample& sample : samples) {
      const Vec2 pixel = sample.random.get_2d(0, Event::kPixel), light = sample.random.get_2d(1, Event::kLightPosition),
                 direction = sample.random.get_2d(1, Event::kDirection);
      sample.radiance = {1 + pixel.x * light.y, direction.x * direction.y + pixel.y * pixel.y, light.x * direction.x};
      if (with_bad_ && sample.random.get_1d(0, Event::kLens) < 1.0f / 64) sample.radiance.g = NAN;
    }
  }
  std::string description() const override { return "polynomial"; }
  static Spectrum integral() { return {1.25f, 0.25f + 1.0f / 3, 0.25f}; }

 private:
  bool with_bad_;
};

double largest_difference(const Film& film, const Spectrum& value) {
  double largest = 0;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x)
      for (int c = 0; c < 3; ++c)
        largest = std::max(largest, std::abs(static_cast<double>(film.mean(x, y)[c]) - value[c]));
  return largest;
}

TEST(PolynomialsInARender, EveryPixelIsExactWhereRadianceIsAPolynomial) {
  const TestScene scene = lit_wall(21, 18);
  const Film film = render(scene, PolynomialIntegrator(), pass(scene, 192, 6));
  EXPECT_LT(largest_difference(film, PolynomialIntegrator::integral()), 2e-6);
  for (uint32_t count : film.counts()) EXPECT_EQ(count, 192u);
  // With fewer coordinates than the radiance depends on, it is not exact.
  EXPECT_GT(
      largest_difference(render(scene, PolynomialIntegrator(), pass(scene, 192, 4)), PolynomialIntegrator::integral()),
      0.01);
}

TEST(PolynomialsInARender, SamplesThatAreNotFiniteAreBlack) {
  const TestScene scene = lit_wall(20, 10);
  PassSettings settings = pass(scene, 48, 2);
  std::atomic<int> black{0};
  settings.estimate = [&](std::span<const CameraSample> samples) {
    for (const CameraSample& sample : samples) black += is_black(sample.radiance);
    return estimate(2)(samples);
  };
  Film film = new_film(scene);
  const PassResult result = render_pass(scene.scene(), PolynomialIntegrator(true), settings, film);
  EXPECT_GT(result.n_not_finite, 100u);
  EXPECT_EQ(static_cast<uint64_t>(black), result.n_not_finite);
  for (float value : film.data()) EXPECT_TRUE(std::isfinite(value));
}

TEST(PolynomialsInARender, AgreesWithTheReferenceOnRealPixels) {
  LoadOptions options;
  options.width = 60, options.height = 40;
  options.make_integrator = [](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    return scene_integrator(parameters);
  };
  const TestScene scene = load_file(std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml", options);
  for (const int d : {2, 4, 6}) {
    PassSettings settings = pass(scene, 100, d);
    double largest = 0, largest_correction = 0;
    settings.estimate = [&](std::span<const CameraSample> samples) {
      std::vector<Spectrum> values;
      for (const CameraSample& sample : samples) values.push_back(sample.radiance);
      std::vector<float> coordinates;
      primary_coordinates(samples, d, coordinates);
      const Spectrum fast = polynomials(values, coordinates, d);
      const std::array<double, 3> exact = reference::polynomials(values, coordinates, d);
      for (int c = 0; c < 3; ++c) {
        statistics::Moments moments;
        for (const Spectrum& value : values) moments.add(value[c]);
        const double unit = std::sqrt(moments.variance_of_mean()) + 1e-6;
        largest = std::max(largest, std::abs(fast[c] - exact[c]) / unit);
        largest_correction = std::max(largest_correction, std::abs(exact[c] - moments.mean()) / unit);
      }
      return fast;
    };
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    Film film(60, 40, {13, 9, 24, 16}, 1);
    EXPECT_TRUE(render_pass(scene.scene(), scene.integrator(), settings, film).complete);
    EXPECT_LT(largest, 1e-4) << d << " dimensions, in standard errors of the mean";
    EXPECT_GT(largest_correction, 1) << d << " dimensions";
  }
}

// ---- bits ----------------------------------------------------------------------------------------------------------

TEST(PolynomialsInARender, BitsDoNotDependOnThreadsOrCrops) {
  const TestScene scene = lit_wall(70, 45);
  std::vector<Film> films;
  for (const size_t threads : {1, 2, 5}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    films.push_back(render(scene, scene.integrator(), pass(scene, 24, 4)));
  }
  EXPECT_TRUE(same_bits(films[0], films[1]));
  EXPECT_TRUE(same_bits(films[0], films[2]));
  const CropWindow crop{13, 9, 30, 21};
  Film part(70, 45, crop, 1);
  render_pass(scene.scene(), scene.integrator(), pass(scene, 24, 4), part);
  for (int y = 0; y < crop.height; ++y)
    for (int x = 0; x < crop.width; ++x) ASSERT_EQ(part.mean(x, y), films[0].mean(crop.x + x, crop.y + y));
}

TEST(PolynomialsInARender, InterruptedAndContinued) {
  const TestScene scene = lit_wall(70, 45);
  const Film whole = render(scene, scene.integrator(), pass(scene, 40, 4));
  const std::string file = test_support::test_file("film.exr");
  Film film = new_film(scene);
  int interruptions = 0;
  for (bool complete = false; !complete; ++interruptions) {
    PassSettings settings = pass(scene, 40, 4);
    std::atomic<bool> stop{false};
    std::atomic<int> left{4};  // tiles until the stop, of 15
    settings.stop = &stop;
    settings.progress = [&](uint64_t, uint64_t) {
      if (--left <= 0) stop = true;
    };
    complete = render_pass(scene.scene(), scene.integrator(), settings, film).complete;
    write_film(file, film);
    film = read_film(file);
    for (uint32_t count : film.counts()) EXPECT_TRUE(count == 0 || count == 40);
  }
  EXPECT_GT(interruptions, 2);
  EXPECT_TRUE(same_bits(film, whole));
}

TEST(PolynomialsInARender, CheckpointsComeBetweenTiles) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const TestScene scene = lit_wall(16, 32);  // two tiles
  PassSettings settings = pass(scene, 16, 2);
  settings.estimate = [](std::span<const CameraSample> samples) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));  // 512 ms in a tile
    return estimate(2)(samples);
  };
  Film film = new_film(scene);
  std::vector<double> counts;
  settings.checkpoint = [&] { counts.push_back(film.mean_count()); };
  const PassResult result = render_pass(scene.scene(), scene.integrator(), settings, film);
  EXPECT_TRUE(result.complete);
  ASSERT_GE(counts.size(), 2u);
  EXPECT_EQ(counts.front(), 8);
  EXPECT_EQ(counts.back(), 16);
  EXPECT_GT(result.estimate_seconds, 1);
  EXPECT_LT(result.estimate_seconds, result.seconds);
}

// ---- noise ---------------------------------------------------------------------------------------------------------

/// Mean squared error of all pixels against `exact` over 32 renders; `means`, if given, receives their image means.
double squared_error(const TestScene& scene, const PassSettings& settings, const Film& exact,
                     std::vector<double>* means = nullptr) {
  double sum = 0;
  for (uint64_t seed = 100; seed < 132; ++seed) {
    PassSettings with_seed = settings;
    with_seed.seed = seed;
    const Film film = render(scene, scene.integrator(), with_seed);
    for (int y = 0; y < film.height(); ++y)
      for (int x = 0; x < film.width(); ++x) sum += std::pow(film.mean(x, y).g - exact.mean(x, y).g, 2);
    if (means) means->push_back(image_mean(film));
  }
  return sum / (32.0 * exact.width() * exact.height());
}

// N = 32 renders of 96 pixels with 64 samples, Student's t-test at alpha = 5e-7 of the change of the image mean by the
// fit, whose expectation is zero up to a bias of O(1/n). With the standard error s of the mean of the 32 changes, it
// detects 8.8 s with power 0.99; the test asserts that this is below 1 % of the mean. Planted bugs: coordinates of
// another sample, which must not help, and coordinates in another range, which must shift the mean.
TEST(PolynomialsInARender, DirectLightHasLessNoiseAndTheRightMean) {
  const TestScene scene = lit_wall(12, 8);
  const Film exact = render(scene, 1 << 15, 1);
  const PassSettings four = pass(scene, 64, 4);
  PassSettings plain = four, shuffled = four, scaled = four;
  plain.estimate = nullptr;
  std::vector<double> means, fitted_means, scaled_means;
  const double noise = squared_error(scene, plain, exact, &means);
  EXPECT_LT(squared_error(scene, four, exact, &fitted_means), 0.1 * noise);

  const auto minus_plain = [&](std::vector<double> values) {
    for (size_t i = 0; i < values.size(); ++i) values[i] -= means[i];
    return values;
  };
  statistics::Moments moments;
  for (double difference : minus_plain(fitted_means)) moments.add(difference);
  EXPECT_LT(statistics::smallest_detectable(std::sqrt(moments.sample_variance()), 32, statistics::test_alpha(), 0.99),
            0.01 * image_mean(exact));
  const statistics::TestResult right = statistics::t_test(minus_plain(fitted_means), 0);
  EXPECT_TRUE(right.accepted) << right.message;

  shuffled.estimate = [](std::span<const CameraSample> samples) {
    std::vector<CameraSample> wrong(samples.begin(), samples.end());
    for (size_t s = 0; s < wrong.size(); ++s) wrong[s].radiance = samples[(s + 1) % samples.size()].radiance;
    return estimate(4)(wrong);
  };
  EXPECT_GT(squared_error(scene, shuffled, exact), noise);

  scaled.estimate = [](std::span<const CameraSample> samples) {
    std::vector<Spectrum> values;
    for (const CameraSample& sample : samples) values.push_back(sample.radiance);
    std::vector<float> coordinates;
    primary_coordinates(samples, 4, coordinates);
    for (float& u : coordinates) u *= 0.9f;
    return polynomials(values, coordinates, 4);
  };
  squared_error(scene, scaled, exact, &scaled_means);
  EXPECT_FALSE(statistics::t_test(minus_plain(scaled_means), 0).accepted);
}

}  // namespace
}  // namespace covary
