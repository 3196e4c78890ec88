// SPDX-License-Identifier: Apache-2.0
// The layers of metallicroughness against the formulas of KHR_materials_sheen, _anisotropy, _iridescence and
// _diffuse_transmission, written down again in double precision.
#include "bsdfs/charlie_sheen.h"
#include "bsdfs/iridescence.h"
#include "support/model_checks.h"

namespace covary::metallicroughness_layers_test {
namespace {

using namespace covary::testing;
using statistics::check_closure;
using statistics::join;

Json model(Json more) {
  more["type"] = "metallicroughness";
  if (!more.contains("metallic")) more["metallic"] = 0.0;
  return more;
}

/// Distribution and visibility of KHR_materials_sheen, alpha_g = roughness^2, times the cosine of l.
double sheen(double roughness, const Vec3& v, const Vec3& l) {
  const double a = roughness * roughness, t = (1 - a) * (1 - a);
  const auto mix = [&](double x, double y) { return x + (y - x) * t; };
  const auto fit = [&](double x) {
    return mix(21.5473, 25.3245) / (1 + mix(3.82987, 3.32435) * std::pow(x, mix(0.19823, 0.16801))) +
           mix(-1.97760, -1.27393) * x + mix(-4.32054, -4.85967);
  };
  const auto lambda = [&](double c) { return c < 0.5 ? std::exp(fit(c)) : std::exp(2 * fit(0.5) - fit(1 - c)); };
  const Vec3 h = normalize(v + l);
  const double sine = std::sqrt(std::max(1.0 - static_cast<double>(h.z) * h.z, 0.0));
  const double d = (2 + 1 / a) * std::pow(sine, 1 / a) / (2 * M_PI);
  return d / ((1 + lambda(v.z) + lambda(l.z)) * 4 * v.z * l.z) * l.z;
}
double sheen_albedo(double roughness, const Vec3& v) {
  constexpr int kN = 400;
  double sum = 0;
  for (int i = 0; i < kN; ++i)
    for (int k = 0; k < kN; ++k) {
      const double theta = (i + 0.5) * M_PI / 2 / kN, phi = (k + 0.5) * M_PI / kN;
      const Vec3 l{static_cast<float>(std::sin(theta) * std::cos(phi)),
                   static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta))};
      sum += sheen(roughness, v, l) * std::sin(theta);
    }
  return 2 * sum * (M_PI / 2 / kN) * (M_PI / kN);
}

TEST(MetallicRoughnessLayers, SheenIsTheExtensionsOnTopOfWhatItLeaves) {
  for (const double roughness : {0.3, 0.5, 1.0})
    for (const float theta : {10.0f, 60.0f, 80.0f}) {
      const Vec3 v = direction(theta, 0);
      EXPECT_NEAR(charlie_albedo(v.z, static_cast<float>(roughness)), sheen_albedo(roughness, v), 6e-3)
          << roughness << " " << theta;
      const Json base = model({{"base_color", 0.5}, {"roughness", 0.7}});
      Json cloth = base;
      cloth["sheen_color"] = rgb(0.8, 0.4, 0.1), cloth["sheen_roughness"] = roughness;
      for (const float to : {20.0f, 70.0f}) {
        const Vec3 l = direction(to, 2);
        const Spectrum below = Bound(base, v)->eval(v, l).value, all = Bound(cloth, v)->eval(v, l).value;
        const double least = 1 - 0.8 * std::max(sheen_albedo(roughness, v), sheen_albedo(roughness, direction(to, 0)));
        EXPECT_NEAR(all.r, 0.8 * sheen(roughness, v, l) + least * below.r, 0.01 * all.r) << roughness << " " << theta;
        EXPECT_NEAR(all.b, 0.1 * sheen(roughness, v, l) + least * below.b, 0.01 * all.b) << roughness << " " << theta;
      }
    }
}

/// A white furnace: what sheen reflects, the base no longer gets.
TEST(MetallicRoughnessLayers, SheenMakesNoLight) {
  for (const float theta : {5.0f, 45.0f, 75.0f, 85.0f}) {
    const Vec3 v = direction(theta, 0);
    const Json cloth = model({{"base_color", 1.0}, {"roughness", 1.0}, {"sheen_color", 1.0}, {"sheen_roughness", 0.5}});
    EXPECT_LE(statistics::smooth_albedo(*Bound(cloth, v), v).g, 1.005f) << theta;
  }
}

