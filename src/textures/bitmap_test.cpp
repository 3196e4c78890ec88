// SPDX-License-Identifier: Apache-2.0
// Lookups against Mitsuba 3 (tests/references/textures.json), gradients, and the sampling of positions.
#include "textures/bitmap.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/random.h"
#include "statistics/chi2.h"
#include "support/base64.h"
#include "support/describe.h"
#include "support/files.h"
#include "textures/registry.h"

namespace covary {
namespace {

using test_support::make_plugin;
using test_support::TemporaryFolder;

SurfaceHit hit_at(Vec2 uv) {
  SurfaceHit hit;
  hit.uv = uv;
  return hit;
}

nlohmann::json references() {
  std::ifstream file(COVARY_SOURCE_DIR "/tests/references/textures.json");
  return nlohmann::json::parse(file);
}

Transform to_uv(const nlohmann::json& rows) {
  if (rows.is_null()) return {};
  return Transform(Matrix4{
      {{rows[0][0], rows[0][1], 0, rows[0][2]}, {rows[1][0], rows[1][1], 0, rows[1][2]}, {0, 0, 1, 0}, {0, 0, 0, 1}}});
}

Vec2 point(const nlohmann::json& p) { return {p[0].get<float>(), p[1].get<float>()}; }

/// Compares all lookups of `texture` with `expected`. Single precision in (u, v) up to 4, and texels that differ by up
/// to `scale`, leave errors of about 1e-6 * scale * resolution.
void expect_lookups(const Texture& texture, const nlohmann::json& points, const nlohmann::json& expected,
                    const std::string& name) {
  double scale = 1;
  for (const auto& value : expected["eval"]) scale = std::max(scale, std::abs(value[0].get<double>()));
  const double tolerance = 1e-5 * scale;
  for (size_t i = 0; i < points.size(); ++i) {
    const SurfaceHit hit = hit_at(point(points[i]));
    const Spectrum value = texture.eval(hit);
    const auto& reference = expected["eval"][i];
    for (int c = 0; c < 3; ++c)
      ASSERT_NEAR(value[c], reference[reference.size() == 3 ? c : 0].get<double>(), tolerance)
          << name << " channel " << c << " at (" << hit.uv.x << ", " << hit.uv.y << ")";
    ASSERT_NEAR(texture.eval_1(hit), expected["eval_1"][i].get<double>(), tolerance) << name;
    if (expected["grad_1"].empty()) continue;
    const Vec2 gradient = texture.grad_1(hit);
    for (int c = 0; c < 2; ++c)
      ASSERT_NEAR(gradient[c], expected["grad_1"][i][c].get<double>(), 50 * tolerance)
          << name << " derivative " << c << " at (" << hit.uv.x << ", " << hit.uv.y << ")";
  }
  EXPECT_NEAR(texture.mean(), expected["mean"].get<double>(), tolerance) << name;
}

TEST(Bitmap, AgreesWithMitsubaInAllFileFormatsFiltersAndWrapModes) {
  const nlohmann::json all = references();
  const TemporaryFolder folder;
  for (const auto& [name, content] : all["files"].items())
    std::ofstream(folder.file(name), std::ios::binary) << test_support::decode_base64(content.get<std::string>());
  int compared = 0;
  for (const auto& expected : all["cases"]) {
    const std::string file = expected["file"];
    const std::string name = file + (expected["raw"].get<bool>() ? " raw " : " ") +
                             expected["filter_type"].get<std::string>() + " " +
                             expected["wrap_mode"].get<std::string>() + " " + expected["to_uv"].get<std::string>();
    const auto made = make_plugin<Texture>(texture_plugins(), "texture", "bitmap",
                                           {{"filename", folder.file(file)},
                                            {"raw", expected["raw"].get<bool>()},
                                            {"filter_type", expected["filter_type"].get<std::string>()},
                                            {"wrap_mode", expected["wrap_mode"].get<std::string>()},
                                            {"to_uv", to_uv(all["transforms"][expected["to_uv"].get<std::string>()])}});
    ASSERT_EQ(made.errors, "") << name;
    expect_lookups(*made.object, all["points"], expected, name);
    ++compared;
  }
  EXPECT_GE(compared, 100);
}

/// 5 x 3 texels with values 0 to 1, some black, so that the density has zeros.
TexelImage sample_image(int channels, bool bytes) {
  TexelImage image;
  image.width = 5, image.height = 3, image.channels = channels, image.srgb = bytes;
  for (int i = 0; i < 15 * channels; ++i) {
    const uint64_t random = mix64(1000 + i / channels == 1003 ? 0 : 77 + i);
    const uint8_t value = i / channels % 4 == 3 ? 0 : static_cast<uint8_t>(random >> 40);
    if (bytes)
      image.bytes.push_back(value);
    else
      image.floats.push_back(static_cast<float>(value) / 64);
  }
  return image;
}

UvTransform flip_and_turn() {
  return UvTransform(Transform(Matrix4{{{0, -1, 0, 1}, {1, 0, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}));
}

struct SamplingCase {
  WrapMode wrap;
  FilterType filter;
  int channels;
  bool bytes, turned;
};

class BitmapSampling : public testing::TestWithParam<SamplingCase> {
 protected:
  std::shared_ptr<Texture> texture() const {
    BitmapSettings settings;
    settings.wrap = GetParam().wrap, settings.filter = GetParam().filter;
    if (GetParam().turned) settings.to_uv = flip_and_turn();
    return make_bitmap_texture(sample_image(GetParam().channels, GetParam().bytes), settings);
  }
};

// N = 400 000, alpha = 5e-7: detects an rms error of 2.3 % of the density with power 0.99 (statistics/chi2.h).
TEST_P(BitmapSampling, PositionsFollowTheirDensity) {
  const auto t = texture();
  const auto sample = [&](const PathRandom& random) -> std::optional<Vec2> {
    return t->sample_position(random.get_2d(0, Event::kLightPosition)).uv;
  };
  const auto result =
      statistics::chi2_square(sample, [&](const Vec2& uv) { return t->pdf_position(uv); }, {.name = "bitmap"});
  EXPECT_TRUE(result.accepted) << result.message;
  // Planted bug: a density that tapers by 20 % across the texture.
  const auto wrong =
      statistics::chi2_square(sample, [&](const Vec2& uv) { return t->pdf_position(uv) * (1.1 - 0.2 * uv.x); },
                              {.name = "bitmap, planted", .n_samples = 100000});
  EXPECT_FALSE(wrong.accepted);
}

TEST_P(BitmapSampling, DensityIsProportionalToTheLuminance) {
  const auto t = texture();
  double ratio = 0;
  for (int i = 0; i < 2000; ++i) {
    const PathRandom random(Sampling::kIndependent, 3, 0, 0, i);
    const Texture::PositionSample position = t->sample_position(random.get_2d(0, Event::kLightPosition));
    ASSERT_GT(position.pdf, 0);
    ASSERT_NEAR(t->pdf_position(position.uv), position.pdf, 2e-4 * position.pdf + 1e-4);
    const double here = t->eval_1(hit_at(position.uv)) / position.pdf;
    if (position.pdf < 0.05) continue;  // the ratio of two small numbers is imprecise
    if (ratio == 0) ratio = here;
    ASSERT_NEAR(here, ratio, 1e-3 * ratio);
  }
  // The ratio is the mean over the unit square, which is the mean of the texels, since each covers the same area.
  EXPECT_NEAR(ratio, t->mean(), 1e-3 * ratio);
}

TEST_P(BitmapSampling, GradientIsTheSlopeOfTheValue) {
  const auto t = texture();
  if (GetParam().filter == FilterType::kNearest) {
    const Vec2 gradient = t->grad_1(hit_at({0.3f, 0.3f}));
    EXPECT_EQ(gradient, (Vec2{0, 0}));
    return;
  }
  for (const Vec2 uv : {Vec2{0.33f, 0.27f}, {0.02f, 0.98f}, {1.71f, -0.62f}, {-2.13f, 3.37f}}) {
    constexpr float kStep = 1e-3f;  // the value is bilinear: the central difference is exact inside a cell
    const float du = (t->eval_1(hit_at({uv.x + kStep, uv.y})) - t->eval_1(hit_at({uv.x - kStep, uv.y}))) / (2 * kStep);
    const float dv = (t->eval_1(hit_at({uv.x, uv.y + kStep})) - t->eval_1(hit_at({uv.x, uv.y - kStep}))) / (2 * kStep);
    const Vec2 gradient = t->grad_1(hit_at(uv));
    EXPECT_NEAR(gradient.x, du, 5e-3f) << uv.x << " " << uv.y;
    EXPECT_NEAR(gradient.y, dv, 5e-3f) << uv.x << " " << uv.y;
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, BitmapSampling,
                         testing::Values(SamplingCase{WrapMode::kRepeat, FilterType::kBilinear, 3, true, false},
                                         SamplingCase{WrapMode::kRepeat, FilterType::kBilinear, 1, false, true},
                                         SamplingCase{WrapMode::kMirror, FilterType::kBilinear, 3, false, false},
                                         SamplingCase{WrapMode::kClamp, FilterType::kBilinear, 1, true, true},
                                         SamplingCase{WrapMode::kRepeat, FilterType::kNearest, 3, false, true}));

TEST(Bitmap, SamplesUniformlyWhereTheTransformDoesNotKeepTheUnitSquare) {
  BitmapSettings settings;
  settings.to_uv = UvTransform(Transform::scale({2, 2, 1}));
  const auto t = make_bitmap_texture(sample_image(3, true), settings);
  const Texture::PositionSample position = t->sample_position({0.25f, 0.75f});
  EXPECT_EQ(position.uv, (Vec2{0.25f, 0.75f}));
  EXPECT_EQ(position.pdf, 1);
  EXPECT_EQ(t->pdf_position({0.1f, 0.2f}), 1);
}

TEST(Bitmap, SamplesUniformlyWhenBlack) {
  TexelImage image;
  image.width = 2, image.height = 2, image.channels = 1, image.floats = {0, 0, 0, 0};
  const auto t = make_bitmap_texture(image, {});
  EXPECT_EQ(t->sample_position({0.25f, 0.75f}).pdf, 1);
  EXPECT_EQ(t->pdf_position({0.25f, 0.75f}), 1);
}

TEST(Bitmap, LooksSomethingUpAtCoordinatesThatAreNotFinite) {
  for (const WrapMode wrap : {WrapMode::kRepeat, WrapMode::kMirror, WrapMode::kClamp}) {
    for (const FilterType filter : {FilterType::kBilinear, FilterType::kNearest}) {
      BitmapSettings settings;
      settings.wrap = wrap, settings.filter = filter;
      const auto t = make_bitmap_texture(sample_image(3, true), settings);
      for (const float bad : {kInfinity, -kInfinity, std::nanf(""), 1e30f, -1e30f, 16777217.0f})
        for (const Vec2 uv : {Vec2{bad, 0.5f}, Vec2{0.5f, bad}}) {
          const Spectrum value = t->eval(hit_at(uv));
          EXPECT_TRUE(value.r >= 0 && value.r <= 1) << bad;
          t->grad_1(hit_at(uv));
        }
    }
  }
}

TEST(Bitmap, ReportsWrongParameters) {
  const TemporaryFolder folder;
  const auto missing = make_plugin<Texture>(texture_plugins(), "texture", "bitmap", {});
  EXPECT_EQ(missing.object, nullptr);
  EXPECT_NE(missing.errors.find("test.xml:1:1: texture 'bitmap': the string 'filename' is missing"), std::string::npos)
      << missing.errors;
  std::ofstream(folder.file("a.png")) << "this is not an image";
  const auto made = make_plugin<Texture>(texture_plugins(), "texture", "bitmap",
                                         {{"filename", folder.file("a.png")},
                                          {"wrap_mode", std::string("repeated")},
                                          {"filter", std::string("bilinear")}});
  EXPECT_EQ(made.object, nullptr);
  EXPECT_NE(made.errors.find("test.xml:2:1: parameter 'filename' of texture 'bitmap' cannot be used: " +
                             folder.file("a.png") + ": "),
            std::string::npos)
      << made.errors;
  EXPECT_NE(made.errors.find(
                "test.xml:3:1: parameter 'wrap_mode' of texture 'bitmap' is 'repeated'; expected one of 'repeat', "
                "'mirror', 'clamp', 'black'; did you mean 'repeat'?"),
            std::string::npos)
      << made.errors;
  EXPECT_NE(made.errors.find("test.xml:4:1: unknown parameter 'filter' of texture 'bitmap'"), std::string::npos)
      << made.errors;
}

}  // namespace
}  // namespace covary
