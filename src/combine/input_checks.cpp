// SPDX-License-Identifier: Apache-2.0
#include "combine/input_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "combine/grey.h"
#include "core/error.h"
#include "core/number_text.h"
#include "film/groups.h"
#include "filters/planes.h"

namespace covary {
namespace {

using Severity = Finding::Severity;

// Limits. Measured rank correlations of neighbours: at most 0.01 for a box filter, 0.24 for a tent, 0.35 for Mitsuba's
// Gaussian; 0.5 to 0.9 for common random numbers, still above 0.05 in the worst textures and caustics.
constexpr double kMaxIndependentCorrelation = 0.05;
constexpr double kMinCrnCorrelation = 0.02;
constexpr double kMaxSigmas = 8;  // for t with about 11 degrees of freedom: false-alarm rate below 1e-5
constexpr long kMaxPixelPairs = 250000;
constexpr long kFewPairs = 200;
constexpr double kMaxLeftOut = 0.01;  // of the pixels

/// Ranks 0 … T-1 of the grey group values of a pixel, ties averaged, minus their mean; false if all values are equal.
bool centred_ranks(const GroupedImage& image, int x, int y, std::vector<float>& values, std::vector<float>& ranks) {
  const int T = image.groups;
  const float* p = image.pixel(x, y);
  for (int t = 0; t < T; ++t) values[t] = grey(p + 3 * t);
  bool varies = false;
  for (int t = 0; t < T; ++t) {
    if (!is_usable(values[t])) return false;
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

/// Mean over pixels of the rank correlation of a at (x, y) with b at (x + dx, y + dy).
class PairStatistics {
 public:
  PairStatistics(long n_pixels, int groups_a, int groups_b, int dx, int dy)
      : T_(groups_a == groups_b && groups_a >= 3 ? groups_a : 0),
        dx_(dx),
        dy_(dy),
        // An odd step, so that patterns of even period are not always sampled at the same phase.
        step_(std::max(1L, n_pixels / kMaxPixelPairs) | 1),
        values_(T_),
        first_(T_),
        second_(T_) {}

  void add_rows(const GroupedImage& a, const GroupedImage& b) {
    if (T_ == 0) return;
    const long columns = a.width - dx_, pixels = columns * (a.height - dy_);
    for (long i = 0; i < pixels; i += step_) {
      const int x = static_cast<int>(i % columns), y = static_cast<int>(i / columns);
      if (!centred_ranks(a, x, y, values_, first_) || !centred_ranks(b, x + dx_, y + dy_, values_, second_)) continue;
      double product = 0, square_a = 0, square_b = 0;
      for (int t = 0; t < T_; ++t) {
        product += first_[t] * second_[t];
        square_a += first_[t] * first_[t];
        square_b += second_[t] * second_[t];
      }
      sum_ += product / std::sqrt(square_a * square_b);
      ++pairs_;
    }
  }

  Correlation result() const {
    // Correlations of independent ranks have variance 1 / (T - 1).
    if (pairs_ == 0) return {};
    const double n = static_cast<double>(pairs_);
    return {sum_ / n, 1.0 / std::sqrt(n * (T_ - 1)), pairs_};
  }

 private:
  int T_, dx_, dy_;
  long step_;
  std::vector<float> values_, first_, second_;
  double sum_ = 0;
  long pairs_ = 0;
};

/// Counts of values, and grey image means of the groups.
struct Values {
  long nonfinite = 0, negative = 0, clipped = 0, partly_clipped = 0;  ///< clipped: all values 1; partly: some
  float brightest = 0;
  int bad_x = -1, bad_y = -1, bad_group = -1;      ///< first non-finite value
  std::vector<double> group_means, group_samples;  ///< sums of values and of samples until finish()
  double mean = 0, variance_of_mean = 0;
};

void add_values(const GroupedImage& image, int first_row, Values& v) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float* p = image.pixel(x, y);
      bool nonfinite = false, negative = false, clipped = true, partly_clipped = false;
      for (int i = 0; i < 3 * image.groups; ++i) {
        if (!is_usable(p[i])) {
          if (v.bad_x < 0) v.bad_x = x, v.bad_y = first_row + y, v.bad_group = i / 3;
          nonfinite = true;
        }
        negative |= p[i] < 0;
        clipped &= p[i] == 1.0f;
        partly_clipped |= p[i] == 1.0f;
        v.brightest = std::max(v.brightest, p[i]);
      }
      v.nonfinite += nonfinite;
      v.negative += negative;
      v.clipped += clipped;
      v.partly_clipped += partly_clipped && !clipped;
      if (nonfinite) continue;
      for (int t = 0; t < image.groups; ++t) {
        v.group_means[t] += grey(p + 3 * t);
        v.group_samples[t] += group_size(image.count(x, y), image.groups, t);
      }
    }
}

void finish(Values& v, long pixels) {
  const size_t T = v.group_means.size();
  // Weights with mean 1: larger groups count more.
  const double total = std::accumulate(v.group_samples.begin(), v.group_samples.end(), 0.0);
  for (double& samples : v.group_samples) samples = samples > 0 ? samples * static_cast<double>(T) / total : 1;
  for (size_t t = 0; t < T; ++t) {
    v.group_means[t] /= static_cast<double>(pixels);
    v.mean += v.group_samples[t] * v.group_means[t] / static_cast<double>(T);
  }
  for (size_t t = 0; t < T; ++t)
    v.variance_of_mean += v.group_samples[t] * (v.group_means[t] - v.mean) * (v.group_means[t] - v.mean);
  v.variance_of_mean /= std::max(1.0, static_cast<double>(T) * (static_cast<double>(T) - 1));
}

/// Noisy values that are limited to 1 leave pixels in which some are 1; a white background does not.
bool is_clipped(const Values& v, long pixels) {
  constexpr long kOneIn = 500, kOneInPartly = 20;  // one in so many, of the pixels and of those that are 1
  return v.brightest <= 1 && v.clipped * kOneIn > pixels &&
         (v.partly_clipped * kOneInPartly > v.clipped || v.clipped == pixels);
}

void check_values(const ImageNames& names, long pixels, const Values& v, std::vector<Finding>& findings) {
  const std::string& name = names.image;
  if (v.nonfinite) {
    const bool too_many = v.nonfinite > kMaxLeftOut * static_cast<double>(pixels);
    findings.push_back(
        {too_many ? Severity::kError : Severity::kWarning,
         fmt::format("{}: {} of {} pixels hold NaN, infinite or overflowing values, the first at ({}, {}) in {}; "
                     "{}; find the cause in the renderer",
                     name, v.nonfinite, pixels, v.bad_x, v.bad_y, names.render(static_cast<size_t>(v.bad_group)),
                     too_many ? "these are too many to be left out" : "these values are left out")});
  }
  if (v.negative)
    findings.push_back({Severity::kWarning,
                        fmt::format("{}: {} of {} pixels hold negative values; spectral renderers make them of colours "
                                    "that sRGB does not have, which is right, and filters with negative lobes "
                                    "(Mitchell, Lanczos), which must not be used: use a box filter",
                                    name, v.negative, pixels)});
  if (is_clipped(v, pixels))
    findings.push_back(
        {Severity::kError,
         fmt::format("{}: {} of {} pixels are exactly 1 in all renders and channels, and none is brighter: values are "
                     "clipped; save linear, unclipped 32-bit float values, not PNG and without tone mapping ({})",
                     name, v.clipped, pixels, names.how_to(RenderSetting::kFloats))});
}

std::string signed_value(const Correlation& c) { return fmt::format("{:+.3f} (± {:.3f})", c.value, c.standard_error); }

bool significant(const Correlation& c, double limit) {
  return c.pairs > 0 && std::abs(c.value) > std::max(limit, 5 * c.standard_error);
}

void check_correlations(const ImageNames& of_crn, const ImageNames& names, const InputReport& r,
                        std::vector<Finding>& findings) {
  const Correlation& independent = std::abs(r.independent_horizontal.value) > std::abs(r.independent_vertical.value)
                                       ? r.independent_horizontal
                                       : r.independent_vertical;
  if (significant(independent, kMaxIndependentCorrelation)) {
    if (independent.value > 0.5)
      findings.push_back(
          {Severity::kError,
           fmt::format(
               "{}: errors of neighbouring pixels have a rank correlation of {}; independent pixels "
               "have 0. This looks like an image with common random numbers: are CRN and independent image swapped?",
               names.image, signed_value(independent))});
    else if (independent.value > 0)
      findings.push_back(
          {Severity::kError,
           fmt::format(
               "{}: errors of neighbouring pixels have a rank correlation of {}; independent pixels "
               "have 0. The pixel "
               "filter is wider than a pixel. Render both images with a box filter: in Mitsuba <rfilter "
               "type=\"box\"/>, in pbrt PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5, in Blender "
               "scene.cycles.pixel_filter_type = 'BOX'; and without a denoiser",
               names.image, signed_value(independent))});
    else
      findings.push_back(
          {Severity::kError,
           fmt::format(
               "{}: errors of neighbouring pixels have a rank correlation of {}; independent pixels "
               "have 0. The "
               "sampler "
               "spreads errors as blue noise. Use independent random numbers: in Mitsuba <sampler "
               "type=\"independent\"/>, in pbrt Sampler \"independent\", in Blender scene.cycles.sampling_pattern = "
               "'TABULATED_SOBOL' ('PROGRESSIVE_MULTI_JITTER' before 3.5) with scrambling_distance = 1",
               names.image, signed_value(independent))});
  }
  if (significant(r.crn_independent, kMaxIndependentCorrelation))
    findings.push_back(
        {Severity::kError,
         fmt::format("{} and {}: errors of the same pixel in both images have a rank correlation of {}; "
                     "independent images have 0. Render them with different seeds ({})",
                     of_crn.image, names.image, signed_value(r.crn_independent), names.how_to(RenderSetting::kSeed))});
  const double crn = std::max(r.crn_horizontal.value, r.crn_vertical.value);
  if (r.crn_horizontal.pairs + r.crn_vertical.pairs > 0 &&
      crn < std::max(kMinCrnCorrelation, 5 * r.crn_horizontal.standard_error)) {
    findings.push_back(
        {Severity::kError,
         fmt::format(
             "{}: errors of neighbouring pixels have a rank correlation of only {}; common random numbers give 0.3 to "
             "0.9. The pixels do not share their random numbers. Seed the generator by the sample alone, not by the "
             "pixel: in Mitsuba and pbrt this needs a sampler of your own (independent numbers whose seed leaves the "
             "pixel out), in Blender scene.cycles.sampling_pattern = 'TABULATED_SOBOL' ('PROGRESSIVE_MULTI_JITTER' "
             "before 3.5), "
             "auto_scrambling_distance = False and scrambling_distance = 0, with another seed for every group",
             of_crn.image, signed_value(r.crn_horizontal))});
  }
}

/// Whether both images have the same mean, within their noise.
void check_means(const ImageNames& of_crn, const ImageNames& names, const Values& crn, const Values& independent,
                 InputReport& r) {
  const double deviation = std::sqrt(crn.variance_of_mean + independent.variance_of_mean),
               difference = crn.mean - independent.mean;
  if (deviation > 0) r.mean_difference_sigmas = difference / deviation;
  const double scale = std::max(std::abs(crn.mean), std::abs(independent.mean));
  if (std::abs(difference) > std::max(kMaxSigmas * deviation, 1e-4 * scale))
    r.findings.push_back(
        {Severity::kError,
         fmt::format("{} has the mean {:.5g}, {} {:.5g}: they differ by {:.1f} standard errors, and do not show the "
                     "same scene with the same settings",
                     of_crn.image, crn.mean, names.image, independent.mean, std::abs(r.mean_difference_sigmas))});
}

}  // namespace

bool InputReport::has_errors() const {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.severity == Severity::kError; });
}

