// SPDX-License-Identifier: Apache-2.0
#include "estimators/input_doctor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace covary {
namespace {

using Severity = Finding::Severity;

// Limits. Measured rank correlations of neighbours: box filter 0.01 or less, tent 0.24, Mitsuba's Gaussian 0.35; common
// random numbers 0.5 to 0.9, in the worst textures and caustics still above 0.05.
constexpr double kMaxPtCorrelation = 0.05;
constexpr double kMinCrnCorrelation = 0.02;
constexpr double kMaxSigmas = 8;  // for t with about 11 degrees of freedom: false alarm below 1e-5
constexpr long kMaxPairs = 250000;
constexpr long kFewPairs = 1000;

float grey(const float* rgb) { return (rgb[0] + rgb[1] + rgb[2]) * (1.0f / 3.0f); }

/// Ranks 0 … T-1 of the grey group values of a pixel, ties averaged, minus their mean; false without any variation.
bool centred_ranks(const GroupedImage& image, int x, int y, std::vector<float>& values, std::vector<float>& ranks) {
  const int T = image.groups;
  const float* p = image.pixel(x, y);
  for (int t = 0; t < T; ++t) values[t] = grey(p + 3 * t);
  bool varies = false;
  for (int t = 0; t < T; ++t) {
    if (!std::isfinite(values[t])) return false;
    int below = 0, equal = 0;
    for (int s = 0; s < T; ++s) {
      below += values[s] < values[t];
      equal += values[s] == values[t];
    }
    varies |= equal < T;
    ranks[t] = static_cast<float>(below) + 0.5f * static_cast<float>(equal - 1) - 0.5f * static_cast<float>(T - 1);
  }
  return varies;
}

/// Mean over a grid of pixels of the rank correlation of a at (x, y) with b at (x + dx, y + dy).
Correlation correlation(const GroupedImage& a, const GroupedImage& b, int dx, int dy) {
  Correlation result;
  const int T = a.groups;
  if (T < 3 || b.groups != T) return result;
  const long pixels = static_cast<long>(a.width - dx) * (a.height - dy);
  // An odd step, so that no pattern of even period is hit always at the same phase.
  const long step = std::max(1L, pixels / kMaxPairs) | 1;
  std::vector<float> values(T), first(T), second(T);
  double sum = 0;
  for (long i = 0; i < pixels; i += step) {
    const int x = static_cast<int>(i % (a.width - dx)), y = static_cast<int>(i / (a.width - dx));
    if (!centred_ranks(a, x, y, values, first) || !centred_ranks(b, x + dx, y + dy, values, second)) continue;
    double product = 0, square_a = 0, square_b = 0;
    for (int t = 0; t < T; ++t) {
      product += first[t] * second[t];
      square_a += first[t] * first[t];
      square_b += second[t] * second[t];
    }
    sum += product / std::sqrt(square_a * square_b);
    ++result.pairs;
  }
  if (result.pairs == 0) return result;
  result.value = sum / static_cast<double>(result.pairs);
  // Of independent ranks a correlation has variance 1 / (T - 1).
  result.standard_error = 1.0 / std::sqrt(static_cast<double>(result.pairs) * (T - 1));
  return result;
}

/// Counts of values, and grey image means of the groups.
struct Values {
  long nonfinite = 0, negative = 0, clipped = 0;
  int bad_x = -1, bad_y = -1, bad_group = -1;  ///< first non-finite value
  std::vector<double> group_means;
  double mean = 0, variance_of_mean = 0;
};

Values examine_values(const GroupedImage& image) {
  Values v;
  v.group_means.resize(image.groups);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float* p = image.pixel(x, y);
      bool nonfinite = false, negative = false, clipped = true;
      for (int i = 0; i < 3 * image.groups; ++i) {
        if (!std::isfinite(p[i])) {
          if (v.bad_x < 0) v.bad_x = x, v.bad_y = y, v.bad_group = i / 3;
          nonfinite = true;
        }
        negative |= p[i] < 0;
        clipped &= p[i] == 1.0f;
      }
      v.nonfinite += nonfinite;
      v.negative += negative;
      v.clipped += clipped;
      if (nonfinite) continue;
      for (int t = 0; t < image.groups; ++t) v.group_means[t] += grey(p + 3 * t);
    }
  for (double& m : v.group_means) {
    m /= static_cast<double>(image.width) * image.height;
    v.mean += m / image.groups;
  }
  for (double m : v.group_means) v.variance_of_mean += (m - v.mean) * (m - v.mean);
  v.variance_of_mean /= std::max(1.0, static_cast<double>(image.groups) * (image.groups - 1));
  return v;
}

