// SPDX-License-Identifier: Apache-2.0
// What bidirectional methods require of every model, wrappers included: values for importance are the adjoint of those
// for radiance, reverse densities need no second bind(), and with shading normals light and camera paths agree. All
// comparisons are of single pairs of directions: no statistics.
#include <cmath>
#include <functional>
#include <map>
#include <ostream>

#include "core/warp.h"
#include "support/model_checks.h"

namespace covary::testing {
namespace {

struct Case {
  const char* name;
  Json model;
  Vec2 gradient{};           // of the bump map's displacement
  bool camera_only = false;  // some delta pairs are found from the camera only
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

const Json kDiffuse{{"type", "diffuse"}, {"reflectance", rgb(0.8, 0.5, 0.2)}};
const Json kMetal{{"type", "roughconductor"}, {"distribution", "ggx"}, {"alpha", 0.3}, {"material", "Au"}};
const Json kMirror{{"type", "conductor"}};
const Json kGlass{{"type", "dielectric"}};
const Json kRoughGlass{{"type", "roughdielectric"}, {"distribution", "ggx"}, {"alpha", 0.4}};
const Json kPane{{"type", "thindielectric"}};
const Json kPlastic{{"type", "plastic"}, {"nonlinear", true}};
const Json kThin{
    {"type", "principledthin"}, {"spec_trans", 0.6}, {"diff_trans", 0.9}, {"roughness", 0.6}, {"eta", 1.4}};
const Json kPrincipled{{"type", "principled"}, {"spec_trans", 0.5}, {"roughness", 0.4}, {"clearcoat", 0.7},
                       {"sheen", 0.5},         {"metallic", 0.2},   {"spec_tint", 0.5}, {"flatness", 0.3}};
Json metallic_roughness(double transmission, bool thin) {
  return {{"type", "metallicroughness"},
          {"base_color", rgb(0.8, 0.5, 0.2)},
          {"metallic", 0.3},
          {"roughness", 0.6},
          {"clearcoat", 0.7},
          {"clearcoat_roughness", 0.5},
          {"specular", 0.8},
          {"specular_color", rgb(3, 1, 0.5)},
          {"ior", 1.7},
          {"transmission", transmission},
          {"thin", thin}};
}

Json mask(const Json& nested) { return {{"type", "mask"}, {"opacity", 0.7}, {"n", nested}}; }
Json blend(const Json& a, const Json& b) { return {{"type", "blendbsdf"}, {"weight", 0.3}, {"a", a}, {"b", b}}; }
Json bump(const Json& nested, bool flip = true, bool shadow = true) {
  return {{"type", "bumpmap"},
          {"height", {{"type", "height"}}},
          {"n", nested},
          {"flip_invalid_normals", flip},
          {"use_shadowing_function", shadow}};
}
Json normal_map(const Json& nested) {
  return {{"type", "normalmap"}, {"normalmap", rgb(0.8, 0.35, 0.8)}, {"n", nested}};
}
Json two_sided(const Json& a) { return {{"type", "twosided"}, {"allow_transmission", true}, {"a", a}}; }
Json two_sided(const Json& a, const Json& b) {
  return {{"type", "twosided"}, {"allow_transmission", true}, {"a", a}, {"b", b}};
}

const Vec2 kSteep{0.9f, -0.5f}, kVerySteep{2.5f, 1};

const Case kCases[] = {
    {"diffuse", kDiffuse},
    {"difftrans", {{"type", "difftrans"}, {"reflectance", rgb(0.2, 0.4, 0.6)}, {"transmittance", rgb(0.3, 0.1, 0.2)}}},
    {"conductor", kMirror},
    {"roughconductor", kMetal},
    {"plastic", kPlastic},
    {"roughplastic", {{"type", "roughplastic"}, {"alpha", 0.3}}},
    {"dielectric", kGlass},
    {"roughdielectric", kRoughGlass},
    {"roughdielectric_all_normals", {{"type", "roughdielectric"}, {"alpha", 0.3}, {"sample_visible", false}}},
    {"thindielectric", kPane},
    {"principled", kPrincipled},
    {"principledthin", kThin},
    {"metallicroughness", metallic_roughness(0, true)},
    {"metallicroughness_sheet", metallic_roughness(0.6, true)},
    {"metallicroughness_solid", metallic_roughness(0.6, false)},
    {"metallicroughness_layers",
     {{"type", "metallicroughness"},
      {"metallic", 0.3},
      {"roughness", 0.6},
      {"sheen_color", rgb(0.8, 0.5, 0.2)},
      {"sheen_roughness", 0.5},
      {"anisotropy", 0.5},
      {"iridescence", 0.7},
      {"diffuse_transmission", 0.4}}},
    {"phong", {{"type", "phong"}}},
    {"ward", {{"type", "ward"}, {"alpha_v", 0.4}}},
    {"coating", {{"type", "coating"}, {"sigma_a", 0.3}, {"n", kMetal}}},
    {"coated_glass", {{"type", "coating"}, {"int_ior", 1.2}, {"n", kGlass}}},
    {"coated_mask", {{"type", "coating"}, {"n", mask(kDiffuse)}}},
    {"roughcoating", {{"type", "roughcoating"}, {"alpha", 0.3}, {"n", kPlastic}}},
    {"null", {{"type", "null"}}},
    {"polarizer", {{"type", "polarizer"}, {"transmittance", 0.6}}},
    {"pplastic", {{"type", "pplastic"}, {"alpha", 0.3}}},
    {"hair", {{"type", "hair"}, {"scale_tilt", 3.0}}},
    {"measured", {{"type", "measured"}, {"filename", COVARY_SOURCE_DIR "/tests/references/measured_half.bsdf"}}},
    {"mask", mask(kPlastic)},
    {"mask_of_glass", mask(kGlass)},
    {"blend", blend(kPlastic, kRoughGlass)},
    {"blend_of_deltas", blend(mask(kGlass), kMirror)},
    {"two_sided", two_sided(kMetal, kPlastic)},
    {"two_sided_glass", two_sided(kGlass), {}, true},
    {"two_sided_rough_glass", two_sided(kRoughGlass)},
    {"two_sided_mask", two_sided(mask(kPlastic))},
    {"two_sided_masks", two_sided(mask(kDiffuse), mask(kGlass))},
    {"two_sided_thin_and_diffuse", two_sided(kThin, kDiffuse)},
    {"two_sided_pane", two_sided(kPane)},
    {"bump_diffuse", bump(kDiffuse), kSteep},
    {"bump_metal_unflipped", bump(kMetal, false), kVerySteep},
    {"bump_mirror", bump(kMirror), {0.6f, -0.3f}, true},
    {"bump_mirror_unflipped", bump(kMirror, false), kVerySteep, true},
    {"bump_glass", bump(kGlass), kSteep},
    {"bump_glass_unflipped", bump(kGlass, false), kVerySteep},
    {"bump_rough_glass", bump(kRoughGlass), kVerySteep},
    {"bump_rough_glass_unflipped", bump(kRoughGlass, false, false), kVerySteep},
    {"bump_mask", bump(mask(kPlastic)), kSteep},
    {"bump_pane", bump(kPane), kVerySteep},
    {"bump_two_sided", bump(two_sided(kMetal, kDiffuse)), kVerySteep},
    {"bump_two_sided_unflipped", bump(two_sided(kMetal, kDiffuse), false), kVerySteep},
    {"bump_two_sided_mirrors_unflipped", bump(two_sided(kMirror, kPlastic), false), kVerySteep},
    {"bump_two_sided_glass", bump(two_sided(kRoughGlass)), kSteep},
    {"normal_map", normal_map(kPrincipled)},
    {"mask_of_bump", mask(bump(kMirror)), kVerySteep},
    {"two_sided_bump", two_sided(bump(kPlastic)), kVerySteep},
    {"blend_of_bumps", blend(bump(kPlastic), bump(kThin)), kSteep},
};

class Adjoint : public ::testing::TestWithParam<Case> {
 protected:
  const BsdfClosure& bind(const Vec3& wo, TransportMode mode) {
    return *bsdf_->bind(flat_hit(), wo.z > 0, mode, arena_);
  }
  static PathRandom random(int i) { return {Sampling::kIndependent, 11, 0, 0, static_cast<uint64_t>(i)}; }
  static Vec3 any_direction(const PathRandom& r, uint32_t vertex) {
    return warp::square_to_sphere(r.get_2d(vertex, Event::kDirection));
  }
  static float scale(const Spectrum& s) { return max_component(s); }

