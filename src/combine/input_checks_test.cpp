// SPDX-License-Identifier: Apache-2.0
// The checks detect each planted fault, and none in good images. Seeds are fixed. With N pairs of T = 12 groups, a mean
// rank correlation has standard error 1 / sqrt(11 N) = 0.0045 for 80 x 60 pixels; planted faults are at least 20 times
// that, and the false-alarm limit max(0.05, 5 standard errors) is 11 times that.
#include "combine/input_checks.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "estimators/examine_inputs.h"
#include "estimators/test_images.h"

namespace covary::input_checks_test {
namespace {

constexpr int kWidth = 80, kHeight = 60, kGroups = 12;

test::Grouped good_crn() { return test::crn_image(kWidth, kHeight, kGroups, 1); }
test::Grouped good_independent() { return test::independent_image(kWidth, kHeight, kGroups, 2); }

/// All findings, errors marked "!", warnings "?".
std::string findings(const test::Grouped& crn, const test::Grouped& independent) {
  std::string text;
  for (const Finding& f : examine_inputs(crn.view(), independent.view()).findings) {
    if (f.severity == Finding::Severity::kError) text += '!';
    if (f.severity == Finding::Severity::kWarning) text += '?';
    text += f.text;
    text += '\n';
  }
  return text;
}

/// Convolution with a horizontal filter (w, 1 - 2 w, w), like a wide pixel filter.
test::Grouped filtered(const test::Grouped& image, float w) {
  test::Grouped result = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 1; x + 1 < image.width; ++x)
      for (int i = 0; i < 3 * image.groups; ++i) {
        const auto at = [&](int qx) { return image.view().pixel(qx, y)[i]; };
        result.pixel(x, y)[i] = w * at(x - 1) + (1 - 2 * w) * at(x) + w * at(x + 1);
      }
  return result;
}

TEST(InputChecks, GoodImagesPass) {
  const test::Grouped crn = good_crn(), independent = good_independent();
  const InputReport r = examine_inputs(crn.view(), independent.view());
  EXPECT_TRUE(r.findings.empty()) << r.findings[0].text;
  EXPECT_GT(r.crn_horizontal.value, 0.8);
  EXPECT_NEAR(r.independent_horizontal.value, 0, 5 * r.independent_horizontal.standard_error);
  EXPECT_NEAR(r.independent_vertical.value, 0, 5 * r.independent_vertical.standard_error);
  EXPECT_NEAR(r.crn_independent.value, 0, 5 * r.crn_independent.standard_error);
}

TEST(InputChecks, FindsWidePixelFilters) {
  // Mixing in 10 % of both neighbours gives correlation 2 * 0.1 * 0.8 / (0.8^2 + 2 * 0.1^2) = 0.24, like a tent filter.
  const std::string text = findings(good_crn(), filtered(good_independent(), 0.1f));
  EXPECT_NE(text.find("!independent image: errors of neighbouring pixels have a rank correlation of +0.2"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("<rfilter type=\"box\"/>"), std::string::npos) << text;
  EXPECT_NE(text.find("scene.cycles.pixel_filter_type = 'BOX'"), std::string::npos) << text;
}

TEST(InputChecks, FindsBlueNoise) {
  const std::string text = findings(good_crn(), filtered(good_independent(), -0.06f));
  EXPECT_NE(text.find("!independent image: errors of neighbouring pixels have a rank correlation of -0.1"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("blue noise"), std::string::npos) << text;
}

TEST(InputChecks, FindsSwappedAndNotCommonImages) {
  const std::string swapped = findings(good_independent(), good_crn());
  EXPECT_NE(swapped.find("are CRN and independent image swapped?"), std::string::npos) << swapped;
  const std::string independent = findings(test::independent_image(kWidth, kHeight, kGroups, 9), good_independent());
  EXPECT_NE(independent.find("!CRN image: errors of neighbouring pixels have a rank correlation of only"),
            std::string::npos);
  EXPECT_NE(independent.find("scrambling_distance = 0"), std::string::npos);
  EXPECT_NE(independent.find("'PROGRESSIVE_MULTI_JITTER' before 3.5"), std::string::npos);
}

TEST(InputChecks, FindsImagesThatShareRandomNumbers) {
  const test::Grouped crn = good_crn();
  test::Grouped independent = good_independent();
  for (size_t i = 0; i < independent.data.size(); ++i)
    independent.data[i] = 0.8f * independent.data[i] + 0.2f * crn.data[i];
  EXPECT_NE(findings(crn, independent)
                .find("!CRN image and independent image: errors of the same pixel in both images have a rank "
                      "correlation of +0."),
            std::string::npos);
}

TEST(InputChecks, FindsBadValues) {
  const test::Grouped crn = good_crn();
  test::Grouped independent = good_independent();
  independent.pixel(7, 5)[4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(
      findings(crn, independent)
          .find("?independent image: 1 of 4800 pixels hold NaN, infinite or overflowing values, the first at (7, 5) in "
                "render 2; these values are left out"),
      std::string::npos);
  // More than 1 % of the pixels: an error.
  for (int x = 0; x < 49; ++x) independent.pixel(x, 5)[4] = 1e30f;
  const std::string many = findings(crn, independent);
  EXPECT_NE(many.find("!independent image: 49 of 4800 pixels hold NaN"), std::string::npos);
  EXPECT_NE(many.find("in render 2; these are too many to be left out; find"), std::string::npos) << many;
  independent = good_independent();
  independent.pixel(7, 5)[4] = -0.1f;
  EXPECT_NE(findings(crn, independent)
                .find("?independent image: 1 of 4800 pixels hold negative values; spectral "
                      "renderers make them of colours that sRGB does not have, which is right"),
            std::string::npos);
  test::Grouped black = crn;
  std::fill(black.data.begin(), black.data.end(), 0.0f);
  EXPECT_NE(findings(black, black).find("?both images are black; files that Mitsuba's integrator aov makes"),
            std::string::npos);
  EXPECT_EQ(findings(crn, good_independent()).find("black"), std::string::npos);
  independent = good_independent();
  for (int x = 0; x < 20; ++x) std::fill_n(independent.pixel(x, 3), 36, 1.0f);
  EXPECT_EQ(findings(crn, independent).find("exactly 1"), std::string::npos) << "others are brighter";
  for (float& value : independent.data) value = std::min(value, 0.9f);
  for (int x = 0; x < 20; ++x) std::fill_n(independent.pixel(x, 3), 36, 1.0f);
  EXPECT_EQ(findings(crn, independent).find("exactly 1"), std::string::npos) << "a white background";
  for (int x = 30; x < 32; ++x) std::fill_n(independent.pixel(x, 3), 18, 1.0f);
  EXPECT_NE(findings(crn, independent).find("!independent image: 20 of 4800 pixels are exactly 1 in all renders"),
            std::string::npos);
}

TEST(InputChecks, FindsOtherScenes) {
  const test::Grouped crn = good_crn();
  test::Grouped independent = good_independent();
  for (float& v : independent.data) v *= 3;
  EXPECT_NE(findings(crn, independent).find("do not show the same scene"), std::string::npos);
}

TEST(InputChecks, BandsGiveTheSameFindings) {
  const test::Grouped crn = good_crn();
  test::Grouped independent = filtered(good_independent(), 0.1f);
  independent.pixel(7, 45)[4] = std::numeric_limits<float>::infinity();
  InputChecks checks(kWidth, kHeight, kGroups, kGroups);
  for (int y = 0; y < kHeight; y += 25) {
    const int rows = std::min(25, kHeight - y);
    checks.add_rows({kWidth, rows, kGroups, crn.view().pixel(0, y)},
                    {kWidth, rows, kGroups, independent.view().pixel(0, y)});
  }
  const InputReport bands = checks.report(), whole = examine_inputs(crn.view(), independent.view());
  EXPECT_EQ(bands.findings[0].text, whole.findings[0].text);
  EXPECT_NE(bands.findings[0].text.find("(7, 45) in render 2"), std::string::npos);
  EXPECT_NEAR(bands.independent_horizontal.value, whole.independent_horizontal.value, 1e-12);
  EXPECT_NEAR(bands.independent_vertical.value, whole.independent_vertical.value,
              5 * whole.independent_vertical.standard_error);
  EXPECT_NEAR(bands.crn_mean, whole.crn_mean, 1e-12);
}

TEST(InputChecks, SaysWhatItCannotCheck) {
  const test::Grouped crn = good_crn(), one = test::independent_image(kWidth, kHeight, 1, 2);
  EXPECT_EQ(findings(crn, one),
            "?independent image: with 1 group it cannot be checked whether its pixels are independent; 12 are "
            "recommended\n");
  const test::Grouped flat = test::constant_image(8, 8, 12, 0.5f);
  EXPECT_EQ(findings(flat, flat),
            "independent image: only 0 pairs of pixels with noise; correlations are hardly tested\n");
  EXPECT_THROW(examine_inputs(crn.view(), flat.view()), Error);
}

}  // namespace
}  // namespace covary::input_checks_test
