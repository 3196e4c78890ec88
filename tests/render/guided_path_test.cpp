// SPDX-License-Identifier: Apache-2.0
// `guided-path` estimates the same image as `path` for any guiding field.
//
// Statistical cases: 16 renders with seeds 0 … 15; Student's t-test on the means of 16 blocks of the image and of the
// whole, each at alpha = 5e-7.
#include "integrators/guided_path.h"

#include <tbb/global_control.h>

#include <optional>

#include "support/make_bsdf.h"
#include "unbiased_images.h"

namespace covary {
namespace {

/// Directions are sampled from the lobes of another leaf than that of the density.
struct OtherLeaf : GuidedParts {
  static Vec3 sample_guide(const VmfLobes&, const GuidingField& field, uint32_t leaf, float u_lobe, Vec2 u) {
    return field.leaf((leaf + 1) % field.n_leaves()).mixture.lobes.sample(u_lobe, u);
  }
};
/// The BSDF's density for the same direction is left out.
struct NoBsdfDensity : GuidedParts {
  static float mixture_pdf(float g, float pdf_bsdf, float pdf_guide) {
    return pdf_guide > 0 ? g * pdf_guide : (1 - g) * pdf_bsdf;
  }
};

/// Survivors of roulette do not stand for the paths that it ends.
struct LightSurvivors : GuidedParts {
  static float survivor_weight(float) { return 1; }
};

/// Failed directions are left out of the control variate.
struct FailedForgotten : GuidedParts {
  static constexpr bool kCountFailed = false;
};
/// Coefficients come from another leaf than their sum, as after a split.
struct OtherCoefficients : GuidedParts {
  static uint32_t direction_cell(uint32_t cell, uint32_t n_cells) { return (cell + 1) % n_cells; }
};

template <typename Parts>
class WithBug final : public GuidedPath {
 public:
  using GuidedPath::GuidedPath;
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    trace_with<Parts>(scene, samples, context);
  }
};

GuideSettings options(bool nee, float fraction = 0.5f, uint32_t train_spp = 16) {
  GuideSettings result;
  result.nee = nee, result.fraction = fraction, result.train_spp = train_spp;
  return result;
}

GuideSettings controlled(bool nee, ControlKind kind = ControlKind::kRgb) {
  GuideSettings result = options(nee);
  result.control = kind;
  return result;
}

GuidedPath& integrator_of(const TestScene& scene) { return dynamic_cast<GuidedPath&>(*scene.loaded.integrator); }

template <typename Parts = GuidedParts>
TestScene guided(const std::string& xml, const GuideSettings& options) {
  return load_text(xml, 0, [&](const PathLengthSettings& lengths) -> std::shared_ptr<Integrator> {
    return std::make_shared<WithBug<Parts>>(lengths, options);
  });
}

bool train_scene(const TestScene& scene) {
  const LoadedScene& l = scene.loaded;
  return train(scene.scene(), integrator_of(scene), {{l.crop_x, l.crop_y, l.crop_width, l.crop_height}, l.filter});
}

TestScene trained(const std::string& xml, const GuideSettings& options) {
  TestScene scene = guided(xml, options);
  EXPECT_TRUE(train_scene(scene));
  return scene;
}

/// The field that another scene's integrator learnt, used with a planted bug.
template <typename Parts>
TestScene with_bug(const std::string& xml, const GuideSettings& options, const TestScene& learnt) {
  TestScene scene = guided<Parts>(xml, options);
  integrator_of(scene).use_bytes(integrator_of(learnt).trained_bytes(), "the other scene");
  EXPECT_TRUE(train_scene(scene));
  return scene;
}

const std::string kRoulette = "<integer name='rr_depth' value='3'/>";

TEST(GuidedPath, AgreesWithPathWithLightSamples) {
  const TestScene path = load_text(everything()), scene = trained(everything(), options(true));
  const Differences right = differences(scene, path, 16, 100);
  EXPECT_EQ(n_biased(right), 0);
  EXPECT_LT(detectable(right), 0.06 * image_mean(render(path, 16, 0)));
}

TEST(GuidedPath, AgreesWithPathWithoutLightSamples) {
  const std::string xml = everything(kRoulette, false);
  const TestScene path = load_text(xml), scene = trained(xml, options(false, 0.5f, 48));
  EXPECT_GE(integrator_of(scene).field().n_leaves(), 2u);
  const Differences right = differences(scene, path, 32, 100);
  EXPECT_EQ(n_biased(right), 0);
  EXPECT_LT(detectable(right), 0.06 * image_mean(render(path, 16, 0)));
  EXPECT_GT(n_biased(differences(with_bug<OtherLeaf>(xml, options(false), scene), path, 16, 100)), 0);
  EXPECT_GT(n_biased(differences(with_bug<NoBsdfDensity>(xml, options(false), scene), path, 16, 100)), 0);
}

TEST(GuidedPath, HasLessNoiseWhereLightIsHardToFind) {
  const std::string xml =
      scene_text(kFloor + sphere("x='0' y='6' z='3'", "<float name='radius' value='0.3'/><emitter type='area'/>"),
                 kSide, kSide, 2, kWide);
  const double hardly = noise(trained(xml, options(false, 0.01f))), half = noise(trained(xml, options(false)));
  EXPECT_LT(half, 0.2 * hardly);
}

TEST(GuidedPath, RouletteIsUnbiased) {
  const std::string xml = everything(kRoulette);
  const TestScene path = load_text(xml), scene = trained(xml, options(true));
  EXPECT_EQ(n_biased(differences(scene, path, 16, 100)), 0);
  // With the same random numbers, only the weights of survivors differ.
  EXPECT_GT(n_biased(differences(with_bug<LightSurvivors>(xml, options(true), scene), scene, 16, 0)), 0);
}

TEST(GuidedPath, PathsBetweenMirrorsEnd) {
  const std::string mirrors = sphere("x='0' y='0' z='0'",
                                     "<float name='radius' value='20'/><boolean name='flip_normals' value='true'/>"
                                     "<bsdf type='conductor'><string name='material' value='none'/></bsdf>");
  const TestScene scene = trained(
      scene_text(mirrors + kFloor + sphere("x='0' y='3' z='3'", "<emitter type='area'/>"), kSide, kSide, -1, kWide),
      options(true));
  EXPECT_GT(integrator_of(scene).field().n_leaves(), 0u);
  Film film = new_film(scene);
  PassSettings settings;
  settings.spp = 4;
  // From 20 edges on, a path goes on with 0.95: 40 edges on average.
  EXPECT_LT(render_pass(scene.scene(), scene.integrator(), settings, film).n_rays, 4u * kSide * kSide * 60);
}

TEST(GuidedPath, ControlledAgreesWithPath) {
  const TestScene path = load_text(everything());
  for (const ControlKind kind : {ControlKind::kRgb, ControlKind::kMono}) {
    const TestScene scene = trained(everything(), controlled(true, kind));
    EXPECT_GE(integrator_of(scene).table().n_cells(), 2u);
    EXPECT_EQ(n_biased(differences(scene, path, 16, 100)), 0) << static_cast<int>(kind);
  }
}

TEST(GuidedPath, ControlledAgreesWithPathWithoutLightSamples) {
  const std::string xml = everything(kRoulette, false);
  const TestScene path = load_text(xml), scene = trained(xml, controlled(false));
  EXPECT_GE(integrator_of(scene).table().n_cells(), 2u);
  EXPECT_EQ(n_biased(differences(scene, path, 32, 100)), 0);
  // With the same random numbers, only the control variate differs.
  EXPECT_GT(n_biased(differences(with_bug<FailedForgotten>(xml, controlled(false), scene), scene, 16, 0)), 0);
  EXPECT_GT(n_biased(differences(with_bug<OtherCoefficients>(xml, controlled(false), scene), scene, 16, 0)), 0);
}

TEST(GuidedPath, ControlRestoresThePerfectTechnique) {
  // BSDF sampling of a uniform sky has no noise; guiding adds noise, which the control variate removes.
  const std::string wall = rectangle("<scale value='20'/><rotate x='1' angle='180'/><translate z='5'/>",
                                     "<bsdf type='diffuse'><rgb name='reflectance' value='0.6,0.5,0.3'/></bsdf>");
  const std::string sky = "<emitter type='constant'><rgb name='radiance' value='1,2,4'/></emitter>";
  const std::string xml = scene_text(wall + sky, kSide, kSide, 2, kWide);
  const double off = noise(trained(xml, options(false)));
  EXPECT_LT(noise(trained(xml, controlled(false))), 1e-3 * off);
  EXPECT_LT(noise(trained(xml, controlled(false, ControlKind::kMono))), 0.6 * off);
}

TEST(GuidedPath, SameBitsForAnyNumberOfThreads) {
  std::string description;
  std::optional<Film> film;
  for (const size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const TestScene scene = trained(everything(), controlled(true));
    const Film next = render(scene, 4, 3);
    if (!film) film.emplace(next), description = scene.integrator().description();
    EXPECT_TRUE(same_bits(next, *film)) << threads;
    EXPECT_EQ(scene.integrator().description(), description);
  }
}

TEST(GuidedPath, AFieldOfAFileTakesThePlaceOfATraining) {
  const TestScene scene = trained(everything(), controlled(true));
  const TestScene other = with_bug<GuidedParts>(everything(), controlled(true), scene);
  EXPECT_EQ(integrator_of(other).training_spp(), 0u);
  EXPECT_TRUE(same_bits(render(scene, 2, 3), render(other, 2, 3)));
  EXPECT_EQ(scene.integrator().description(), other.integrator().description());
  EXPECT_THROW(integrator_of(other).use_bytes("no field", "a file"), Error);
}

TEST(GuidedPath, IsToldApartByItsTraining) {
  EXPECT_NE(guided(everything(), options(true)).integrator().description().find("untrained"), std::string::npos);
  EXPECT_NE(trained(everything(), options(true, 0.5f, 4)).integrator().description(),
            trained(everything(), options(true, 0.5f, 8)).integrator().description());
}

double trained_mean(const std::string& xml, bool nee) {
  GuideSettings wanted = options(nee, 0.5f, 4);
  wanted.control = ControlKind::kRgb, wanted.control_train_spp = 12;
  return image_mean(render(trained(xml, wanted), 2, 0));
}

TEST(GuidedPath, TakesScenesThatHaveLittleToLearn) {
  const std::string point = "<emitter type='point'><point name='position' x='0' y='2' z='4'/></emitter>";
  const std::string sky = "<emitter type='constant'/>";
  EXPECT_EQ(trained_mean(scene_text(kFloor, 16, 16, 4, kWide), true), 0);              // no lights
  EXPECT_EQ(trained_mean(scene_text(kFloor + point, 16, 16, 4, kWide), false), 0);     // no light in training
  EXPECT_GT(trained_mean(scene_text(kFloor + point, 16, 16, 4, kWide), true), 0.001);  // delta lights only
  for (const bool nee : {true, false}) {
    EXPECT_GT(trained_mean(scene_text(kFloor + sky, 16, 16, 4, kWide), nee), 0.1);              // an environment only
    EXPECT_NEAR(trained_mean(scene_text(sky, 16, 16, 4, kWide), nee), 1, 1e-4);                 // nothing to light
    EXPECT_GT(trained_mean(scene_text(kFloor + kMeshLight + sky, 1, 1, 4, kWide), nee), 0.01);  // one pixel
  }
  const std::string mirrors =
      rectangle("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-2' z='5'/>", "<bsdf type='conductor'/>");
  const TestScene scene = trained(scene_text(mirrors + sky, 16, 16, 4, kWide), options(true));
  EXPECT_EQ(integrator_of(scene).field().n_leaves(), 0u);
  EXPECT_GT(image_mean(render(scene, 2, 0)), 0.1);
}

float share(const testing::Json& json, const Vec3& wo = normalize(Vec3{0.3f, 0.2f, 0.8f})) {
  const std::shared_ptr<const Bsdf> bsdf = testing::make_bsdf(json);
  Arena arena;
  SurfaceHit hit;
  return guidable_fraction(*bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, arena), wo, 0.1f);
}

TEST(GuidableShare, LeavesOutDeltaAndNarrowLobes) {
  EXPECT_NEAR(share({{"type", "diffuse"}}), 1, 1e-6);
  EXPECT_EQ(share({{"type", "diffuse"}}, {0, 0, -1}), 0);  // black from behind
  EXPECT_EQ(share({{"type", "dielectric"}}), 0);
  EXPECT_EQ(share({{"type", "conductor"}}), 0);
  EXPECT_EQ(share({{"type", "roughconductor"}, {"alpha", 0.09}}), 0);
  EXPECT_EQ(share({{"type", "roughconductor"}, {"alpha", 0.15}}), 1);
  const float plastic = share({{"type", "plastic"}});
  EXPECT_TRUE(plastic > 0.1f && plastic < 0.99f) << plastic;
  EXPECT_EQ(share({{"type", "roughdielectric"}, {"alpha", 0.3}}), 0);
}

}  // namespace
}  // namespace covary