  BsdfPtr bsdf_ =
      make_bsdf(GetParam().model, {{"height", std::make_shared<TestTexture>(Spectrum(0), GetParam().gradient)}});
  Arena arena_;
};

void expect_close(const Spectrum& a, const Spectrum& b, const std::string& where) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 5e-3f * std::abs(b[c]) + 1e-5f) << where;
}

TEST_P(Adjoint, ValuesForImportanceAreThoseForRadianceExchanged) {
  int n_lit = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 wo = any_direction(random(i), 1), wi = any_direction(random(i), 2);
    if (std::min(std::abs(wo.z), std::abs(wi.z)) < 0.02f) continue;
    arena_.reset();
    const Spectrum f = bind(wo, TransportMode::kRadiance).eval(wo, wi).value / std::abs(wi.z);
    const Spectrum adjoint = bind(wi, TransportMode::kImportance).eval(wi, wo).value / std::abs(wo.z);
    expect_close(adjoint, f, "pair " + std::to_string(i));
    n_lit += scale(f) > 0;
  }
  if (bsdf_->flags() & kSmooth) {
    EXPECT_GT(n_lit, 100);
  }
}

// Null transmission as sampled, with 4000 equally spaced u_lobe, against null_passage().
TEST_P(Adjoint, NullPassageIsWhatSamplesPass) {
  constexpr int kNumbers = 4000;
  for (int i = 0; i < 20; ++i) {
    const Vec3 wo = any_direction(random(i), 1);
    if (std::abs(wo.z) < 0.02f) continue;
    arena_.reset();
    const BsdfClosure& closure = bind(wo, TransportMode::kRadiance);
    Spectrum weights(0);
    int n_passed = 0;
    for (int k = 0; k < kNumbers; ++k) {
      const BsdfSample s = closure.sample(wo, (static_cast<float>(k) + 0.5f) / kNumbers, {0.3f, 0.6f});
      if (s.valid() && (s.flags & kNullTransmission)) weights += s.weight, ++n_passed;
    }
    const NullPassage passage = closure.null_passage(wo);
    EXPECT_NEAR(passage.pmf, static_cast<float>(n_passed) / kNumbers, 2e-3f);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(passage.transmittance[c], weights[c] / kNumbers, 2e-3f);
  }
}