void check_values(const char* name, const GroupedImage& image, const Values& v, std::vector<Finding>& findings) {
  const long pixels = static_cast<long>(image.width) * image.height;
  if (v.nonfinite)
    findings.push_back(
        {Severity::kError,
         fmt::format("{}: {} of {} pixels hold NaN or infinite values, the first at ({}, {}) in group {}; "
                     "find the cause in the renderer, or leave such samples out there",
                     name, v.nonfinite, pixels, v.bad_x, v.bad_y, v.bad_group)});
  if (v.negative)
    findings.push_back({Severity::kWarning,
                        fmt::format("{}: {} of {} pixels hold negative values; filters with negative lobes (Mitchell, "
                                    "Lanczos) make such values and must not be used: use a box filter",
                                    name, v.negative, pixels)});
  if (v.clipped * 500 > pixels)
    findings.push_back(
        {Severity::kError,
         fmt::format("{}: {} of {} pixels are exactly 1 in all groups and channels: values are clipped; save "
                     "linear, unclipped 32-bit float values (not PNG, no tone mapping)",
                     name, v.clipped, pixels)});
  for (int a = 0; a < image.groups; ++a)
    for (int b = a + 1; b < image.groups; ++b)
      if (v.group_means[a] == v.group_means[b] && v.variance_of_mean > 0) {
        findings.push_back(
            {Severity::kError,
             fmt::format("{}: groups {} and {} are identical: the same seed was rendered twice; give every "
                         "group its own seed",
                         name, a, b)});
        return;
      }
}

std::string signed_value(const Correlation& c) { return fmt::format("{:+.3f} (± {:.3f})", c.value, c.standard_error); }

bool significant(const Correlation& c, double limit) {
  return c.pairs > 0 && std::abs(c.value) > std::max(limit, 5 * c.standard_error);
}

