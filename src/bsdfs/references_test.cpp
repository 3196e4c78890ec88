// SPDX-License-Identifier: Apache-2.0
// Value, density and delta samples of every model against Mitsuba 3; tests/references/make_bsdf_references.py describes
// the file.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>

#include "bsdfs/conductor_presets.h"
#include "support/make_bsdf.h"

namespace covary {
namespace {

using testing::Json;

const std::string kFolder = COVARY_SOURCE_DIR "/tests/references/";

const Json& references() {
  static const Json json = [] {
    std::ifstream file(kFolder + "bsdfs.json");
    return Json::parse(file);
  }();
  return json;
}

Vec3 vec3(const Json& a) { return {a.at(0).get<float>(), a.at(1).get<float>(), a.at(2).get<float>()}; }

/// "" or the largest disagreement in one case. `scale` multiplies our values, for the planted bug that must fail.
std::string disagreement(const Json& entry, float scale = 1) {
  std::map<std::string, TexturePtr> textures;
  Json dictionary = entry.at("bsdf");
  if (dictionary.contains("filename")) dictionary["filename"] = kFolder + dictionary["filename"].get<std::string>();
  if (entry.contains("gradient")) {
    const Json& g = entry.at("gradient");
    textures["bump"] = std::make_shared<testing::TestTexture>(Spectrum(0), Vec2{g.at(0), g.at(1)});
    dictionary["bump"] = {{"type", "bump"}};
  }
  const BsdfPtr bsdf = testing::make_bsdf(dictionary, textures);
  const double value_tolerance = entry.at("tolerance");
  const double density_tolerance = entry.value("density_tolerance", value_tolerance);
  const TransportMode mode = entry.value("importance", false) ? TransportMode::kImportance : TransportMode::kRadiance;
  Arena arena;
  double worst = 1;
  std::string text;
  const auto compare = [&](const std::string& what, double ours, double theirs, const Vec3& wo, const Vec3& wi) {
    const double tolerance = what.starts_with("density") ? density_tolerance : value_tolerance;
    const double error = std::abs(ours - theirs) / (tolerance * std::abs(theirs) + 2e-6);
    if (error <= worst) return;
    worst = error;
    text = std::string(entry.at("name")) + ": " + what + " is " + std::to_string(ours) + ", Mitsuba's " +
           std::to_string(theirs) + " at wo.z = " + std::to_string(wo.z) + ", wi = " + std::to_string(wi.x) + " " +
           std::to_string(wi.y) + " " + std::to_string(wi.z);
  };
  const Json& pairs = references().at("pairs");
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Vec3 wo = normalize(vec3(pairs[i][0])), wi = normalize(vec3(pairs[i][1]));
    arena.reset();
    const BsdfValue v = bsdf->bind(testing::flat_hit(), wo.z > 0, mode, arena)->eval(wo, wi);
    const Json row = entry.contains("values") ? entry.at("values").at(i) : Json(0);
    const bool zero = row.is_number();
    for (int c = 0; c < 3; ++c) compare("value", v.value[c] * scale, zero ? 0 : row.at(c).get<double>(), wo, wi);
    compare("density", v.pdf_solid_angle, zero ? 0 : row.at(3).get<double>(), wo, wi);
  }
  if (!entry.contains("samples")) return text;
  for (const Json& row : entry.at("samples")) {
    const Vec3 wo = normalize(vec3(row[0])), wi = vec3(row[2]);
    arena.reset();
    const BsdfSample s =
        bsdf->bind(testing::flat_hit(), wo.z > 0, mode, arena)->sample(wo, row[1].get<float>(), {0.3f, 0.6f});
    compare("density of the sample", s.pdf, row[4], wo, wi);
    if (!s.valid()) continue;
    for (int c = 0; c < 3; ++c) {
      compare("direction", s.wi[c], wi[c], wo, wi);
      compare("weight", s.weight[c] * scale, row[3][c], wo, wi);
    }
    compare("eta", s.eta, row[5], wo, wi);
  }
  return text;
}

TEST(BsdfReferences, AgreeWithMitsuba) {
  ASSERT_GT(references().at("cases").size(), 100u);
  for (const Json& entry : references().at("cases")) EXPECT_EQ(disagreement(entry), "");
}

// Planted bug: values 2 % too large are detected in every case that has values.
TEST(BsdfReferences, SeeTwoPercent) {
  for (const Json& entry : references().at("cases")) EXPECT_NE(disagreement(entry, 1.02f), "") << entry.at("name");
}

TEST(BsdfReferences, CoverEveryModel) {
  std::set<std::string> covered;
  const std::function<void(const Json&)> visit = [&](const Json& dictionary) {
    covered.insert(dictionary.at("type").get<std::string>());
    for (const auto& [name, value] : dictionary.items())
      if (value.is_object()) visit(value);
  };
  for (const Json& entry : references().at("cases")) visit(entry.at("bsdf"));
  // Those of principled_test.cpp have a file of their own; Mitsuba 3 has none of the others.
  covered.insert({"principled", "principledthin", "metallicroughness", "difftrans", "phong", "ward", "coating",
                  "roughcoating"});
  for (const Plugin<Bsdf>& plugin : bsdf_plugins()) EXPECT_TRUE(covered.count(plugin.name)) << plugin.name;
}

TEST(BsdfReferences, NamedConductorsAgreeWithMitsuba) {
  const Json& expected = references().at("conductors_at_45_degrees");
  ASSERT_EQ(expected.size(), conductor_preset_names().size());
  const float c = std::sqrt(0.5f);
  for (const auto& [name, colour] : expected.items()) {
    const BsdfPtr bsdf = testing::make_bsdf({{"type", "conductor"}, {"material", name}});
    Arena arena;
    const BsdfSample s =
        bsdf->bind(testing::flat_hit(), true, TransportMode::kRadiance, arena)->sample({c, 0, c}, 0.5f, {0.5f, 0.5f});
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(s.weight[i], colour[i].get<float>(), 1e-4f) << name;
  }
}

}  // namespace
}  // namespace covary