// Reverse density, from this closure and from the model bound at the other end.
TEST_P(Adjoint, ReverseDensitiesAreThoseOfTheOtherEnd) {
  int n_both = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 wo = any_direction(random(i), 3), wi = any_direction(random(i), 4);
    for (const bool radiance : {true, false}) {
      arena_.reset();
      const TransportMode mode = radiance ? TransportMode::kRadiance : TransportMode::kImportance;
      const TransportMode opposite = radiance ? TransportMode::kImportance : TransportMode::kRadiance;
      const float reverse = bind(wo, mode).reverse_pdf(wo, wi);
      const float expected = bind(wi, opposite).eval(wi, wo).pdf_solid_angle;
      EXPECT_NEAR(reverse, expected, 1e-4f * expected + 1e-7f) << "pair " << i << ", radiance " << radiance;
      n_both += reverse > 0;
    }
  }
  if (bsdf_->flags() & kSmooth) {
    EXPECT_GT(n_both, 100);
  }
}

/// Scans u_lobe over all delta lobes; returns the probability and the sample of each lobe.
std::map<uint32_t, std::pair<float, BsdfSample>> delta_lobes(const BsdfClosure& closure, const Vec3& wo) {
  constexpr int kSteps = 1000;
  std::map<uint32_t, std::pair<float, BsdfSample>> lobes;
  for (int i = 0; i < kSteps; ++i) {
    const BsdfSample s = closure.sample(wo, (static_cast<float>(i) + 0.5f) / kSteps, {0.3f, 0.6f});
    if (!s.valid() || !s.is_delta()) continue;
    lobes[s.lobe].first += 1.0f / kSteps;
    lobes[s.lobe].second = s;
  }
  return lobes;
}

