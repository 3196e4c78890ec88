// SPDX-License-Identifier: Apache-2.0
#include "risk/held_out_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "filters/guided_cells.h"
#include "risk/halves.h"
#include "risk/held_out_bias.h"
#include "risk/image_risk.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

using namespace lanes;

/// Pixels of a row segment whose errors are summed.
constexpr int kPart = 16;
/// Relative standard error of the held-out error at which it counts as much as the estimator's own prediction.
constexpr double kTrusted = 0.3;
/// Minimum error of the whole over the variance of the halves: one half, less a margin for noise.
constexpr double kMinOverVariance = 0.25;

HeldOutRow sum_of(const std::vector<HeldOutRow>& rows) {
  HeldOutRow all;
  for (const HeldOutRow& row : rows) {
    all.error += row.error, all.variance += row.variance;
    all.squares += row.squares, all.parts += row.parts;
  }
  return all;
}

/// Squared relative standard error c^2 of the held-out error; infinite if that is not positive.
double squared_uncertainty(const HeldOutRow& all) {
  if (all.parts < 2 || !(all.error > 0) || !std::isfinite(all.squares + all.variance))
    return std::numeric_limits<double>::infinity();
  return std::max(0.0, all.squares - all.error * all.error / all.parts) / square(all.error);
}

/// Weight of the held-out error, 0 to 1: 1 / (1 + (c / kTrusted)^2).
double trust_in(const HeldOutRow& all) { return 1 / (1 + squared_uncertainty(all) / square(kTrusted)); }

/// The squared error of the image of all samples.
double error_of_whole(const HeldOutRow& all) {
  return std::max(all.error - 0.5 * all.variance, kMinOverVariance * all.variance);
}

/// Squared errors and variance of the halves in a row.
HeldOutRow row_of_halves(const HeldOutInput& in, int width, int y) {
  HeldOutRow row;
  double part = 0;
  for (int x = 0; x < width; ++x) {
    if ((*in.valid)[static_cast<size_t>(y) * width + x]) {
      const float* m[2] = {in.halves[0]->pixel(x, y), in.halves[1]->pixel(x, y)};
      const double weight = relative_weight(in.guide->pixel(x, y));
      for (int c = 0; c < 3; ++c) {
        for (int half : {0, 1}) {
          const Moments& h = *in.independent[1 - half];
          part += 0.5 * weight * (square(h.mean.row(c, y)[x] - m[half][c]) - h.variance_of_mean.row(c, y)[x]);
        }
        row.variance += 0.5 * weight * square(m[0][c] - m[1][c]);
      }
    }
    if (x % kPart != kPart - 1 && x != width - 1) continue;
    row.error += part, row.squares += part * part, row.parts += 1;
    part = 0;
  }
  return row;
}

/// The image's squared error over half of the variance of the halves.
double factor_of_image(const std::vector<HeldOutRow>& rows, double usual) {
  const HeldOutRow all = sum_of(rows);
  const double trust = all.variance > 0 ? trust_in(all) : 0;
  if (trust == 0) return 2 * usual;
  return 2 * usual * std::pow(error_of_whole(all) / (usual * all.variance), trust);
}

/// Makes the relative squared error of each pixel proportional to `disagreement`. Returns the factor by which squared
/// errors are then to be multiplied so that their total over the image is unchanged.
double place(const Image& disagreement, const Image& weights, Image& std_error) {
  if (std::none_of(disagreement.data.begin(), disagreement.data.end(), [](float d) { return d > 0; })) return 1;
  const int width = std_error.width;
  std::vector<std::array<double, 2>> rows(static_cast<size_t>(std_error.height));  // before and after
  parallel_for(std_error.height, 8, [&](int y) {
    auto& [before, after] = rows[static_cast<size_t>(y)];
    for (int x = 0; x < width; ++x) {
      float* error = std_error.pixel(x, y);
      const float squares = sqr(error[0]) + sqr(error[1]) + sqr(error[2]), weight = *weights.pixel(x, y);
      const float wanted = *disagreement.pixel(x, y);
      if (squares > 0)
        for (int c = 0; c < 3; ++c) error[c] *= std::sqrt(wanted / (weight * squares));
      before += weight * squares, after += squares > 0 ? wanted : 0;
    }
  });
  double before = 0, after = 0;
  for (const auto& row : rows) before += row[0], after += row[1];
  return after > 0 ? before / after : 1;
}

/// What the covariance tells that the estimator knows. Bias is unknown: only halves show where it is.
void add_rows_in_closed_form(const GroupedImage& independent, const std::vector<unsigned char>& valid,
                             MethodImage& whole) {
  const Moments h = moments(independent, valid, 0, 0.0f);
  ImageRiskInput input;
  input.image = input.guide = &whole.estimate;
  input.independent = &h;
  input.groups = &independent;
  input.valid = &valid;
  input.covariance = &whole.covariance;
  input.std_error = &whole.std_error;
  whole.risk_rows = image_risk(input);
  whole.risk_kind = ErrorKind::kPair;
  whole.covariance = {};
}

