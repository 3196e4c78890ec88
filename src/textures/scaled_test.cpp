// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "support/describe.h"
#include "textures/bitmap.h"
#include "textures/registry.h"

namespace covary {
namespace {

using namespace test_support;

TexturePtr ramp() {
  TexelImage image;
  image.width = 2, image.height = 2, image.channels = 3, image.floats = {0, 1, 2, 1, 1, 1, 2, 0, 1, 3, 2, 1};
  return make_bitmap_texture(image, {});
}

Made<Texture> scaled(const std::vector<TexturePtr>& nested, const Value& scale, const NamedValues& more = {}) {
  Diagnostics diagnostics;
  GivenObjects objects(diagnostics);
  NamedValues values = more;
  values.emplace_back("scale", scale);
  for (const TexturePtr& texture : nested) values.emplace_back("", objects.nest("texture", texture));
  return make_plugin<Texture>(texture_plugins(), "texture", "scale", values, objects, diagnostics);
}

TEST(ScaledTexture, MultipliesTheNestedTexture) {
  SurfaceHit hit;
  hit.uv = {0.4f, 0.6f};
  const TexturePtr plain = ramp();
  const auto grey = scaled({plain}, 2.5);
  ASSERT_EQ(grey.errors, "");
  EXPECT_EQ(grey.object->eval(hit), plain->eval(hit) * 2.5f);
  EXPECT_FLOAT_EQ(grey.object->eval_1(hit), plain->eval_1(hit) * 2.5f);
  EXPECT_FLOAT_EQ(grey.object->grad_1(hit).x, plain->grad_1(hit).x * 2.5f);
  EXPECT_FLOAT_EQ(grey.object->mean(), plain->mean() * 2.5f);
  EXPECT_EQ(grey.object->pdf_position(hit.uv), plain->pdf_position(hit.uv));
  const auto coloured = scaled({plain}, ColourValue{{1, 2, 0}});
  EXPECT_EQ(coloured.object->eval(hit), plain->eval(hit) * Spectrum(1, 2, 0));
  EXPECT_FLOAT_EQ(coloured.object->eval_1(hit), luminance(plain->eval(hit) * Spectrum(1, 2, 0)));
}

TEST(ScaledTexture, ClampsAfterScaling) {
  const TexturePtr plain = ramp();
  const auto clamped = scaled({plain}, 1.5, {{"maximum", 1.2}});
  ASSERT_EQ(clamped.errors, "");
  int n_clamped = 0;
  for (int i = 0; i < 36; ++i) {
    SurfaceHit hit;
    hit.uv = {static_cast<float>(i % 6) / 6, static_cast<float>(i / 6) / 6};
    const Spectrum scaled_up = plain->eval(hit) * 1.5f, value = clamped.object->eval(hit);
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(value[c], std::min(scaled_up[c], 1.2f));
    n_clamped += max_component(scaled_up) > 1.2f;
    EXPECT_FLOAT_EQ(clamped.object->eval_1(hit), std::min(1.5f * plain->eval_1(hit), 1.2f));
    if (1.5f * plain->eval_1(hit) > 1.2f) {
      EXPECT_EQ(clamped.object->grad_1(hit).x, 0);
    }
  }
  EXPECT_GT(n_clamped, 10);
}

TEST(ScaledTexture, NeedsOneTexture) {
  EXPECT_EQ(scaled({}, 1.0).errors, "test.xml:1:1: texture 'scale': needs exactly one nested texture, but has 0");
  EXPECT_EQ(scaled({ramp(), ramp()}, 1.0).errors,
            "test.xml:1:1: texture 'scale': needs exactly one nested texture, but has 2");
}

}  // namespace
}  // namespace covary