TEST_P(Adjoint, DeltaLobesAreFoundFromBothEndsOrFromTheCameraOnly) {
  int n_both = 0, n_camera_only = 0, n_planted = 0;
  for (int i = 0; i < 400; ++i) {
    const Vec3 wo = any_direction(random(i), 5);
    if (std::abs(wo.z) < 0.05f) continue;
    for (const bool radiance : {true, false}) {
      arena_.reset();
      const TransportMode mode = radiance ? TransportMode::kRadiance : TransportMode::kImportance;
      const TransportMode opposite = radiance ? TransportMode::kImportance : TransportMode::kRadiance;
      const BsdfClosure& here = bind(wo, mode);
      for (const auto& [lobe, found] : delta_lobes(here, wo)) {
        const auto& [pmf, s] = found;
        if (std::abs(s.wi.z) < 0.05f) continue;
        EXPECT_NEAR(pmf, s.pdf, 2e-3f);
        const auto back = delta_lobes(bind(s.wi, opposite), s.wi);
        const auto match = back.find(lobe);
        const bool finds = match != back.end() && length(match->second.second.wi - wo) < 2e-3f;
        EXPECT_NEAR(here.reverse_pmf(wo, s), finds ? match->second.first : 0, 3e-3f) << "direction " << i;
        if (!finds) {
          // What only the light path samples must carry nothing.
          if (!radiance) {
            EXPECT_EQ(scale(s.weight), 0) << "direction " << i;
          }
          n_camera_only += radiance;
          float pmfs[kMaxLobes];
          here.lobe_pmfs(s.wi, pmfs);
          n_planted += radiance && pmfs[lobe] > 0;  // lobe_pmfs() alone would claim that the pair is found
          continue;
        }
        ++n_both;
        if (!radiance || GetParam().gradient.x != 0) continue;
        // f(wo, wi) |cos| d(omega): refraction compresses solid angles, and with them radiance, by eta^2.
        const Spectrum forward = s.weight * s.pdf * (s.eta * s.eta);
        expect_close(match->second.second.weight * match->second.second.pdf, forward, "direction " + std::to_string(i));
      }
    }
  }
  if ((bsdf_->flags() & kDelta) && std::string(GetParam().name) != "two_sided_glass") {
    EXPECT_GT(n_both, 20);
  }
  if (GetParam().camera_only) {
    EXPECT_GT(n_camera_only, 10);
    EXPECT_GT(n_planted, 10);
  }
}

// A path through a surface with a shading normal has one contribution, from whichever end it is built:
//     f(camera, light) |ns light| |ng camera|  =  f*(light, camera) |ns camera| factor |ng light|.
TEST_P(Adjoint, ShadingNormalsKeepBothEndsEqual) {
  const Vec3 ns{0, 0, 1}, ng = normalize(Vec3{0.3f, -0.2f, 0.8f});
  int n_lit = 0, n_planted = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 camera = any_direction(random(i), 6), light = any_direction(random(i), 7);
    if (std::min(std::abs(camera.z), std::abs(light.z)) < 0.02f) continue;
    arena_.reset();
    const Spectrum forward = bind(camera, TransportMode::kRadiance).eval(camera, light).value *
                             std::abs(dot(ng, camera)) *
                             shading_normal_factor(camera, light, ns, ng, TransportMode::kRadiance);
    const Spectrum value = bind(light, TransportMode::kImportance).eval(light, camera).value;
    const Spectrum backward =
        value * std::abs(dot(ng, light)) * shading_normal_factor(light, camera, ns, ng, TransportMode::kImportance);
    expect_close(backward, forward, "pair " + std::to_string(i));
    const Spectrum planted = value * std::abs(dot(ng, light));  // without the factor
    n_lit += scale(forward) > 0;
    n_planted += std::abs(scale(planted) - scale(forward)) > 0.01f * scale(forward);
  }
  if (bsdf_->flags() & kSmooth) {
    EXPECT_GT(n_planted, n_lit / 2);
  }
}

INSTANTIATE_TEST_SUITE_P(Models, Adjoint, ::testing::ValuesIn(kCases),
                         [](const auto& test) { return std::string(test.param.name); });

// Planted: refraction that scales importance like radiance differs by eta^2.
TEST(AdjointPlanted, ImportanceScaledAsRadianceIsFound) {
  const BsdfPtr glass = make_bsdf(kRoughGlass);
  Arena arena;
  const Vec3 wo = direction(30, 0.2f), wi = direction(160, 3.2f);
  const float f = glass->bind(flat_hit(), true, TransportMode::kRadiance, arena)->eval(wo, wi).value.g / std::abs(wi.z);
  const float planted =
      glass->bind(flat_hit(), false, TransportMode::kRadiance, arena)->eval(wi, wo).value.g / std::abs(wo.z);
  EXPECT_GT(f, 0);
  EXPECT_NEAR(planted / f, 1.5046f * 1.5046f, 0.02f);
}

}  // namespace
}  // namespace covary::testing
