// SPDX-License-Identifier: Apache-2.0
// `controlled-path` estimates the same image as `path` for any coefficients.
//
// Statistical cases: 16 renders with seeds 0 … 15; Student's t-test on the means of 16 blocks of the image and of the
// whole, each at alpha = 5e-7. Two renders with one seed share all their random numbers, so that their difference is
// the control variate alone, whose mean must be zero.
#include "integrators/controlled_path.h"

#include <tbb/global_control.h>

#include <optional>
#include <type_traits>

#include "plans/estimator_plans.h"
#include "plans/render.h"
#include "unbiased_images.h"

namespace covary {
namespace {

/// A surface on which many direction samples fail because they point below it.
const std::string kRoughMetal =
    scene_text(rectangle("<scale value='8'/><rotate x='1' angle='-80'/><translate y='-2' z='5'/>",
                         "<bsdf type='roughconductor'><float name='alpha' value='0.9'/></bsdf>") +
                   kMeshLight + "<emitter type='constant'><rgb name='radiance' value='0.5'/></emitter>",
               kSide, kSide, 3, kWide);

/// A diffuse floor below lights of different colours.
std::string coloured_lights() {
  std::string lights;
  for (int i = 0; i < 6; ++i)
    lights += sphere(("x='" + std::to_string(2 * i - 5) + "' y='6' z='5'").c_str(),
                     i % 2 ? "<float name='radius' value='0.3'/><emitter type='area'><rgb name='radiance' "
                             "value='9,1,1'/></emitter>"
                           : "<float name='radius' value='0.3'/><emitter type='area'><rgb name='radiance' "
                             "value='1,2,9'/></emitter>");
  return scene_text(kFloor + lights, kSide, kSide, 2, kWide);
}

/// `text` with the first `from` replaced by `to`.
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

/// A checkerboard texture.
std::string checks(const std::string& name) {
  return "<texture name='" + name +
         "' type='checkerboard'><rgb name='color0' value='0.1,0.9,0.3'/><rgb name='color1' value='0.9,0.05,0.6'/>"
         "<transform name='to_uv'><scale value='24'/></transform></texture>";
}
const std::string kReflectance = "<rgb name='reflectance' value='0.6,0.5,0.3'/>";  // of coloured_lights()
const std::string kAlpha = "<float name='alpha' value='0.9'/>";                    // of kRoughMetal

struct NotClosed : ControlledParts {
  static constexpr bool kCloseEnded = false;
};
struct FailedForgotten : ControlledParts {
  static constexpr bool kCountFailed = false;
};
struct EnvironmentTwice : ControlledParts {
  static float direction_weight(float pdf, float pdf_light, bool of_environment) {
    return of_environment ? 1 : ControlledParts::direction_weight(pdf, pdf_light, of_environment);
  }
};
struct NegativeClipped : ControlledParts {};
struct AlbedoForgottenAtEnds : ControlledParts {
  static Spectrum albedo_scale(const Spectrum& scale, bool ended) { return ended ? Spectrum(1) : scale; }
};

/// `controlled-path` with a planted bug.
template <typename Parts>
class WithBug final : public ControlledPath {
 public:
  using ControlledPath::ControlledPath;
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    trace_with<Parts>(scene, samples, context);
    if constexpr (std::is_same_v<Parts, NegativeClipped>)
      for (CameraSample& sample : samples)
        for (int c = 0; c < 3; ++c) sample.radiance[c] = std::max(sample.radiance[c], 0.0f);
  }
};

ControlSettings options(ControlKind kind, LightSelection lights = LightSelection::kPower) {
  ControlSettings result;
  result.kind = kind, result.lights = lights, result.train_spp = 8, result.grid = 8;
  return result;
}

template <typename Parts = ControlledParts>
TestScene controlled(const std::string& xml, const ControlSettings& options) {
  return load_text(xml, 0, [&](const PathLengthSettings& lengths) -> std::shared_ptr<Integrator> {
    return std::make_shared<WithBug<Parts>>(lengths, options);
  });
}

ControlledPath& integrator_of(const TestScene& scene) {
  return dynamic_cast<ControlledPath&>(*scene.loaded.integrator);
}

constexpr uint32_t kFirstDense = 1000;

/// A single cell for all of space, with the coefficients of lights and dense techniques from `value`.
template <typename Value>
CoefficientTable one_cell(const TestScene& scene, uint32_t n_dense, const Value& value) {
  const LightSet& lights = integrator_of(scene).lights();
  std::vector<Spectrum> light_values, dense_values;
  std::vector<uint32_t> numbers;
  Spectrum sum;
  for (uint32_t i = 0; i < lights.size(); ++i) {
    numbers.push_back(i);
    light_values.push_back(value(i));
    sum += light_values.back() * lights[i].pmf;
  }
  for (uint32_t j = 0; j < n_dense; ++j) dense_values.push_back(value(kFirstDense + j));
  CoefficientTable table(CellGrid(scene.scene().bounds(), 4, true), lights.size(), n_dense);
  const CoefficientTable::NewCell cell = {
      CoefficientTable::root_key(), CoefficientTable::kNone, Spectrum(1), sum, numbers, light_values, dense_values};
  table.add_cells({&cell, 1});
  return table;
}

Spectrum random_colour(uint32_t i) {
  const auto number = [&](int c) { return static_cast<float>(mix64(3 * i + c + 1) >> 40) * 0x1p-24f; };
  const float shift = i == kFirstDense ? 3 : -1;
  return {4 * number(0) + shift, 4 * number(1) + shift, 4 * number(2) + shift};
}

/// A controlled-path ready to trace, with random coefficients or with control off.
template <typename Parts = ControlledParts>
TestScene with_coefficients(const std::string& xml, bool random) {
  TestScene scene = controlled<Parts>(xml, options(random ? ControlKind::kRgb : ControlKind::kOff));
  if (random) integrator_of(scene).use(one_cell(scene, 2, random_colour));
  EXPECT_TRUE(train(scene.scene(), integrator_of(scene), {}));
  return scene;
}

/// Trained as in a render, but without the importance of pixels.
TestScene trained(const std::string& xml, const ControlSettings& options) {
  TestScene scene = controlled(xml, options);
  const LoadedScene& l = scene.loaded;
  EXPECT_TRUE(
      train(scene.scene(), integrator_of(scene), {{l.crop_x, l.crop_y, l.crop_width, l.crop_height}, l.filter}));
  return scene;
}

// Σ_k r_k = 1 for every sample, so equal coefficients have no effect: no statistics.
TEST(ControlledPath, EqualCoefficientsCancel) {
  const TestScene off = with_coefficients(everything(), false);
  const Film plain = render(off, 4, 1);
  const auto largest_difference = [&](const TestScene& scene) {
    integrator_of(scene).use(one_cell(scene, 2, [](uint32_t) { return Spectrum(2, 1, 3); }));
    EXPECT_TRUE(train(scene.scene(), integrator_of(scene), {}));
    const Film film = render(scene, 4, 1);
    double largest = 0;
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        for (int c = 0; c < 3; ++c)
          largest = std::max<double>(largest, std::abs(film.mean(x, y)[c] - plain.mean(x, y)[c]));
    return largest;
  };
  EXPECT_LT(largest_difference(controlled(everything(), options(ControlKind::kRgb))), 1e-4);
  EXPECT_GT(largest_difference(controlled<FailedForgotten>(everything(), options(ControlKind::kRgb))), 0.01);
}

TEST(ControlledPath, CoefficientsOfAnySizeAreUnbiased) {
  const TestScene off = with_coefficients(everything(), false), on = with_coefficients(everything(), true);
  const Differences right = differences(on, off, 16, 0);
  EXPECT_EQ(n_biased(right), 0);
  EXPECT_LT(detectable(right), 0.05 * image_mean(render(off, 16, 0)));
  EXPECT_GT(n_biased(differences(with_coefficients<NegativeClipped>(everything(), true), off, 4, 0)), 0);
}

TEST(ControlledPath, FailedDirectionsAreSamplesToo) {
  const TestScene off = with_coefficients(kRoughMetal, false);
  const Differences right = differences(with_coefficients(kRoughMetal, true), off, 16, 0);
  EXPECT_EQ(n_biased(right), 0);
  EXPECT_GT(n_biased(differences(with_coefficients<NotClosed>(kRoughMetal, true), off, 16, 0)), 0);
  EXPECT_GT(n_biased(differences(with_coefficients<FailedForgotten>(kRoughMetal, true), off, 16, 0)), 0);
}

TEST(ControlledPath, WithoutControlAgreesWithPath) {
  const TestScene path = load_text(everything());
  for (const LightSelection lights : {LightSelection::kTriangle, LightSelection::kShape, LightSelection::kPower}) {
    TestScene off = controlled(everything(), options(ControlKind::kOff, lights));
    ASSERT_TRUE(train(off.scene(), integrator_of(off), {}));
    const Differences right = differences(off, path, 16, 100);
    EXPECT_EQ(n_biased(right), 0) << name_of(lights);
    EXPECT_LT(detectable(right), 0.05 * image_mean(render(path, 16, 0)));
  }
  TestScene twice = controlled<EnvironmentTwice>(everything(), options(ControlKind::kOff));
  ASSERT_TRUE(train(twice.scene(), integrator_of(twice), {}));
  EXPECT_GT(n_biased(differences(twice, path, 16, 100)), 0);
}

TEST(ControlledPath, TrainedAgreesWithPath) {
  const TestScene path = load_text(everything()), off = with_coefficients(everything(), false);
  const TestScene on = trained(everything(), options(ControlKind::kRgb));
  EXPECT_GT(integrator_of(on).table().n_cells(), 10u);
  EXPECT_EQ(n_biased(differences(on, off, 16, 0)), 0);
  EXPECT_EQ(n_biased(differences(on, path, 16, 100)), 0);
  for (const ControlKind kind : {ControlKind::kMono, ControlKind::kVevoda, ControlKind::kOptimalMis})
    EXPECT_EQ(n_biased(differences(trained(everything(), options(kind)), off, 16, 0)), 0) << static_cast<int>(kind);
}

// Each seed trains anew, and the training samples are part of the image.
TEST(ControlledPath, TrainedOnTheFlyAgreesWithPath) {
  const TestScene path = load_text(everything());
  const auto planned = [](const TestScene& scene, bool twice) {
    return [&scene, twice](uint64_t seed) {
      RenderRequest request;
      request.spp = 8, request.seed = seed;
      const RenderResult result = render(scene.loaded, plain_plan(Sampling::kIndependent), request);
      EXPECT_GT(result.training.samples[0], 4);
      Image image = result.picture();
      if (twice)  // planted bug: the training image is added without its weight
        for (size_t i = 0; i < image.data.size(); ++i) image.data[i] += 0.2f * result.training.mean.data[i];
      return image;
    };
  };
  for (const bool paper : {false, true}) {
    ControlSettings wanted = options(ControlKind::kRgb);
    wanted.paper = paper;
    const TestScene scene = controlled(everything(), wanted);
    const auto by_path = [&](uint64_t seed) { return render(path, 16, seed + 100).mean_image(); };
    const Differences right = differences(planned(scene, false), by_path);
    EXPECT_EQ(n_biased(right), 0) << paper;
    EXPECT_LT(detectable(right), 0.08 * image_mean(render(path, 16, 0)));
    if (!paper) {
      EXPECT_GT(n_biased(differences(planned(scene, true), by_path)), 0);
    }
  }
}

// [Hua2023] Sec. 6.1: 8 samples by plain MIS, the first of which gives the pixel values; then a single solve.
TEST(ControlledPath, AsPublishedThereIsNoControlBeforeTheTrainingHasEnded) {
  const auto image_of_training = [](ControlSettings settings) {
    settings.grid = 8, settings.lights = LightSelection::kPower;
    const TestScene scene = controlled(coloured_lights(), settings);
    TrainingImage image;
    TrainingSettings training{{0, 0, scene.loaded.width, scene.loaded.height}, scene.loaded.filter};
    training.image = &image;
    EXPECT_TRUE(train(scene.scene(), integrator_of(scene), training));
    EXPECT_GT(integrator_of(scene).table().n_cells(), 10u);
    return image.mean;
  };
  const TestScene plain = with_coefficients(coloured_lights(), false);
  PassSettings settings;
  settings.pass = kTrainingPass, settings.spp = 8, settings.filter = plain.loaded.filter;
  Film film(plain.loaded.width, plain.loaded.height, {0, 0, plain.loaded.width, plain.loaded.height}, 1);
  render_pass(plain.scene(), plain.integrator(), settings, film);
  const auto difference = [&](const Image& image) {
    double sum = 0;
    for (size_t i = 0; i < image.data.size(); ++i) sum += std::abs(image.data[i] - film.mean_image().data[i]);
    return sum / static_cast<double>(image.data.size());
  };
  const ControlSettings published = ControlSettings::published();
  EXPECT_EQ(published.training_spp(), 8u);
  EXPECT_EQ(published.pilot_spp(), 1u);
  EXPECT_EQ(published.max_clusters(), 5000u);
  ControlSettings of_vevoda = published;
  of_vevoda.kind = ControlKind::kVevoda;
  EXPECT_EQ(of_vevoda.max_clusters(), 500u) << "as in the authors' program";
  of_vevoda.paper = false, of_vevoda.clusters = 256;
  EXPECT_EQ(of_vevoda.max_clusters(), 256u);
  EXPECT_LT(difference(image_of_training(published)), 1e-5);
  EXPECT_GT(difference(image_of_training(options(ControlKind::kRgb))), 3e-4);  // solved after each wave
}

TEST(ControlledPath, HasLessNoiseWhereLightsDiffer) {
  const double plain = noise(with_coefficients(coloured_lights(), false));
  const double mono = noise(trained(coloured_lights(), options(ControlKind::kMono)));
  const double rgb = noise(trained(coloured_lights(), options(ControlKind::kRgb)));
  EXPECT_LT(mono, 1.1 * plain);
  EXPECT_LT(noise(trained(coloured_lights(), options(ControlKind::kVevoda))), 0.7 * plain);
  EXPECT_LT(rgb, 0.5 * plain);
}

ControlSettings with_albedo(bool on, ControlKind kind = ControlKind::kRgb) {
  ControlSettings result = options(kind);
  result.albedo = on, result.train_spp = 32;
  return result;
}

TEST(ControlledPath, AlbedoTellsTexturesApart) {
  const std::string board = replaced(coloured_lights(), kReflectance, checks("reflectance"));
  const auto noise_of = [&](ControlKind kind, bool albedo) { return noise(trained(board, with_albedo(albedo, kind))); };
  EXPECT_LT(noise_of(ControlKind::kRgb, true), 0.7 * noise_of(ControlKind::kRgb, false));
  EXPECT_LT(noise_of(ControlKind::kMono, true), 1.05 * noise_of(ControlKind::kMono, false));
  // Nothing changes if it is 1, or if coefficients belong to pixels or only to light samples.
  const std::string white = replaced(coloured_lights(), kReflectance, "<rgb name='reflectance' value='1'/>");
  for (const ControlKind kind : {ControlKind::kRgb, ControlKind::kOptimalMis, ControlKind::kVevoda}) {
    const std::string& scene = kind == ControlKind::kRgb ? white : board;
    EXPECT_TRUE(same_bits(render(trained(scene, with_albedo(true, kind)), 2, 0),
                          render(trained(scene, with_albedo(false, kind)), 2, 0)))
        << static_cast<int>(kind);
  }
}

TEST(ControlledPath, AlbedoIsUnbiased) {
  // Many directions fail on the metal, which ends their paths.
  const std::string metal = replaced(kRoughMetal, kAlpha, kAlpha + checks("specular_reflectance"));
  const TestScene off = with_coefficients(metal, false), on = trained(metal, with_albedo(true));
  const Differences right = differences(on, load_text(metal), 16, 100);
  EXPECT_EQ(n_biased(right), 0);
  EXPECT_LT(detectable(right), 0.05 * image_mean(render(off, 16, 0)));
  EXPECT_EQ(n_biased(differences(on, off, 16, 0)), 0);
  EXPECT_EQ(n_biased(differences(with_coefficients(metal, true), off, 16, 0)), 0);
  EXPECT_GT(n_biased(differences(with_coefficients<AlbedoForgottenAtEnds>(metal, true), off, 16, 0)), 0);
  // A black plastic has highlights: coefficients are not multiplied by zero.
  const std::string plastic = replaced(
      coloured_lights(), "<bsdf type='diffuse'>" + kReflectance,
      "<bsdf type='roughplastic'><float name='alpha' value='0.4'/><rgb name='diffuse_reflectance' value='0'/>");
  const TestScene black = trained(plastic, with_albedo(true));
  EXPECT_EQ(n_biased(differences(black, with_coefficients(plastic, false), 16, 0)), 0);
  EXPECT_LT(noise(black), 0.8 * noise(with_coefficients(plastic, false)));
}

TEST(ControlledPath, PixelsHaveOptimalWeightsOfTheirOwn) {
  ControlSettings many = options(ControlKind::kOptimalMis);
  many.train_spp = 64;
  const TestScene scene = trained(coloured_lights(), many);
  const CoefficientTable& table = integrator_of(scene).table();
  EXPECT_GT(table.n_cells(), 300u);
  EXPECT_LE(table.n_cells(), uint32_t{kSide * kSide});
  EXPECT_LT(noise(scene), 0.6 * noise(with_coefficients(coloured_lights(), false)));
  EXPECT_EQ(integrator_of(scene).settings().pilot_spp(), 0u);
}

/// A bright light occluded by the ceiling, and a small one in the room.
std::string hidden_light() {
  return scene_text(
      kFloor +
          rectangle("<scale value='9'/><rotate x='1' angle='90'/><translate y='5' z='5'/>",
                    "<bsdf type='twosided'><bsdf type='diffuse'/></bsdf>") +
          sphere("x='0' y='7' z='5'", "<emitter type='area'><rgb name='radiance' value='50'/></emitter>") +
          sphere("x='1' y='4.6' z='5'",
                 "<float name='radius' value='0.3'/><emitter type='area'>"
                 "<rgb name='radiance' value='20'/></emitter>"),
      kSide, kSide, 2, kWide);
}

TEST(ControlledPath, LearnsHowToChooseLights) {
  const TestScene power = with_coefficients(hidden_light(), false);
  for (const ControlKind kind : {ControlKind::kOff, ControlKind::kRgb}) {
    const TestScene learned = trained(hidden_light(), options(kind, LightSelection::kLearned));
    EXPECT_GT(integrator_of(learned).lights()[1].pmf, 0.7) << static_cast<int>(kind);
    EXPECT_LT(integrator_of(power).lights()[1].pmf, 0.1);
    EXPECT_LT(noise(learned), 0.4 * noise(power));
    EXPECT_EQ(n_biased(differences(learned, power, 16, 0)), 0);
  }
  for (const ControlKind kind : {ControlKind::kOff, ControlKind::kRgb, ControlKind::kVevoda})
    EXPECT_EQ(n_biased(differences(trained(everything(), options(kind, LightSelection::kLearned)),
                                   with_coefficients(everything(), false), 16, 100)),
              0);
  // Training again starts from scratch.
  const TestScene scene = trained(hidden_light(), options(ControlKind::kRgb, LightSelection::kLearned));
  const std::string description = scene.integrator().description();
  const LoadedScene& l = scene.loaded;
  EXPECT_TRUE(
      train(scene.scene(), integrator_of(scene), {{l.crop_x, l.crop_y, l.crop_width, l.crop_height}, l.filter}));
  EXPECT_EQ(scene.integrator().description(), description);
}

TEST(ControlledPath, TakesTheRaysOfThePlainEstimate) {
  const std::string no_roulette = everything("<integer name='rr_depth' value='100'/>");
  const TestScene off = with_coefficients(no_roulette, false), on = with_coefficients(no_roulette, true);
  const auto n_rays = [](const TestScene& scene) {
    Film film = new_film(scene);
    PassSettings settings;
    settings.spp = 4;
    return render_pass(scene.scene(), scene.integrator(), settings, film).n_rays;
  };
  EXPECT_EQ(n_rays(on), n_rays(off));
}

TEST(ControlledPath, SameBitsForAnyNumberOfThreads) {
  std::string description;
  std::optional<Film> film;
  for (const size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const TestScene scene = trained(everything(), options(ControlKind::kRgb));
    const Film next = render(scene, 4, 3);
    if (!film) film.emplace(next), description = scene.integrator().description();
    EXPECT_TRUE(same_bits(next, *film)) << threads;
    EXPECT_EQ(scene.integrator().description(), description);
  }
}

/// Trains and renders; returns the image mean.
double trained_mean(const std::string& xml, const ControlSettings& wanted = options(ControlKind::kRgb)) {
  return image_mean(render(trained(xml, wanted), 2, 0));
}

TEST(ControlledPath, TakesScenesThatHaveLittleToLearn) {
  const std::string point = "<emitter type='point'><point name='position' x='0' y='2' z='4'/></emitter>";
  const std::string sky = "<emitter type='constant'/>";
  EXPECT_EQ(trained_mean(scene_text(kFloor, 16, 16, 4, kWide)), 0);                      // no lights
  EXPECT_GT(trained_mean(scene_text(kFloor + point, 16, 16, 4, kWide)), 0.001);          // delta lights only
  EXPECT_GT(trained_mean(scene_text(kFloor + sky, 16, 16, 4, kWide)), 0.1);              // an environment only
  EXPECT_NEAR(trained_mean(scene_text(sky, 16, 16, 4, kWide)), 1, 1e-4);                 // nothing to light
  EXPECT_GT(trained_mean(scene_text(kFloor + kMeshLight + sky, 1, 1, 4, kWide)), 0.01);  // one pixel
  const std::string mirrors =
      rectangle("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-2' z='5'/>", "<bsdf type='conductor'/>");
  const TestScene scene = trained(scene_text(mirrors + sky, 16, 16, 4, kWide), options(ControlKind::kRgb));
  EXPECT_EQ(integrator_of(scene).table().n_cells(), 0u);
  EXPECT_GT(image_mean(render(scene, 2, 0)), 0.1);
}

TEST(ControlledPath, LeavesOutTrainingSamplesThatAreNotFinite) {
  TestScene scene = controlled(everything(), options(ControlKind::kRgb));
  TrainingSettings settings{{0, 0, kSide, kSide}, scene.loaded.filter};
  std::vector<uint32_t> counts;
  settings.importance = [&](const Film& film) {
    counts.push_back(film.count(0, 0));
    std::vector<Spectrum> importance(kSide * kSide, Spectrum(1));
    for (size_t i = 0; i < importance.size(); i += 2) importance[i] = Spectrum(std::nanf(""));
    return importance;
  };
  ASSERT_TRUE(train(scene.scene(), integrator_of(scene), settings));
  EXPECT_EQ(counts, (std::vector<uint32_t>{2, 4}));  // after the pilot, and after the wave that follows it
  EXPECT_GT(integrator_of(scene).cache().n_rejected(), 100u);
  EXPECT_GT(image_mean(render(scene, 2, 0)), 0.1);  // also expects no bad samples
}

TEST(ControlledPath, IsToldApartByItsTraining) {
  ControlSettings longer = options(ControlKind::kRgb);
  longer.train_spp = 4;
  const TestScene scene = controlled(everything(), options(ControlKind::kRgb));
  EXPECT_NE(scene.integrator().description().find("untrained"), std::string::npos);
  EXPECT_NE(trained(everything(), longer).integrator().description(),
            trained(everything(), options(ControlKind::kRgb)).integrator().description());
}

/// A wall lit by a small lamp that emits on both sides, in front or turned around: E = L A cos cos / d^2.
TEST(ControlledPath, TwoSidedLampsShineOnBothSides) {
  const double expected = 0.5 / M_PI * 100 * 0.16 * 0.5 / 18;
  for (const char* angle : {"0", "180"}) {
    const std::string place =
        "<scale value='0.2'/><rotate y='1' angle='" + std::string(angle) + "'/><translate y='3' z='7'/>";
    const std::string lamp =
        rectangle(place.c_str(),
                  "<emitter type='area'><boolean name='two_sided' value='true'/><float name='radiance' "
                  "value='100'/></emitter>");
    const std::string text =
        scene_text(rectangle("<scale value='9'/><rotate y='1' angle='180'/><translate z='10'/>",
                             "<bsdf type='diffuse'><float name='reflectance' value='0.5'/></bsdf>") +
                       lamp,
                   kSide, kSide, 2, "<float name='fov' value='0.1'/>");
    const TestScene plain = load_text(text), control = trained(text, options(ControlKind::kRgb));
    for (const TestScene* scene : {&plain, &control}) {
      const Film film = render(*scene, 64, 21);
      double sum = 0;
      for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) sum += film.mean(x, y).g;
      EXPECT_NEAR(sum / (kSide * kSide), expected, 0.015 * expected) << angle << (scene == &control);
    }
  }
}

}  // namespace
}  // namespace covary
