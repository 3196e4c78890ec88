// SPDX-License-Identifier: Apache-2.0
#include "sampling/guiding_field.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <limits>

#include "core/error.h"
#include "core/random.h"

namespace covary {
namespace {

/// Light from +x for x < 0, and from +y elsewhere.
std::vector<GuidingSample> two_rooms(size_t n, uint64_t seed = 1) {
  std::vector<GuidingSample> samples;
  for (size_t i = 0; i < n; ++i) {
    const PathRandom random(Sampling::kIndependent, seed, 0, 0, i);
    const Vec2 u = random.get_2d(0, Event::kLens);
    const Vec3 p = {2 * u.x - 1, u.y, 0.1f * random.get_1d(0, Event::kLobe)};
    const Vmf lobe{p.x < 0 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}, 200};
    const Vec3 w = vmf::sample(lobe, random.get_2d(0, Event::kGuide));
    samples.push_back({.position = p, .direction = w, .weight = 1, .pdf = vmf::pdf(lobe, w)});
    samples.back().outgoing = p.x < 0 ? 0.5f : (i % 2 ? 6.0f : 0.0f);
  }
  return samples;
}

GuidingField trained(const std::vector<GuidingSample>& samples, const GuidingSettings& settings = {}) {
  GuidingField field(settings);
  field.add(samples);
  field.update();
  return field;
}

TEST(GuidingField, LeavesAreSplitByTheirSamples) {
  GuidingSettings settings;
  settings.leaf_samples = 2000;
  const GuidingField field = trained(two_rooms(20000), settings);
  EXPECT_GE(field.n_leaves(), 10u);
  EXPECT_LE(field.n_leaves(), 40u);
  const auto density = [&](const Vec3& p, const Vec3& w) { return field.leaf(field.find(p)).mixture.at(p).pdf(w); };
  EXPECT_GT(density({-0.5f, 0.5f, 0}, {1, 0, 0}), 10);
  EXPECT_LT(density({-0.5f, 0.5f, 0}, {0, 1, 0}), 0.1);
  EXPECT_GT(density({0.5f, 0.5f, 0}, {0, 1, 0}), 10);
  EXPECT_NE(field.find({1e30f, -1e30f, 0}), GuidingField::kNone);  // every point is in a leaf
  GuidingField frozen = field;
  frozen.freeze();
  EXPECT_LE(frozen.bytes(), field.n_leaves() * 1536);  // 2 KiB with the coefficients of a control
}

TEST(GuidingField, NothingIsFoundBeforeTheFirstUpdate) {
  GuidingField field;
  EXPECT_EQ(field.find({0, 0, 0}), GuidingField::kNone);
  field.update();
  EXPECT_EQ(field.find({0, 0, 0}), GuidingField::kNone);
}

TEST(GuidingField, ALeafOfFewSamplesOrWithoutLightDoesNotGuide) {
  std::vector<GuidingSample> samples = two_rooms(99);
  EXPECT_EQ(trained(samples).leaf(0).mixture.lobes.n, 0);
  samples = two_rooms(200);
  EXPECT_GT(trained(samples).leaf(0).mixture.lobes.n, 0);
  for (GuidingSample& s : samples) s.weight = 0;
  EXPECT_EQ(trained(samples).leaf(0).mixture.lobes.n, 0);
}

TEST(GuidingField, LeavesKnowTheMeanRadianceThatTheirSurfacesSend) {
  const GuidingField field = trained(two_rooms(40000));
  EXPECT_FLOAT_EQ(field.leaf(field.find({-0.9f, 0.5f, 0})).outgoing, 0.5f);
  // n > 2000 values of variance 9: 5 standard errors.
  EXPECT_NEAR(field.leaf(field.find({0.9f, 0.5f, 0})).outgoing, 3, 0.35);
  EXPECT_EQ(trained(two_rooms(99)).leaf(0).outgoing, 0);  // too few samples
}

TEST(GuidingField, SamplesAtOnePointAreOneLeaf) {
  std::vector<GuidingSample> samples = two_rooms(5000);
  for (GuidingSample& s : samples) s.position = {1e-3f, 7, 1e5f};
  GuidingSettings settings;
  settings.leaf_samples = 100;
  const GuidingField field = trained(samples, settings);
  EXPECT_EQ(field.n_leaves(), 1u);
  EXPECT_GT(field.leaf(0).mixture.lobes.n, 0);
}

TEST(GuidingField, LeavesOutWhatIsNoSample) {
  std::vector<GuidingSample> samples = two_rooms(1000);
  const GuidingField clean = trained(samples);
  const float nan = std::nanf(""), infinity = std::numeric_limits<float>::infinity();
  GuidingSample bad = samples[0];
  const auto add = [&](auto change) {
    GuidingSample s = bad;
    change(s);
    samples.push_back(s);
  };
  add([&](GuidingSample& s) { s.weight = nan; });
  add([&](GuidingSample& s) { s.weight = infinity; });
  add([&](GuidingSample& s) { s.weight = -1; });
  add([&](GuidingSample& s) { s.pdf = 0; });
  add([&](GuidingSample& s) { s.pdf = infinity; });
  add([&](GuidingSample& s) { s.direction.y = nan; });
  add([&](GuidingSample& s) { s.position.x = infinity; });
  add([&](GuidingSample& s) { s.inverse_distance = nan; });
  add([&](GuidingSample& s) { s.outgoing = nan; });
  add([&](GuidingSample& s) { s.outgoing = -1; });
  const GuidingField field = trained(samples);
  EXPECT_EQ(field.n_rejected(), 10u);
  EXPECT_EQ(field.hash(), clean.hash());
}

TEST(GuidingField, KeepsALimitedNumberOfSamplesEvenly) {
  GuidingSettings settings;
  settings.max_samples = 4096;
  GuidingField field(settings);
  const std::vector<GuidingSample> samples = two_rooms(30000);
  for (size_t i = 0; i < samples.size(); i += 1000) field.add(std::span(samples).subspan(i, 1000));
  EXPECT_EQ(field.n_samples(), 30000u);
  EXPECT_LE(field.bytes(), 2 * 4096 * sizeof(GuidingSample));
  field.update();
  const Vec3 left = {-0.5f, 0.5f, 0}, right = {0.5f, 0.5f, 0};
  const VmfLobes seen = field.leaf(field.find(left)).mixture.at(left);
  EXPECT_NEAR(seen.pdf({1, 0, 0}) / field.leaf(field.find(right)).mixture.at(right).pdf({0, 1, 0}), 1, 0.3);
}

TEST(GuidingField, SameBitsForAnyNumberOfThreads) {
  GuidingSettings settings;
  settings.leaf_samples = 1000;
  std::vector<uint64_t> hashes;
  for (const size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    GuidingField field = trained(two_rooms(10000), settings);
    field.add(two_rooms(10000, 2));
    field.update();
    field.freeze();
    hashes.push_back(field.hash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
  EXPECT_NE(hashes[0], trained(two_rooms(10000, 3), settings).hash());
}

TEST(GuidingField, BytesComeBackAndDamageIsFound) {
  GuidingSettings settings;
  settings.leaf_samples = 1000;
  const GuidingField field = trained(two_rooms(10000), settings);
  const std::string body = field.body();
  const GuidingField read = GuidingField::from_body(body, "a.training");
  EXPECT_EQ(read.body(), body);
  const Vec3 p = {0.3f, 0.3f, 0.05f};
  EXPECT_EQ(read.leaf(read.find(p)).mixture.at(p).pdf({0, 1, 0}),
            field.leaf(field.find(p)).mixture.at(p).pdf({0, 1, 0}));
  for (const std::string& damaged :
       {body.substr(0, body.size() / 2), body + "x", std::string(), std::string(8, '\xff')})
    EXPECT_THROW(GuidingField::from_body(damaged, "a.training"), Error);
}

}  // namespace
}  // namespace covary
