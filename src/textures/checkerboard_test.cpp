// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "support/describe.h"
#include "textures/registry.h"

namespace covary {
namespace {

using test_support::make_plugin;

TEST(Checkerboard, AgreesWithMitsuba) {
  std::ifstream file(COVARY_SOURCE_DIR "/tests/references/textures.json");
  const nlohmann::json all = nlohmann::json::parse(file);
  const auto made =
      make_plugin<Texture>(texture_plugins(), "texture", "checkerboard",
                           {{"color0", ColourValue{{0.9f, 0.5f, 0.1f}}},
                            {"color1", ColourValue{{0.2f, 0.3f, 0.4f}}},
                            {"to_uv", Transform::translate({0.1f, 0.2f, 0}) * Transform::scale({2, 3, 1})}});
  ASSERT_EQ(made.errors, "");
  const auto& points = all["points"];
  for (size_t i = 0; i < points.size(); ++i) {
    SurfaceHit hit;
    hit.uv = {points[i][0].get<float>(), points[i][1].get<float>()};
    const Spectrum value = made.object->eval(hit);
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(value[c], all["checkerboard"]["eval"][i][c].get<float>());
  }
}

TEST(Checkerboard, OneChannelLookupsShowTheSameSquares) {
  const auto made =
      make_plugin<Texture>(texture_plugins(), "texture", "checkerboard", {{"color0", 0.75}, {"color1", 0.25}});
  for (const Vec2 uv : {Vec2{0.1f, 0.1f}, {0.6f, 0.1f}, {0.6f, 0.6f}, {-0.1f, 0.2f}}) {
    SurfaceHit hit;
    hit.uv = uv;
    EXPECT_EQ(made.object->eval_1(hit), made.object->eval(hit).r);
  }
  EXPECT_FLOAT_EQ(made.object->mean(), 0.5f);
}

TEST(Uniform, IsAConstant) {
  const auto made = make_plugin<Texture>(texture_plugins(), "texture", "uniform", {{"value", ColourValue{{1, 2, 3}}}});
  ASSERT_EQ(made.errors, "");
  EXPECT_TRUE(made.object->is_constant());
  EXPECT_EQ(made.object->eval(SurfaceHit{}), Spectrum(1, 2, 3));
}

}  // namespace
}  // namespace covary