MethodImage image_with_rows(const Method& base, const GroupedImage& crn, const GroupedImage& independent,
                            const MethodSettings& settings) {
  MethodSettings own = settings;
  own.held_out =
      settings.std_error && settings.held_out && std::min(crn.groups, independent.groups) >= 2 * base.min_groups;
  MethodImage whole = base.image({crn, independent}, own);
  if (!own.held_out) return whole;
  long ignored = 0;
  const std::vector<unsigned char> valid = finite_pixels(crn, independent, ignored);
  if (!whole.covariance.data.empty()) {
    add_rows_in_closed_form(independent, valid, whole);
    return whole;
  }
  MethodSettings half_settings = settings;
  half_settings.std_error = false;
  half_settings.crn_samples = std::max<int64_t>(1, settings.crn_samples / 2);
  std::array<Image, 2> images;
  std::array<Moments, 2> h;
  for (int half : {0, 1}) {
    const HalfImage half_crn(crn, half), half_independent(independent, half);
    images[half] = base.image({half_crn.view(), half_independent.view()}, half_settings).estimate;
    h[half] = moments(half_independent.view(), valid, 0, 0.0f);
  }
  const std::array<const Image*, 2> halves = {&images[0], &images[1]};
  const std::array<const Moments*, 2> held_out = {&h[0], &h[1]};
  const Moments all = moments(independent, valid, 0, 0.0f);
  whole.risk_rows = image_risk({&whole.estimate, halves, &all, held_out, &independent, &whole.estimate, &valid});
  whole.risk_kind = ErrorKind::kPairHalves;
  whole.bias = held_out_bias({halves, halves, held_out, &valid});
  return whole;
}

}  // namespace

Method with_held_out_rows(const Method& base) {
  if (!base.holds_out || base.adaptive) return base;
  Method method = base;
  if (base.memory.of_halves == 0) {  // it does not tell its covariance
    // The images and moments of both halves, the moments of all samples, and half of the groups of both images.
    method.memory.of_halves = (2 * (3 + 6) + 6) * sizeof(float);
    method.memory.of_halves_per_group = 3 * sizeof(float);
    method.memory.groups_for_halves = 2 * base.min_groups;
    if (base.halo >= 0) method.halo += kBiasHalo;
  }
  std::get<PassPair>(method.passes).image = [base](const GroupedImage& crn, const GroupedImage& independent,
                                                   const MethodSettings& settings) {
    return image_with_rows(base, crn, independent, settings);
  };
  return method;
}

std::vector<HeldOutRow> held_out_rows(const HeldOutInput& in) {
  std::vector<HeldOutRow> rows(static_cast<size_t>(in.guide->height));
  parallel_for(in.guide->height, 8,
               [&](int y) { rows[static_cast<size_t>(y)] = row_of_halves(in, in.guide->width, y); });
  return rows;
}

HalvesRisk risk_of_halves(const std::vector<HeldOutRow>& rows, double n_valid_pixels) {
  const HeldOutRow all = sum_of(rows);
  const double n_values = std::max(3 * n_valid_pixels, 1.0);
  return {all.error / n_values, all.variance / n_values};
}

HeldOutParts held_out_parts(const HeldOutInput& input) {
  const int width = input.guide->width, height = input.guide->height;
  // Half of the variance of a half, and the number of pixels, each times the weight of relMSE.
  const GuidedCells cells(*input.guide, *input.valid, 4, [&](int x, int y, float* sums) {
    const float weight = relative_weight(input.guide->pixel(x, y));
    for (int c = 0; c < 3; ++c)
      sums[c] += 0.25f * weight * sqr(input.halves[0]->pixel(x, y)[c] - input.halves[1]->pixel(x, y)[c]);
    sums[3] += 1;
  });
  HeldOutParts parts{Image(width, height, 3), Image(width, height, 1), held_out_rows(input)};
  for_each_batch(width, height, [&](int x, int y, int n) {
    std::array<vfloat, 4> sums;
    cells.sum(x, y, sums.data());
    for (int l = 0; l < n; ++l) {
      const float weight = *parts.weight.pixel(x + l, y) = relative_weight(input.guide->pixel(x + l, y));
      if (!(*input.valid)[static_cast<size_t>(y) * width + x + l]) continue;
      const float scale = 1 / (std::max(sums[3][l], 1e-20f) * weight);
      for (int c = 0; c < 3; ++c) parts.relative.pixel(x + l, y)[c] = std::sqrt(scale * sums[c][l]);
    }
  });
  return parts;
}

Image held_out_error(HeldOutParts parts, const Image& disagreement, double error_over_variance) {
  Image result = std::move(parts.relative);
  const double square_of_placed = place(disagreement, parts.weight, result);
  const double factor = std::sqrt(factor_of_image(parts.rows, error_over_variance) * square_of_placed);
  for (float& value : result.data) value *= static_cast<float>(factor);
  return result;
}

}  // namespace covary
