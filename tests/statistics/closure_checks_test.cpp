// SPDX-License-Identifier: Apache-2.0
// check_closure() on a BSDF with a diffuse, a mirror and a null lobe: accepts it if correct, names each planted bug.
#include "statistics/closure_checks.h"

#include <gtest/gtest.h>

#include "core/warp.h"

namespace covary::statistics {
namespace {

enum class Bug {
  kNone,
  kPdfInEval,
  kPdfEverywhere,
  kDroppedCosine,
  kReusedNumber,
  kWeight,
  kPmfSum,
  kDeltaPmf,
  kDeltaChoice,
  kFlags,
  kWrongSide,
  kLobeIndex,
};

/// 50 % diffuse with albedo 0.8, 30 % mirror, 20 % null transmission.
class TestClosure final : public BsdfClosure {
 public:
  explicit TestClosure(Bug bug) : bug_(bug) {}
  uint32_t flags() const override {
    return kDiffuseReflection | kDeltaReflection | (bug_ == Bug::kFlags ? 0u : uint32_t{kNullTransmission});
  }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    const float f = bug_ == Bug::kPdfInEval ? 1.02f : 1.0f;
    return {Spectrum(0.8f) * (0.5f * cosine(wo, wi)), f * 0.5f * diffuse_pdf(wo, wi)};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    if (bug_ == Bug::kReusedNumber) u_lobe = u.y;
    if (u_lobe < (bug_ == Bug::kDeltaChoice ? 0.33f : 0.3f))
      return {.wi = reflect(wo), .weight = Spectrum(1), .pdf = 0.3f, .flags = kDeltaReflection, .lobe = 1};
    if (u_lobe < 0.5f)
      return {.wi = -wo,
              .weight = Spectrum(1),
              .pdf = bug_ == Bug::kDeltaPmf ? 0.3f : 0.2f,
              .flags = kNullTransmission,
              .lobe = 2};
    Vec3 wi = warp::square_to_cosine_hemisphere(u);
    if (wo.z < 0) wi.z = -wi.z;
    const float pdf = 0.5f * diffuse_pdf(wo, wi);
    if (bug_ == Bug::kWrongSide) wi.z = -wi.z;
    return {.wi = wi,
            .weight = Spectrum(0.4f * cosine(wo, wi) / pdf * (bug_ == Bug::kWeight ? 1.05f : 1)),
            .pdf = pdf,
            .flags = kDiffuseReflection,
            .lobe = bug_ == Bug::kLobeIndex ? 3u : 0u};
  }
  int n_lobes() const override { return 3; }
  void lobe_pmfs(const Vec3&, float* pmfs) const override {
    pmfs[0] = bug_ == Bug::kPmfSum ? 0.6f : 0.5f, pmfs[1] = 0.3f, pmfs[2] = 0.2f;
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    pdfs[0] = diffuse_pdf(wo, wi), pdfs[1] = pdfs[2] = 0;
  }

 private:
  float cosine(const Vec3& wo, const Vec3& wi) const {
    return wo.z * wi.z > 0 ? warp::cosine_hemisphere_pdf_solid_angle(std::abs(wi.z)) : 0;
  }
  float diffuse_pdf(const Vec3& wo, const Vec3& wi) const {
    if (bug_ == Bug::kDroppedCosine) return wo.z * wi.z > 0 ? 1 / kTwoPi : 0;
    return cosine(wo, wi) * (bug_ == Bug::kPdfEverywhere ? 1.02f : 1);
  }
  Bug bug_;
};

std::string check(Bug bug, const Vec3& wo = normalize({0.3f, 0.2f, 0.7f})) {
  return join(check_closure(TestClosure(bug), wo, {.name = "planted", .n_samples = 100000, .n_cells = 64}));
}

TEST(CheckClosure, AcceptsARightClosure) {
  EXPECT_EQ(check(Bug::kNone), "");
  EXPECT_EQ(check(Bug::kNone, normalize({0.3f, 0.2f, -0.7f})), "");
}

// N = 100 000, alpha = 5e-7: the smallest error in a delta lobe's probability of 0.3 detected with power 0.99 is 0.011.
TEST(CheckClosure, NamesPlantedBugs) {
  const auto names = [](Bug bug, const std::string& part) {
    const std::string message = check(bug);
    EXPECT_NE(message.find(part), std::string::npos) << "expected '" << part << "' in '" << message << "'";
  };
  names(Bug::kPdfInEval, "eval gives density");
  names(Bug::kPdfEverywhere, "the density integrates to");
  names(Bug::kDroppedCosine, "samples and density differ");
  names(Bug::kReusedNumber, "samples and density differ");
  names(Bug::kWeight, "value / density is");
  names(Bug::kPmfSum, "the lobes' probabilities sum to 1.1");
  names(Bug::kDeltaPmf, "a delta sample's pdf is not its pmf");
  names(Bug::kDeltaChoice, "(delta lobe 1)");
  names(Bug::kFlags, "the lobe's flags are not the closure's");
  names(Bug::kWrongSide, "a reflection crosses the surface");
  names(Bug::kLobeIndex, "the lobe's index is out of range");
}

TEST(CheckClosure, AlbedosAgree) {
  const Vec3 wo = normalize({0.3f, 0.2f, 0.7f});
  EXPECT_NEAR(smooth_albedo(TestClosure(Bug::kNone), wo).g, 0.4f, 1e-4f);
  double variance = 0;
  const Spectrum sampled = sampled_albedo(TestClosure(Bug::kNone), wo, 100000, 1, &variance);
  const TestResult result = z_test(sampled.g, variance, 0.9);  // delta lobes included
  EXPECT_TRUE(result.accepted) << result.message;
  EXPECT_FALSE(z_test(sampled.g, variance, 0.92).accepted);
}

}  // namespace
}  // namespace covary::statistics
