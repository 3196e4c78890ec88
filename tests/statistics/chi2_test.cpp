// SPDX-License-Identifier: Apache-2.0
// The chi-square tests must accept correct samplers, reject wrong ones, and give uniform p-values.
#include "statistics/chi2.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <vector>

#include "core/warp.h"

namespace covary::statistics {
namespace {

std::optional<Vec3> cosine_sample(const PathRandom& random) {
  return warp::square_to_cosine_hemisphere(random.get_2d(0, Event::kDirection));
}
double cosine_pdf(const Vec3& w) { return warp::cosine_hemisphere_pdf_solid_angle(w.z); }

TEST(Chi2Sphere, AcceptsRightSamplers) {
  EXPECT_TRUE(chi2_sphere(cosine_sample, cosine_pdf).accepted);
  const Chi2Result failing = chi2_sphere(  // a third fails on purpose; the density has mass 2/3
      [](const PathRandom& random) {
        return random.get_1d(0, Event::kLobe) < 1.0f / 3 ? std::nullopt : cosine_sample(random);
      },
      [](const Vec3& w) { return cosine_pdf(w) * 2 / 3; });
  EXPECT_TRUE(failing.accepted) << failing.message;
  EXPECT_NEAR(failing.mass, 2.0 / 3, 1e-4);
}

TEST(Chi2Sphere, AcceptsVeryNarrowLobes) {
  for (const float one_minus_cos : {1e-7f, 1e-4f, 0.3f}) {  // cones: their edge is a discontinuity inside cells
    const Chi2Result result = chi2_sphere(
        [&](const PathRandom& random) {
          return std::optional(warp::square_to_cone(random.get_2d(0, Event::kDirection), one_minus_cos));
        },
        [&](const Vec3& w) {
          const double one_minus_z = (double(w.x) * w.x + double(w.y) * w.y) / (1 + std::abs(w.z));
          return w.z > 0 && one_minus_z < one_minus_cos ? warp::cone_pdf_solid_angle(one_minus_cos) : 0.0;
        });
    EXPECT_TRUE(result.accepted) << one_minus_cos << " " << result.message;
  }
}

// Planted bugs, N = 400 000 and alpha = 5e-7 as in chi2.h; each is far above the smallest detectable error.
TEST(Chi2Sphere, RejectsPlantedBugs) {
  const auto rejected = [](const char* name, const Sampler<Vec3>& sample, const Density<Vec3>& pdf) {
    const Chi2Result result = chi2_sphere(sample, pdf, {.name = name});
    EXPECT_FALSE(result.accepted) << result.message;
    return result.message;
  };
  EXPECT_NE(rejected("density * 1.02", cosine_sample, [](const Vec3& w) { return cosine_pdf(w) * 1.02; })
                .find("the density integrates to 1.02000, but 1.00000 of the samples succeed"),
            std::string::npos);
  rejected(
      "density * 1.02 where a third fails",
      [](const PathRandom& random) {
        return random.get_1d(0, Event::kLobe) < 1.0f / 3 ? std::nullopt : cosine_sample(random);
      },
      [](const Vec3& w) { return cosine_pdf(w) * 1.02 * 2 / 3; });
  rejected("dropped cosine", cosine_sample, [](const Vec3& w) { return w.z > 0 ? 1 / kTwoPi : 0.0; });
  // The random number that flips half of the samples to the lower hemisphere also chooses the azimuth.
  const Density<Vec3> two_sided = [](const Vec3& w) {
    return 0.5 * warp::cosine_hemisphere_pdf_solid_angle(std::abs(w.z));
  };
  const auto flipped = [](Vec2 u, float choice) {
    const Vec3 w = warp::square_to_cosine_hemisphere(u);
    return std::optional(choice < 0.5f ? w : -w);
  };
  const Chi2Result independent = chi2_sphere(
      [&](const PathRandom& r) { return flipped(r.get_2d(0, Event::kDirection), r.get_1d(0, Event::kLobe)); },
      two_sided);
  EXPECT_TRUE(independent.accepted) << independent.message;
  rejected(
      "one number for choice and sample",
      [&](const PathRandom& r) { return flipped(r.get_2d(0, Event::kDirection), r.get_2d(0, Event::kDirection).x); },
      two_sided);
  EXPECT_NE(rejected(
                "samples below the horizon",
                [](const PathRandom& r) { return std::optional(warp::square_to_sphere(r.get_2d(0, Event::kPixel))); },
                [](const Vec3& w) { return w.z > 0 ? 1 / kTwoPi : 0.0; })
                .find("samples fall where the density is zero"),
            std::string::npos);
  rejected("not finite", cosine_sample, [](const Vec3& w) { return w.z > 0.999 ? std::nan("") : cosine_pdf(w); });
}

// p-values of 60 seeds, N = 40 000 each: a Kolmogorov-Smirnov test at alpha = 1e-6 detects a deviation of 0.5 in their
// distribution function with power 0.99. Planted bug: a density tilted by up to 6 %, less than a single run reliably
// rejects.
TEST(Chi2Sphere, PValuesAreUniformUnderTheHypothesisOnly) {
  for (const double tilt : {0.0, 0.06}) {
    std::vector<double> p_values;
    for (int seed = 0; seed < 60; ++seed)
      p_values.push_back(chi2_sphere(cosine_sample, [&](const Vec3& w) { return cosine_pdf(w) * (1 + tilt * w.x); },
                                     {.n_samples = 40000, .n_cells = 32, .seed = 100u + seed, .alpha = 0})
                             .p_value);
    if (tilt == 0)
      EXPECT_GT(uniform_p_value(p_values), 1e-6);
    else
      EXPECT_LT(uniform_p_value(p_values), 1e-6);
  }
}

TEST(Chi2Square, AcceptsAndRejects) {
  // Density 2x, sampled by a square root; planted bug: the root is omitted.
  const Density<Vec2> pdf = [](const Vec2& p) { return 2 * p.x; };
  const Chi2Result right = chi2_square(
      [](const PathRandom& r) {
        const Vec2 u = r.get_2d(0, Event::kPixel);
        return std::optional(Vec2{std::sqrt(u.x), u.y});
      },
      pdf);
  EXPECT_TRUE(right.accepted) << right.message;
  const Chi2Result wrong =
      chi2_square([](const PathRandom& r) { return std::optional(r.get_2d(0, Event::kPixel)); }, pdf);
  EXPECT_FALSE(wrong.accepted);
}

TEST(Chi2Discrete, PoolsSmallCellsAndRejectsImpossibleOnes) {
  const std::vector<double> probabilities{0.6, 0.39997, 1e-5, 1e-5, 1e-5, 0};
  const std::vector<double> likely{60020, 39977, 1, 2, 0, 0}, impossible{60020, 39976, 1, 2, 0, 1};
  const Chi2Result right = chi2_discrete(likely, probabilities);
  EXPECT_TRUE(right.accepted) << right.message;
  EXPECT_EQ(right.dof, 1);
  EXPECT_FALSE(chi2_discrete(impossible, probabilities).accepted);
  const std::vector<double> biased{61000, 38997, 1, 2, 0, 0};
  EXPECT_FALSE(chi2_discrete(biased, probabilities).accepted);
}

TEST(Chi2, AFailureLeavesATableAndAScript) {
  const Chi2Result result = chi2_square([](const PathRandom& r) { return std::optional(r.get_2d(0, Event::kPixel)); },
                                        [](const Vec2& p) { return 2 * p.x; }, {.name = "forgotten root"});
  ASSERT_FALSE(result.accepted);
  EXPECT_NE(result.message.find("(most in cell "), std::string::npos) << result.message;
  std::smatch match;
  ASSERT_TRUE(std::regex_search(result.message, match, std::regex("table: (.*)\\n  plot:  python3 (.*)")))
      << result.message;
  std::ifstream table(match[1].str());
  std::string line;
  ASSERT_TRUE(std::getline(table, line)) << match[1];
  EXPECT_EQ(line, "cell,x0,x1,y0,y1,observed,expected");
  double observed = 0, expected = 0;
  while (std::getline(table, line)) {
    std::stringstream row(line);
    std::string field;
    for (int i = 0; std::getline(row, field, ','); ++i) {
      if (i == 5) observed += std::stod(field);
      if (i == 6) expected += std::stod(field);
    }
  }
  EXPECT_EQ(observed, 400000);
  EXPECT_NEAR(expected, 400000, 1);
  EXPECT_TRUE(std::filesystem::exists(match[2].str()));
}

TEST(Quadrature, IntegratesSmoothAndDiscontinuousFunctions) {
  EXPECT_NEAR(integrate_sphere(cosine_pdf), 1, 1e-6);
  EXPECT_NEAR(integrate_sphere([](const Vec3& w) { return w.x > 0.3 ? 1.0 : 0.0; }), kTwoPi * 0.7, 1e-3);
  EXPECT_NEAR(integrate_square([](const Vec2& p) { return p.x * p.x * p.y; }), 1.0 / 6, 1e-9);
}

}  // namespace
}  // namespace covary::statistics
