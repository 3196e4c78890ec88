// SPDX-License-Identifier: Apache-2.0
// Textures of pbrt: mixtures, mappings, patterns in space. Values by pbrt's formulas (textures.h, textures.cpp).
#include <gtest/gtest.h>

#include <cmath>

#include "core/perlin_noise.h"
#include "support/describe.h"
#include "textures/bitmap.h"
#include "textures/registry.h"

namespace covary::patterns_test {
namespace {

using namespace test_support;

Made<Texture> make(const std::string& type, const NamedValues& values, const TexturePtr& nested = nullptr,
                   const std::string& name = "") {
  Diagnostics diagnostics;
  GivenObjects objects(diagnostics);
  NamedValues all = values;
  if (nested) all.emplace_back(name, objects.nest("texture", nested));
  return make_plugin<Texture>(texture_plugins(), "texture", type, all, objects, diagnostics);
}

/// (u, v) as a colour: a bilerp of (0, 0), (1, 0), (0, 1), (1, 1).
TexturePtr coordinates() {
  return make("bilerp", {{"v00", ColourValue{{0, 0, 0}}},
                         {"v10", ColourValue{{1, 0, 0}}},
                         {"v01", ColourValue{{0, 1, 0}}},
                         {"v11", ColourValue{{1, 1, 0}}}})
      .object;
}

SurfaceHit at(const Vec3& p, Vec2 uv = {}) {
  SurfaceHit hit;
  hit.p = p, hit.uv = uv, hit.frame = Frame({0, 0, 1});
  return hit;
}

void expect_near(const Spectrum& a, const Spectrum& b) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 1e-5f);
}

TEST(Patterns, MixInterpolates) {
  const auto half =
      make("mix", {{"first", ColourValue{{1, 2, 3}}}, {"second", ColourValue{{5, 2, 1}}}, {"amount", .25}});
  ASSERT_EQ(half.errors, "");
  expect_near(half.object->eval(at({})), {2, 2, 2.5f});
  EXPECT_TRUE(half.object->is_constant());
  // By a texture: inverted (1 - t), never below 0.
  const auto inverted = make("mix", {{"first", 1.0}, {"second", 0.0}}, coordinates(), "amount");
  expect_near(inverted.object->eval(at({}, {0.25f, 1.5f})), {0.75f, 0, 1});
  // By the normal: |n · d|, here cos 60 degrees, of the second.
  const auto direction = make("mix", {{"first", 1.0}, {"second", 5.0}, {"direction", Vec3{std::sqrt(3.0f), 0, -1}}});
  EXPECT_NEAR(direction.object->eval_1(at({})), 3, 1e-5f);
  EXPECT_FALSE(direction.object->is_constant());
}

/// uv.h of pbrt-v3: (s - floor(s), t - floor(t)). Beyond its square, a plain one goes on, not below 0.
TEST(Patterns, BilerpMayRepeat) {
  const auto repeated = make("bilerp", {{"v00", ColourValue{{0, 0, 0}}},
                                        {"v10", ColourValue{{1, 0, 0}}},
                                        {"v01", ColourValue{{0, 1, 0}}},
                                        {"v11", ColourValue{{1, 1, 0}}},
                                        {"repeat", true}});
  expect_near(repeated.object->eval(at({}, {-0.25f, 3.5f})), {0.75f, 0.5f, 0});
  expect_near(repeated.object->eval(at({}, {0.25f, 0.5f})), {0.25f, 0.5f, 0});
  expect_near(coordinates()->eval(at({}, {-0.25f, 3.5f})), {0, 3.5f, 0});
}

TEST(Patterns, FactorsMayBeTextures) {
  Diagnostics diagnostics;
  GivenObjects objects(diagnostics);
  const auto product = make_plugin<Texture>(
      texture_plugins(), "texture", "scale",
      {{"", objects.nest("texture", coordinates())}, {"scale", objects.nest("texture", coordinates())}}, objects,
      diagnostics);
  ASSERT_EQ(product.errors, "");
  expect_near(product.object->eval(at({}, {0.5f, 0.25f})), {0.25f, 0.0625f, 0});
  // d/du of (y(u, v))^2, y the luminance.
  const Vec2 gradient = product.object->grad_1(at({}, {0.5f, 0.25f}));
  const float y = luminance(Spectrum(0.5f, 0.25f, 0));
  EXPECT_NEAR(gradient.x, 2 * y * luminance(Spectrum(1, 0, 0)), 1e-5f);
  EXPECT_NEAR(gradient.y, 2 * y * luminance(Spectrum(0, 1, 0)), 1e-5f);
}

TEST(Patterns, FactorsHaveExponents) {
  const auto root = make("scale", {{"scale", 4.0}, {"exponent", 0.5}}, coordinates(), "");
  ASSERT_EQ(root.errors, "");
  expect_near(root.object->eval(at({}, {0.25f, 0.04f})), {1, 0.4f, 0});
  // d sqrt(4 y) / dv = sqrt(1 / y) dy / dv.
  const float y = luminance(Spectrum(0.25f, 0.04f, 0));
  EXPECT_NEAR(root.object->grad_1(at({}, {0.25f, 0.04f})).y, luminance(Spectrum(0, 1, 0)) / std::sqrt(y), 1e-4f);
}

