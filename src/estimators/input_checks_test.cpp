// SPDX-License-Identifier: Apache-2.0
// The checks find each planted fault and none in good images. Seeds are fixed. With N pairs of T = 12 groups a mean rank
// correlation has standard error 1 / sqrt(11 N) = 0.0045 for 80 x 60 pixels; faults planted are 20 and more of them, and
// the false-alarm limit max(0.05, 5 standard errors) is 11.
#include "estimators/input_checks.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "estimators/test_images.h"

namespace covary {
namespace {

constexpr int kWidth = 80, kHeight = 60, kGroups = 12;

test::Grouped good_crn() { return test::crn_image(kWidth, kHeight, kGroups, 1); }
test::Grouped good_pt() { return test::pt_image(kWidth, kHeight, kGroups, 2); }

/// All findings, errors marked "!", warnings "?".
std::string findings(const test::Grouped& crn, const test::Grouped& pt) {
  std::string text;
  for (const Finding& f : examine_inputs(crn.view(), pt.view()).findings) {
    if (f.severity == Finding::Severity::kError) text += '!';
    if (f.severity == Finding::Severity::kWarning) text += '?';
    text += f.text;
    text += '\n';
  }
  return text;
}

/// Convolution with a horizontal filter (w, 1 - 2 w, w), as a wide pixel filter does it.
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
  const test::Grouped crn = good_crn(), pt = good_pt();
  const InputReport r = examine_inputs(crn.view(), pt.view());
  EXPECT_TRUE(r.findings.empty()) << r.findings[0].text;
  EXPECT_GT(r.crn_horizontal.value, 0.8);
  EXPECT_NEAR(r.pt_horizontal.value, 0, 5 * r.pt_horizontal.standard_error);
  EXPECT_NEAR(r.pt_vertical.value, 0, 5 * r.pt_vertical.standard_error);
  EXPECT_NEAR(r.crn_pt.value, 0, 5 * r.crn_pt.standard_error);
}

TEST(InputChecks, FindsWidePixelFilters) {
  // Mixing in 10 % of both neighbours correlates by 2 * 0.1 * 0.8 / (0.8^2 + 2 * 0.1^2) = 0.24, as a tent filter does.
  const std::string text = findings(good_crn(), filtered(good_pt(), 0.1f));
  EXPECT_NE(text.find("!PT: errors of neighbouring pixels have a rank correlation of +0.2"), std::string::npos) << text;
  EXPECT_NE(text.find("<rfilter type=\"box\"/>"), std::string::npos) << text;
  EXPECT_NE(text.find("scene.cycles.pixel_filter_type = 'BOX'"), std::string::npos) << text;
}

TEST(InputChecks, FindsBlueNoise) {
  const std::string text = findings(good_crn(), filtered(good_pt(), -0.06f));
  EXPECT_NE(text.find("!PT: errors of neighbouring pixels have a rank correlation of -0.1"), std::string::npos) << text;
  EXPECT_NE(text.find("blue noise"), std::string::npos) << text;
}

TEST(InputChecks, FindsSwappedAndNotCommonImages) {
  const std::string swapped = findings(good_pt(), good_crn());
  EXPECT_NE(swapped.find("are CRN and PT swapped?"), std::string::npos) << swapped;
  const std::string independent = findings(test::pt_image(kWidth, kHeight, kGroups, 9), good_pt());
  EXPECT_NE(independent.find("!CRN: errors of neighbouring pixels have a rank correlation of only"), std::string::npos);
  EXPECT_NE(independent.find("scrambling_distance = 0"), std::string::npos);
}

TEST(InputChecks, FindsImagesThatShareRandomNumbers) {
  const test::Grouped crn = good_crn();
  test::Grouped pt = good_pt();
  for (size_t i = 0; i < pt.data.size(); ++i) pt.data[i] = 0.8f * pt.data[i] + 0.2f * crn.data[i];
  EXPECT_NE(
      findings(crn, pt).find("!CRN and PT: errors of the same pixel in both images have a rank correlation of +0."),
      std::string::npos);
}

TEST(InputChecks, FindsBadValues) {
  const test::Grouped crn = good_crn();
  test::Grouped pt = good_pt();
  pt.pixel(7, 5)[4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(findings(crn, pt).find("!PT: 1 of 4800 pixels hold NaN or infinite values, the first at (7, 5) in group 1"),
            std::string::npos);
  pt = good_pt();
  pt.pixel(7, 5)[4] = -0.1f;
  EXPECT_NE(findings(crn, pt).find("?PT: 1 of 4800 pixels hold negative values"), std::string::npos);
  pt = good_pt();
  for (int x = 0; x < 20; ++x) std::fill_n(pt.pixel(x, 3), 36, 1.0f);
  EXPECT_NE(findings(crn, pt).find("!PT: 20 of 4800 pixels are exactly 1"), std::string::npos);
}

TEST(InputChecks, FindsRepeatedGroupsAndOtherScenes) {
  const test::Grouped crn = good_crn();
  test::Grouped pt = good_pt();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) std::copy_n(pt.pixel(x, y), 3, pt.pixel(x, y) + 9);
  EXPECT_NE(findings(crn, pt).find("!PT: groups 0 and 3 are identical"), std::string::npos);
  pt = good_pt();
  for (float& v : pt.data) v *= 3;
  EXPECT_NE(findings(crn, pt).find("do not show the same scene"), std::string::npos);
}

TEST(InputChecks, BandsGiveTheSameFindings) {
  const test::Grouped crn = good_crn();
  test::Grouped pt = filtered(good_pt(), 0.1f);
  pt.pixel(7, 45)[4] = std::numeric_limits<float>::infinity();
  InputChecks checks(kWidth, kHeight, kGroups, kGroups);
  for (int y = 0; y < kHeight; y += 25) {
    const int rows = std::min(25, kHeight - y);
    checks.add_rows({kWidth, rows, kGroups, crn.view().pixel(0, y)}, {kWidth, rows, kGroups, pt.view().pixel(0, y)});
  }
  const InputReport bands = checks.report(), whole = examine_inputs(crn.view(), pt.view());
  EXPECT_EQ(bands.findings[0].text, whole.findings[0].text);
  EXPECT_NE(bands.findings[0].text.find("(7, 45) in group 1"), std::string::npos);
  EXPECT_NEAR(bands.pt_horizontal.value, whole.pt_horizontal.value, 1e-12);
  EXPECT_NEAR(bands.pt_vertical.value, whole.pt_vertical.value, 5 * whole.pt_vertical.standard_error);
  EXPECT_NEAR(bands.crn_mean, whole.crn_mean, 1e-12);
}

TEST(InputChecks, SaysWhatItCannotCheck) {
  const test::Grouped crn = good_crn(), one = test::pt_image(kWidth, kHeight, 1, 2);
  EXPECT_EQ(findings(crn, one),
            "?PT: with 1 group it cannot be checked whether its pixels are independent; 12 groups are recommended\n");
  const test::Grouped flat = test::constant_image(8, 8, 12, 0.5f);
  EXPECT_EQ(findings(flat, flat), "PT: only 0 pairs of pixels with noise; correlations are little tested\n");
  EXPECT_THROW(examine_inputs(crn.view(), flat.view()), Error);
}

}  // namespace
}  // namespace covary