struct InputChecks::State {
  State(int w, int h, int crn_groups, int independent_groups)
      : width(w),
        height(h),
        crn_horizontal(long{w} * h, crn_groups, crn_groups, 1, 0),
        crn_vertical(long{w} * h, crn_groups, crn_groups, 0, 1),
        independent_horizontal(long{w} * h, independent_groups, independent_groups, 1, 0),
        independent_vertical(long{w} * h, independent_groups, independent_groups, 0, 1),
        crn_independent(long{w} * h, crn_groups, independent_groups, 0, 0) {
    crn.group_means.resize(crn_groups), crn.group_samples.resize(crn_groups);
    independent.group_means.resize(independent_groups), independent.group_samples.resize(independent_groups);
  }
  bool has_crn() const { return !crn.group_means.empty(); }
  int width, height, next_row = 0;
  Values crn, independent;
  PairStatistics crn_horizontal, crn_vertical, independent_horizontal, independent_vertical, crn_independent;
};

InputChecks::InputChecks(int width, int height, int crn_groups, int independent_groups)
    : state_(std::make_unique<State>(width, height, crn_groups, independent_groups)) {}
InputChecks::~InputChecks() = default;

void InputChecks::add_rows(const GroupedImage& crn, const GroupedImage& independent) {
  State& s = *state_;
  std::vector<std::string> problems;
  check_inputs(s.has_crn() ? crn : independent, independent, 1, 1, problems);
  throw_if_any("inputs", problems);
  COVARY_CHECK(independent.width == s.width && s.next_row + independent.height <= s.height, "rows belong to the image");
  add_values(independent, s.next_row, s.independent);
  s.next_row += independent.height;
  if (!s.has_crn()) return;
  add_values(crn, s.next_row - crn.height, s.crn);
  s.crn_horizontal.add_rows(crn, crn);
  s.crn_vertical.add_rows(crn, crn);
  s.independent_horizontal.add_rows(independent, independent);
  s.independent_vertical.add_rows(independent, independent);
  s.crn_independent.add_rows(crn, independent);
}