/// GGX of alpha (lerp(strength^2, alpha, 1), alpha) with separable masking; metal of reflectance 1.
TEST(MetallicRoughnessLayers, AnisotropyStretchesAlongItsDirection) {
  constexpr double kStrength = 0.6, kRoughness = 0.5, kTurn = 0.4;
  const double ab = kRoughness * kRoughness, at = ab + (1 - ab) * kStrength * kStrength;
  const Json metal = model({{"base_color", 1.0},
                            {"metallic", 1.0},
                            {"roughness", kRoughness},
                            {"anisotropy", kStrength},
                            {"anisotropy_rotation", kTurn}});
  for (const float phi : {0.0f, 0.4f, 1.5f, 3.0f}) {
    const Vec3 v = direction(40, phi), l = direction(55, phi + 2.5f), h = normalize(v + l);
    const auto along = [&](const Vec3& w) { return std::cos(kTurn) * w.x + std::sin(kTurn) * w.y; };
    const auto across = [&](const Vec3& w) { return std::cos(kTurn) * w.y - std::sin(kTurn) * w.x; };
    const double x = along(h) / at, y = across(h) / ab;
    const double d = 1 / (M_PI * at * ab * std::pow(x * x + y * y + h.z * h.z, 2));
    const auto g1 = [&](const Vec3& w) {
      return 2 * w.z / (w.z + std::sqrt(w.z * w.z + std::pow(at * along(w), 2) + std::pow(ab * across(w), 2)));
    };
    const double expected = d * g1(v) * g1(l) / (4 * v.z);
    EXPECT_NEAR(Bound(metal, v)->eval(v, l).value.g, expected, 1e-4 * expected) << phi;
  }
}

/// KHR_materials_clearcoat with a normal map: its Fresnel and microfacets about that normal, on a black base. The other
/// way round, for light paths, the value is the adjoint.
TEST(MetallicRoughnessLayers, CoatsMayHaveNormalsOfTheirOwn) {
  const Vec3 n = normalize(Vec3{0.3f, -0.2f, 1});
  const auto map = [](const Vec3& m) { return rgb(0.5 + 0.5 * m.x, 0.5 + 0.5 * m.y, 0.5 + 0.5 * m.z); };
  const Json coat = model({{"base_color", 0.0},
                           {"specular", 0.0},
                           {"clearcoat", 0.8},
                           {"clearcoat_roughness", 0.6},
                           {"clearcoat_normal", map(n)}});
  const double alpha = 0.36;
  const auto g1 = [&](double c) { return 2 * c / (c + std::sqrt(alpha * alpha + (1 - alpha * alpha) * c * c)); };
  for (const float phi : {0.0f, 2.0f, 4.0f}) {
    const Vec3 v = direction(35, phi), l = direction(50, phi + 2), h = normalize(v + l);
    const double vn = dot(v, n), ln = dot(l, n), hn = dot(h, n);
    const double d = alpha * alpha / (M_PI * std::pow(hn * hn * (alpha * alpha - 1) + 1, 2));
    const double k = 0.8 * (0.04 + 0.96 * std::pow(1 - vn, 5)), expected = k * d * g1(vn) * g1(ln) / (4 * vn);
    EXPECT_NEAR(Bound(coat, v)->eval(v, l).value.g, expected, 1e-4 * expected) << phi;
    const Spectrum adjoint = Bound(coat, l, TransportMode::kImportance)->eval(l, v).value;
    EXPECT_NEAR(adjoint.g, expected * v.z / l.z, 1e-4 * expected) << phi;
  }
  const Vec3 v = direction(50, 1), l = direction(40, 3);
  Json under_map = coat;
  under_map["base_normal"] = map(n);  // the base's normal is the coat's
  Json plain = coat;
  plain.erase("clearcoat_normal");
  const float expected = Bound(plain, v)->eval(v, l).value.g;
  EXPECT_NEAR(Bound(under_map, v)->eval(v, l).value.g, expected, 1e-3f * expected);
  check_closure(*Bound(coat, v), v, kModelChi2, 17);
}