TEST(Patterns, MappingsProjectPositions) {
  const Transform moved = Transform::translate({1, 2, 3});
  const auto value = [&](const NamedValues& values, const Vec3& p) {
    NamedValues all = values;
    all.emplace_back("to_world", moved);
    const auto made = make("projected", all, coordinates());
    EXPECT_EQ(made.errors, "");
    return made.object->eval(at(p));
  };
  expect_near(value({{"v1", Vec3{0, 0.5f, 0}}, {"v2", Vec3{0, 0, 2}}, {"offset", Vec3{0.1f, 0.2f, 0}}},
                    {9, 2 + 0.4f, 3 + 0.3f}),
              {0.3f, 0.8f, 0});
  // φ = 90 degrees, z = 0.25; θ = 90 degrees, φ = 225.
  expect_near(value({{"mapping", std::string("cylindrical")}}, {1, 7, 3.25f}), {0.75f, 0.25f, 0});
  expect_near(value({{"mapping", std::string("spherical")}}, {0, 1, 3}), {0.5f, 0.625f, 0});
}

/// The published value of Perlin's reference implementation, zeros at the lattice, octaves.
TEST(Patterns, NoiseIsPerlins) {
  EXPECT_NEAR(perlin_noise({3.14f, 42, 7}), 0.136919958784, 1e-5);
  EXPECT_EQ(perlin_noise({-3, 5, 250}), 0);
  const Vec3 p{0.3f, -1.7f, 2.2f};
  const float n[] = {perlin_noise(p), perlin_noise(p * 1.99f), perlin_noise(p * (1.99f * 1.99f))};
  const auto value = [&](const std::string& pattern) {
    return make("noise", {{"pattern", pattern}, {"octaves", int64_t{3}}, {"roughness", 0.4}}).object->eval_1(at(p));
  };
  EXPECT_NEAR(value("fbm"), n[0] + 0.4f * n[1] + 0.16f * n[2], 1e-5f);
  EXPECT_NEAR(value("wrinkled"), std::abs(n[0]) + 0.4f * std::abs(n[1]) + 0.16f * std::abs(n[2]) + 0.2f * 0.064f,
              1e-5f);
  EXPECT_NEAR(value("windy"), std::abs(fractal_noise(p * 0.1f, 0.5f, 3)) * fractal_noise(p, 0.5f, 6), 1e-5f);
  // At the origin there is no noise: the middle of the spline, its fourth colour.
  expect_near(make("noise", {{"pattern", std::string("marble")}}).object->eval(at({})), Spectrum(0.75f));
}

TEST(Patterns, DotsLieInSomeOfTheSquares) {
  const auto dots = make("dots", {{"inside", 1.0}, {"outside", 0.0}});
  int inside = 0, cells = 0;
  constexpr int kCells = 64, kSteps = 16;
  for (int y = 0; y < kCells; ++y)
    for (int x = 0; x < kCells; ++x) {
      int in_cell = 0;
      for (int i = 0; i < kSteps * kSteps; ++i)
        in_cell += dots.object->eval_1(
                       at({}, {static_cast<float>(x) - 0.5f + (static_cast<float>(i % kSteps) + 0.5f) / kSteps,
                               static_cast<float>(y) - 0.5f + (static_cast<float>(i / kSteps) + 0.5f) / kSteps})) > 0;
      inside += in_cell, cells += in_cell > 0;
    }
  EXPECT_GT(cells, kCells * kCells / 4);  // where the noise in the middle is positive
  EXPECT_LT(cells, kCells * kCells * 3 / 4);
  // Each dot is a whole disk.
  EXPECT_NEAR(static_cast<float>(inside) / (kSteps * kSteps) / static_cast<float>(cells), kPi * 0.35f * 0.35f, 0.005f);
}

TEST(Patterns, CheckerboardsMayFillSpace) {
  const auto cubes = make("checkerboard", {{"color0", 1.0}, {"color1", 0.0}, {"dimension", int64_t{3}}});
  ASSERT_EQ(cubes.errors, "");
  for (const Vec3& p :
       {Vec3{0.5f, 0.5f, 0.5f}, Vec3{-0.5f, 1.5f, 0.5f}, Vec3{-0.5f, -0.5f, -2.5f}, Vec3{2.5f, 1.5f, 0.5f}}) {
    const int sum = static_cast<int>(std::floor(p.x) + std::floor(p.y) + std::floor(p.z));
    EXPECT_EQ(cubes.object->eval_1(at(p)), sum % 2 == 0 ? 1 : 0);
  }
}

TEST(Patterns, BitmapsMayEndInBlackAndHaveGamma) {
  TexelImage image;
  image.width = image.height = 1, image.channels = 1, image.bytes = {128}, image.srgb = true;
  BitmapSettings settings;
  settings.wrap = WrapMode::kBlack, settings.gamma = 2.0f;
  const auto texture = make_bitmap_texture(image, settings);
  EXPECT_NEAR(texture->eval_1(at({}, {0.5f, 0.5f})), std::pow(128 / 255.0f, 2.0f), 1e-6f);
  EXPECT_EQ(texture->eval_1(at({}, {1.5f, 0.5f})), 0);
}

}  // namespace
}  // namespace covary::patterns_test