void check_correlations(const InputReport& r, std::vector<Finding>& findings) {
  const Correlation& pt =
      std::abs(r.pt_horizontal.value) > std::abs(r.pt_vertical.value) ? r.pt_horizontal : r.pt_vertical;
  if (significant(pt, kMaxPtCorrelation)) {
    if (pt.value > 0.5)
      findings.push_back(
          {Severity::kError,
           fmt::format("PT: errors of neighbouring pixels have a rank correlation of {}; independent pixels "
                       "have 0. This looks like an image with common random numbers: are CRN and PT swapped?",
                       signed_value(pt))});
    else if (pt.value > 0)
      findings.push_back(
          {Severity::kError,
           fmt::format(
               "PT: errors of neighbouring pixels have a rank correlation of {}; independent pixels have 0. The pixel "
               "filter is wider than a pixel. Render both images with a box filter: in Mitsuba <rfilter "
               "type=\"box\"/>, in pbrt PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5, in Blender "
               "scene.cycles.pixel_filter_type = 'BOX'; and without a denoiser",
               signed_value(pt))});
    else
      findings.push_back(
          {Severity::kError,
           fmt::format(
               "PT: errors of neighbouring pixels have a rank correlation of {}; independent pixels have 0. The "
               "sampler "
               "spreads errors as blue noise. Use independent random numbers: in Mitsuba <sampler "
               "type=\"independent\"/>, in pbrt Sampler \"independent\", in Blender scene.cycles.sampling_pattern = "
               "'TABULATED_SOBOL' with scrambling_distance = 1",
               signed_value(pt))});
  }
  if (significant(r.crn_pt, kMaxPtCorrelation))
    findings.push_back(
        {Severity::kError,
         fmt::format("CRN and PT: errors of the same pixel in both images have a rank correlation of {}; "
                     "independent images have 0. Render them with different seeds",
                     signed_value(r.crn_pt))});
  const double crn = std::max(r.crn_horizontal.value, r.crn_vertical.value);
  if (r.crn_horizontal.pairs + r.crn_vertical.pairs > 0 &&
      crn < std::max(kMinCrnCorrelation, 5 * r.crn_horizontal.standard_error)) {
    findings.push_back(
        {Severity::kError,
         fmt::format(
             "CRN: errors of neighbouring pixels have a rank correlation of only {}; common random numbers give 0.3 to "
             "0.9. The pixels do not share their random numbers. Seed the generator by the sample alone, not by the "
             "pixel: in Mitsuba and pbrt this needs a sampler of your own (independent numbers whose seed leaves the "
             "pixel out), in Blender scene.cycles.sampling_pattern = 'TABULATED_SOBOL', "
             "auto_scrambling_distance = False and scrambling_distance = 0, with another seed for every group",
             signed_value(r.crn_horizontal))});
  }
}

}  // namespace

bool InputReport::has_errors() const {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.severity == Severity::kError; });
}

InputReport examine_inputs(const GroupedImage& crn, const GroupedImage& pt) {
  std::vector<std::string> problems;
  check_inputs(crn, pt, 1, 1, problems);
  throw_if_any("inputs", problems);

  InputReport r;
  const Values a = examine_values(crn), b = examine_values(pt);
  r.crn_mean = a.mean;
  r.pt_mean = b.mean;
  r.nonfinite_pixels = a.nonfinite + b.nonfinite;
  r.negative_pixels = a.negative + b.negative;
  r.clipped_pixels = a.clipped + b.clipped;
  check_values("CRN", crn, a, r.findings);
  check_values("PT", pt, b, r.findings);

  r.crn_horizontal = correlation(crn, crn, 1, 0);
  r.crn_vertical = correlation(crn, crn, 0, 1);
  r.pt_horizontal = correlation(pt, pt, 1, 0);
  r.pt_vertical = correlation(pt, pt, 0, 1);
  r.crn_pt = correlation(crn, pt, 0, 0);
  check_correlations(r, r.findings);
  if (pt.groups < 3)
    r.findings.push_back(
        {Severity::kWarning,
         fmt::format("PT: with {} group{} it cannot be checked whether its pixels are independent; 12 groups "
                     "are recommended",
                     pt.groups, pt.groups == 1 ? "" : "s")});
  else if (r.pt_horizontal.pairs < kFewPairs)
    r.findings.push_back(
        {Severity::kNote,
         fmt::format("PT: only {} pairs of pixels with noise; correlations are little tested", r.pt_horizontal.pairs)});

  if (crn.groups >= 3 && pt.groups >= 3 && r.nonfinite_pixels == 0) {
    const double deviation = std::sqrt(a.variance_of_mean + b.variance_of_mean), difference = a.mean - b.mean;
    if (deviation > 0) r.mean_difference_sigmas = difference / deviation;
    const double scale = std::max(std::abs(a.mean), std::abs(b.mean));
    if (std::abs(difference) > std::max(kMaxSigmas * deviation, 1e-4 * scale))
      r.findings.push_back(
          {Severity::kError,
           fmt::format("the image means {:.5g} (CRN) and {:.5g} (PT) differ by {:.1f} standard errors: the "
                       "images do not show the same scene with the same settings",
                       a.mean, b.mean, std::abs(r.mean_difference_sigmas))});
  }
  return r;
}

}  // namespace covary
