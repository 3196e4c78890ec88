// SPDX-License-Identifier: Apache-2.0
// metallicroughness against the formulas of the glTF 2.0 specification, appendix B.3, and of its extensions, written
// down again in double precision; its sampling against its densities.
#include "support/model_checks.h"

namespace covary::metallicroughness_test {
namespace {

using namespace covary::testing;
using statistics::check_closure;
using statistics::join;

struct V3 {
  double x, y, z;
};
double dot3(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
V3 at(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

/// The specification's functions and symbols, for one channel.
struct Specification {
  double base, metallic, roughness, ior = 1.5, specular = 1, specular_color = 1, clearcoat = 0, clearcoat_roughness = 0;

  static double specular_brdf(double alpha, const V3& n, const V3& v, const V3& l, const V3& h) {
    const double a2 = alpha * alpha, nh = dot3(n, h), nl = std::abs(dot3(n, l)), nv = std::abs(dot3(n, v));
    const double d = a2 / (M_PI * std::pow(nh * nh * (a2 - 1) + 1, 2));
    const auto g1 = [&](double c) { return 2 * c / (c + std::sqrt(a2 + (1 - a2) * c * c)); };
    const double vis = g1(nl) * g1(nv) / (4 * nl * nv);
    return vis * d;
  }
  double brdf(const V3& v, const V3& l) const {
    const V3 n{0, 0, 1}, sum{v.x + l.x, v.y + l.y, v.z + l.z};
    const double length = std::sqrt(dot3(sum, sum));
    const V3 h{sum.x / length, sum.y / length, sum.z / length};
    const double w = std::pow(1 - std::abs(dot3(v, h)), 5);
    const double f0 = std::min(std::pow((1 - ior) / (1 + ior), 2) * specular_color, 1.0) * specular;
    const double fr = f0 + (specular - f0) * w;
    const double s = specular_brdf(roughness * roughness, n, v, l, h);
    const double dielectric = fr * s + (1 - fr) * base / M_PI, metal = s * (base + (1 - base) * w);
    const double material = (1 - metallic) * dielectric + metallic * metal;
    const double coat = specular_brdf(clearcoat_roughness * clearcoat_roughness, n, v, l, h);
    const double k = clearcoat * (0.04 + 0.96 * std::pow(1 - std::abs(v.z), 5));
    return (1 - k) * material + (clearcoat > 0 ? k * coat : 0);
  }
  /// Light reflected towards v in a sky of 1, by the midpoint rule: within 1e-4 for roughness >= 0.3.
  double albedo(const V3& v) const {
    constexpr int kTheta = 400, kPhi = 300;
    double sum = 0;
    for (int i = 0; i < kTheta; ++i) {
      const double theta = (i + 0.5) * M_PI / 2 / kTheta;
      double ring = 0;
      for (int k = 0; k < kPhi; ++k) ring += brdf(v, at(theta, (k + 0.5) * M_PI / kPhi));  // half: it is symmetric
      sum += ring * std::sin(theta) * std::cos(theta);
    }
    return sum * 2 * (M_PI / 2 / kTheta) * (M_PI / kPhi);
  }
};

Json model(const Specification& s) {
  return {{"type", "metallicroughness"},
          {"base_color", s.base},
          {"metallic", s.metallic},
          {"roughness", s.roughness},
          {"ior", s.ior},
          {"specular", s.specular},
          {"clearcoat", s.clearcoat},
          {"clearcoat_roughness", s.clearcoat_roughness}};
}

/// Where the specification's formulas reflect less light than they receive, the model follows them; where its
/// dielectric would reflect more, it reflects all.
TEST(MetallicRoughness, ReflectsWhatTheSpecificationSays) {
  int n_limited = 0;
  for (const double roughness : {0.3, 0.5, 0.75, 1.0})
    for (const double metallic : {0.0, 0.5, 1.0})
      for (const double base : {0.5, 0.8, 1.0})
        for (const float theta : {0.0f, 30.0f, 45.0f, 70.0f, 80.0f}) {
          const Specification specification{base, metallic, roughness};
          const double expected = specification.albedo(at(theta * M_PI / 180, 0));
          Specification dielectric = specification;
          dielectric.metallic = 0;
          const bool limited = dielectric.albedo(at(theta * M_PI / 180, 0)) > 1;
          n_limited += limited;
          const Bound closure(model(specification), direction(theta, 0));
          const std::string what = "roughness " + std::to_string(roughness) + ", metallic " + std::to_string(metallic) +
                                   ", base " + std::to_string(base) + ", " + std::to_string(theta) + " degrees";
          const float reflected = statistics::smooth_albedo(*closure, direction(theta, 0)).g;
          EXPECT_LE(reflected, 1 + 2e-3) << what;
          if (limited) {
            EXPECT_LE(reflected, expected + 5e-4) << what;
            EXPECT_GT(reflected, metallic == 0 ? 0.995 : 0) << what;
          } else {
            EXPECT_NEAR(reflected, expected, 1e-3) << what;
          }
          // N = 50 000; alpha = 5e-7. Weights are at most about 2: a bias of 1 % is found with power 0.99.
          double variance = 0;
          const Spectrum sampled = statistics::sampled_albedo(*closure, direction(theta, 0), 50000, 5, &variance);
          const auto result = statistics::z_test(sampled.g, variance, reflected, statistics::test_alpha(), 5e-4);
          EXPECT_TRUE(result.accepted) << what << ": " << result.message;
          const auto planted =
              statistics::z_test(sampled.g, variance, 1.03 * reflected, statistics::test_alpha(), 5e-4);
          EXPECT_FALSE(planted.accepted) << what << ": " << planted.message;
        }
  EXPECT_GT(n_limited, 10);
}

/// Dielectrics of roughness 1, from an independent integration of the same formulas.
TEST(MetallicRoughness, HasKnownAlbedos) {
  const auto albedo = [](double base, float theta) {
    return statistics::smooth_albedo(*Bound(model({base, 0, 1}), direction(theta, 0)), direction(theta, 0)).g;
  };
  EXPECT_NEAR(albedo(0.8, 0.1f), 0.780, 1e-3);
  EXPECT_NEAR(albedo(0.8, 45), 0.782, 1e-3);
  EXPECT_NEAR(albedo(0.8, 70), 0.784, 1e-3);
  EXPECT_NEAR(albedo(1, 80), 0.975, 1e-3);
}

TEST(MetallicRoughness, ValuesAreTheExtensionsFormulas) {
  Json coloured = model({0.6, 0.4, 0.5, 1.8, 0.7, 1, 0.9, 0.4});
  coloured["specular_color"] = rgb(0.5, 1, 20);  // the last would reflect more than everything
  coloured["base_color"] = rgb(0.6, 0.6, 0.6);
  for (const float theta : {5.0f, 50.0f, 85.0f})
    for (const float to : {10.0f, 60.0f, 88.0f})
      for (const float phi : {0.3f, 3.0f}) {
        const Bound closure(coloured, direction(theta, 0));
        const BsdfValue value = closure->eval(direction(theta, 0), direction(to, phi));
        const V3 v = at(theta * M_PI / 180, 0), l = at(to * M_PI / 180, phi);
        // Diffuse light is what the strongest channel leaves, here the last one.
        const Specification strongest{0.6, 0.4, 0.5, 1.8, 0.7, 20, 0.9, 0.4};
        EXPECT_NEAR(value.value.b, strongest.brdf(v, l) * l.z, 1e-4 * value.value.b) << theta << " " << to;
        for (int c = 0; c < 2; ++c) {
          Specification own_black = strongest, strongest_black = strongest;
          own_black.specular_color = c == 0 ? 0.5 : 1;
          own_black.base = strongest_black.base = 0;
          Specification metal = strongest, metal_black = strongest;
          metal.metallic = metal_black.metallic = 1, metal_black.base = 0;
          // Reflection from the own colour, diffuse light from the strongest, both with metal of the own base.
          const double of_metal = 0.4 * (metal.brdf(v, l) - metal_black.brdf(v, l));
          const double diffuse = strongest.brdf(v, l) - strongest_black.brdf(v, l) - of_metal;
          EXPECT_NEAR(value.value[c], (own_black.brdf(v, l) + of_metal + diffuse) * l.z, 2e-4 * value.value[c] + 1e-6)
              << theta << " " << to;
        }
      }
}

/// KHR_materials_transmission: the reflection of a white mirror image, without what the surface reflects.
TEST(MetallicRoughness, SheetsTransmitWhatTheyWouldReflectBehind) {
  const Json sheet{{"type", "metallicroughness"},
                   {"base_color", rgb(0.8, 0.5, 0.1)},
                   {"metallic", 0.0},
                   {"roughness", 0.5},
                   {"transmission", 0.75}};
  for (const float side : {1.0f, -1.0f}) {
    Vec3 wo = direction(40, 0), wi = direction(50, 2.5f);
    wo.z *= side, wi.z *= -side;
    const BsdfValue value = Bound(sheet, wo)->eval(wo, wi);
    const V3 v = at(40 * M_PI / 180, 0), l = at(50 * M_PI / 180, 2.5);
    const double s = (Specification{1, 1, 0.5}.brdf(v, l)) * l.z;  // F = 1
    const double reflected = Specification{0, 0, 0.5}.brdf(v, l) * l.z;
    EXPECT_NEAR(value.value.r, 0.75 * 0.8 * (s - reflected), 1e-4);
    EXPECT_NEAR(value.value.b, 0.75 * 0.1 * (s - reflected), 1e-4);
  }
  // Nothing is lost that a colour does not take: rough sheets lose what microfacets shadow.
  const Json clear{{"type", "metallicroughness"}, {"metallic", 0.0}, {"roughness", 0.1}, {"transmission", 1.0}};
  EXPECT_NEAR(statistics::smooth_albedo(*Bound(clear, direction(30, 0)), direction(30, 0)).g, 1, 1e-3);
}

std::vector<Json> materials() {
  const Json c = rgb(0.7, 0.4, 0.1);
  const auto with = [&](Json more) {
    more["type"] = "metallicroughness", more["base_color"] = c;
    return more;
  };
  return {
      with({{"metallic", 0.0}, {"roughness", 1.0}}),
      with({{"metallic", 0.0}, {"roughness", 0.3}}),
      with({{"metallic", 1.0}, {"roughness", 0.25}}),
      with({{"metallic", 0.4}, {"roughness", 0.5}, {"clearcoat", 0.8}, {"clearcoat_roughness", 0.3}}),
      with({{"metallic", 0.1}, {"roughness", 0.6}, {"transmission", 0.6}, {"clearcoat", 0.5}}),
      with({{"metallic", 0.0}, {"roughness", 0.4}, {"transmission", 1.0}, {"thin", false}, {"ior", 1.33}}),
      with({{"metallic", 0.2},
            {"roughness", 0.5},
            {"transmission", 0.5},
            {"thin", false},
            {"clearcoat", 1.0},
            {"clearcoat_roughness", 0.4}}),
      {{"type", "metallicroughness"}, {"base_color", 0.0}, {"metallic", 1.0}, {"roughness", 0.6}},
  };
}

// As for all models (support/model_checks.h): N = 100 000 in 64 cells, alpha = 5e-7. Planted bugs: below.
TEST(MetallicRoughness, SamplesFollowTheDensities) {
  for (const Json& material : materials())
    for (const float theta : {2.0f, 40.0f, 80.0f, 130.0f}) {
      const Bound closure(material, direction(theta, 0.7f));
      if (theta > 90 && !(closure->flags() & kGlossyTransmission)) continue;
      statistics::Chi2Options options = kModelChi2;
      options.name = material.dump() + " theta " + std::to_string(theta);
      EXPECT_EQ(join(check_closure(*closure, direction(theta, 0.7f), options)), "");
    }
}

TEST(MetallicRoughness, PlantedBugsAreRejected) {
  const Bound closure(materials()[4], direction(40, 0.7f));
  for (const Planted::Bug bug : {Planted::Bug::kDensity, Planted::Bug::kReuse, Planted::Bug::kPmf})
    EXPECT_NE(join(check_closure(Planted(*closure, bug), direction(40, 0.7f), kModelChi2)), "");
}

// As in principled_test.cpp.
TEST(MetallicRoughness, WeightsIntegrateToTheAlbedo) {
  for (const Json& material : materials())
    for (const float theta : {10.0f, 75.0f, 120.0f}) {
      const Vec3 wo = direction(theta, -1.1f);
      const Bound closure(material, wo);
      if (theta > 90 && !(closure->flags() & kGlossyTransmission)) continue;
      double variance = 0;
      const Spectrum sampled = statistics::sampled_albedo(*closure, wo, 200000, 3, &variance);
      const Spectrum exact = statistics::smooth_albedo(*closure, wo);
      EXPECT_LE(max_component(exact), 1 + 1e-3f);
      const auto result = statistics::z_test(sampled.g, variance, exact.g, statistics::test_alpha(), 3e-4);
      EXPECT_TRUE(result.accepted) << material.dump() << " theta " << theta << ": " << result.message;
    }
}

TEST(MetallicRoughness, SidesAndWrongParameters) {
  const Bound opaque({{"type", "metallicroughness"}}, {0, 0, -1});
  EXPECT_FALSE(opaque->sample({0, 0, -1}, 0.3f, {0.2f, 0.7f}).valid());
  EXPECT_EQ(opaque->eval({0, 0, -1}, direction(150, 1)).value, Spectrum(0));
  const auto contains = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  contains(bsdf_errors({{"type", "metallicroughness"}, {"metallic", 1.5}}), "is 1.5; expected a number in [0, 1]");
  contains(bsdf_errors({{"type", "metallicroughness"}, {"ior", -1.0}}), "ior");
  contains(bsdf_errors({{"type", "metallicroughness"}, {"spec_trans", 0.5}}), "spec_trans");
}

}  // namespace
}  // namespace covary::metallicroughness_test