/// Airy's sum for three wavelengths, with Schlick's reflectances of the two interfaces: what the extension approximates
/// for broad bands. Exact where the film is much thinner than a wavelength, and for a base like the film.
TEST(MetallicRoughnessLayers, IridescenceIsThatOfAThinFilm) {
  const auto schlick = [](double r0, double c) { return r0 + (1 - r0) * std::pow(1 - c, 5); };
  // No film: the base alone.
  EXPECT_NEAR(thin_film_reflectance(Spectrum(0.3f, 0.5f, 0.9f), 1.3f, 0, 1).g, 0.5, 0.01);
  for (const float c : {1.0f, 0.7f, 0.4f}) {
    // A film as the base, 1.5: the first interface alone, whatever the thickness.
    const double cos2 = std::sqrt(1 - (1 - c * c) / 2.25), second = schlick(0, cos2);
    EXPECT_NEAR(thin_film_reflectance(Spectrum(0.04f), 1.5f, 400, c).g, schlick(0.04, c),
                2 * std::sqrt(0.04 * second) + 0.01);
  }
  // Colours change with the thickness, and with the angle; reflectance stays in [0, 1.1].
  const Spectrum at300 = thin_film_reflectance(Spectrum(0.04f), 1.8f, 300, 1);
  const Spectrum at450 = thin_film_reflectance(Spectrum(0.04f), 1.8f, 450, 1);
  EXPECT_GT(std::abs(at300.r / at300.g - at450.r / at450.g), 0.1f);
  // Green light of 550 nm: at an optical path difference of half a wavelength plus the phase of pi at the first
  // interface the two reflections add up, at a whole wavelength they cancel (film denser than both sides).
  const float quarter = 550 / 4.0f / 1.8f;
  EXPECT_GT(thin_film_reflectance(Spectrum(0.04f), 1.8f, quarter, 1).g,
            2 * thin_film_reflectance(Spectrum(0.04f), 1.8f, 2 * quarter, 1).g);
  // Airy at 550 nm for a quarter wave: r = (r1 + r2) / (1 + r1 r2) with r1 = r12, r2 = -r23 here both of one sign.
  const double r1 = 0.8 / 2.8, r2 = (1.8 - 1.5) / 3.3, r = (r1 + r2) / (1 + r1 * r2);
  EXPECT_NEAR(thin_film_reflectance(Spectrum(0.04f), 1.8f, quarter, 1).g, r * r, 0.03);
}

TEST(MetallicRoughnessLayers, IridescenceReplacesTheReflectance) {
  const Vec3 v = direction(30, 0), l = direction(40, 3);
  Json plain = model({{"base_color", 0.0}, {"roughness", 0.4}});
  const float bare = Bound(plain, v)->eval(v, l).value.g;
  plain["iridescence"] = 0.5, plain["iridescence_thickness"] = 250.0, plain["iridescence_ior"] = 1.6;
  const float c = dot(v, normalize(v + l)), w = std::pow(1 - c, 5.0f);
  const float film = thin_film_reflectance(Spectrum(0.04f), 1.6f, 250, c).g;
  EXPECT_NEAR(Bound(plain, v)->eval(v, l).value.g, bare * (0.5f * film / (0.04f + 0.96f * w) + 0.5f), 1e-3 * bare);
}