std::string ImageNames::render(size_t group) const {
  return group < renders.size() ? renders[group] : fmt::format("render {}", group + 1);
}

std::string ImageNames::count(size_t n) const { return counted(n, renders.empty() ? "group" : "render"); }

InputReport InputChecks::report(const ImageNames& of_crn, const ImageNames& of_independent) const {
  const State& s = *state_;
  COVARY_CHECK(s.next_row == s.height, "all rows were given");
  const long pixels = static_cast<long>(s.width) * s.height;
  Values crn = s.crn, independent = s.independent;
  finish(crn, pixels);
  finish(independent, pixels);
  InputReport r;
  r.crn_mean = crn.mean;
  r.independent_mean = independent.mean;
  r.nonfinite_pixels = crn.nonfinite + independent.nonfinite;
  r.negative_pixels = crn.negative + independent.negative;
  r.clipped_pixels = crn.clipped + independent.clipped;
  if (s.has_crn()) check_values(of_crn, pixels, crn, r.findings);
  check_values(of_independent, pixels, independent, r.findings);
  if (!s.has_crn()) return r;

  const auto is_black = [](const Values& v) { return v.mean == 0 && v.negative == 0 && v.nonfinite == 0; };
  if (is_black(crn) && is_black(independent))
    r.findings.push_back({Severity::kWarning,
                          "both images are black; files that Mitsuba's integrator aov makes without another one inside "
                          "have channels R, G and B that are all 0"});

  r.crn_horizontal = s.crn_horizontal.result();
  r.crn_vertical = s.crn_vertical.result();
  r.independent_horizontal = s.independent_horizontal.result();
  r.independent_vertical = s.independent_vertical.result();
  r.crn_independent = s.crn_independent.result();
  check_correlations(of_crn, of_independent, r, r.findings);
  const size_t crn_groups = crn.group_means.size(), independent_groups = independent.group_means.size();
  if (independent_groups < 3)
    r.findings.push_back(
        {Severity::kWarning,
         fmt::format("{}: with {} it cannot be checked whether its pixels are independent; 12 are recommended",
                     of_independent.image, of_independent.count(independent_groups))});
  else if (r.independent_horizontal.pairs < kFewPairs)
    r.findings.push_back(
        {Severity::kNote, fmt::format("{}: only {} pairs of pixels with noise; correlations are hardly tested",
                                      of_independent.image, r.independent_horizontal.pairs)});

  if (crn_groups >= 3 && independent_groups >= 3 && r.nonfinite_pixels == 0)
    check_means(of_crn, of_independent, crn, independent, r);
  return r;
}

}  // namespace covary