/// (1 - F) colour / pi times the cosine behind; the rest in front.
TEST(MetallicRoughnessLayers, DiffuseTransmissionGoesToTheOtherSide) {
  const Json leaf = model({{"base_color", 0.6},
                           {"roughness", 0.8},
                           {"diffuse_transmission", 0.25},
                           {"diffuse_transmission_color", rgb(0.2, 0.9, 0.1)}});
  for (const float side : {1.0f, -1.0f}) {
    Vec3 v = direction(40, 0), l = direction(120, 1);
    const Vec3 mirrored{l.x, l.y, -l.z};
    const double w = std::pow(1 - dot(v, normalize(v + mirrored)), 5), f = 0.04 + 0.96 * w;
    v.z *= side, l.z *= side;
    const Spectrum value = Bound(leaf, v)->eval(v, l).value;
    EXPECT_NEAR(value.g, (1 - f) * 0.25 * 0.9 / M_PI * std::abs(l.z), 1e-5);
    EXPECT_NEAR(value.b / value.g, 0.1 / 0.9, 1e-4);
  }
  const Vec3 v = direction(40, 0), l = direction(50, 2);
  Json opaque = leaf;
  opaque["diffuse_transmission"] = 0.0;
  Json black = opaque;
  black["base_color"] = 0.0;
  const auto value = [&](const Json& m) { return Bound(m, v)->eval(v, l).value.g; };
  EXPECT_NEAR(value(leaf) - value(black), 0.75 * (value(opaque) - value(black)), 1e-5);
}

/// A dielectric that reflects everything, as specular-glossiness has by default.
TEST(MetallicRoughnessLayers, TotalReflectionLeavesNoDiffuseLight) {
  for (const double roughness : {0.0, 0.3, 1.0})
    for (const float theta : {0.5f, 30.0f, 60.0f, 89.0f}) {
      const Bound closure(model({{"base_color", 1.0}, {"roughness", roughness}, {"ior", 0.0}}), direction(theta, 0));
      for (const float to : {0.0f, 45.0f, 88.0f})
        for (const float phi : {0.0f, 2.0f}) {
          const float value = closure->eval(direction(theta, 0), direction(to, phi)).value.g;
          EXPECT_TRUE(std::isfinite(value) && value >= -1e-6f) << roughness << " " << theta << " " << to;
        }
    }
}

std::vector<Json> layered() {
  return {
      model({{"base_color", 0.4}, {"roughness", 0.6}, {"sheen_color", rgb(0.9, 0.5, 0.2)}, {"sheen_roughness", 0.4}}),
      model({{"base_color", 0.8},
             {"metallic", 1.0},
             {"roughness", 0.5},
             {"anisotropy", 0.7},
             {"anisotropy_rotation", 1.0}}),
      model({{"base_color", 0.5}, {"roughness", 0.4}, {"iridescence", 1.0}, {"iridescence_thickness", 500.0}}),
      model({{"base_color", 0.5},
             {"roughness", 0.7},
             {"diffuse_transmission", 0.5},
             {"clearcoat", 0.5},
             {"clearcoat_roughness", 0.3}}),
      model({{"base_color", 0.7},
             {"roughness", 0.5},
             {"transmission", 0.4},
             {"diffuse_transmission", 0.5},
             {"anisotropy", 0.5}})};
}

// As for all models (support/model_checks.h): N = 100 000 in 64 cells, alpha = 5e-7.
TEST(MetallicRoughnessLayers, SamplesFollowTheDensities) {
  for (const Json& material : layered())
    for (const float theta : {2.0f, 40.0f, 80.0f, 130.0f}) {
      const Bound closure(material, direction(theta, 0.7f));
      if (theta > 90 && !(closure->flags() & kTransmission)) continue;
      statistics::Chi2Options options = kModelChi2;
      options.name = material.dump() + " theta " + std::to_string(theta);
      EXPECT_EQ(join(check_closure(*closure, direction(theta, 0.7f), options)), "");
    }
}

// As in principled_test.cpp.
TEST(MetallicRoughnessLayers, WeightsIntegrateToTheAlbedo) {
  for (const Json& material : layered())
    for (const float theta : {10.0f, 75.0f, 120.0f}) {
      const Vec3 wo = direction(theta, -1.1f);
      const Bound closure(material, wo);
      if (theta > 90 && !(closure->flags() & kTransmission)) continue;
      double variance = 0;
      const Spectrum sampled = statistics::sampled_albedo(*closure, wo, 200000, 3, &variance);
      const Spectrum exact = statistics::smooth_albedo(*closure, wo);
      const auto result = statistics::z_test(sampled.g, variance, exact.g, statistics::test_alpha(), 1e-3);
      EXPECT_TRUE(result.accepted) << material.dump() << " theta " << theta << ": " << result.message;
    }
}

}  // namespace
}  // namespace covary::metallicroughness_layers_test
