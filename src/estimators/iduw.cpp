// SPDX-License-Identifier: Apache-2.0
#include "estimators/iduw.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"
#include "estimators/control_variates.h"
#include "estimators/method.h"
#include "estimators/pair_steps.h"
#include "filters/planes.h"

namespace covary {

using namespace lanes;

namespace {

/// Fills the border by reflection at the outermost pixels (… 2 1 | 0 1 2 …), repeatedly for images smaller than the
/// border.
void reflect_border(Planes& planes) {
  const auto reflected = [](int i, int n) {
    if (n == 1) return 0;
    const int period = 2 * (n - 1), j = ((i % period) + period) % period;
    return j < n ? j : period - j;
  };
  const int w = planes.width(), h = planes.height(), border = planes.border();
  for (int c = 0; c < planes.count(); ++c)
    for (int y = -border; y < h + border; ++y) {
      float* row = planes.row(c, y);
      const float* source = planes.row(c, reflected(y, h));
      // Border columns first: in rows of the image itself, the inner columns are the source.
      for (int x = -border; x < 0; ++x) row[x] = source[reflected(x, w)];
      for (int x = w; x < w + border; ++x) row[x] = source[reflected(x, w)];
      if (y < 0 || y >= h) std::copy_n(source, w, row);
    }
}

/// Means of the groups first, first + step, … with reflected borders; invalid pixels hold `invalid`.
Planes means(const GroupedImage& image, const std::vector<unsigned char>& valid, int border, int first, int step,
             float invalid) {
  Planes mean = moments(image, valid, border, invalid, first, step).mean;
  reflect_border(mean);
  return mean;
}

class Iduw {
 public:
  Iduw(const GroupedImage& crn, const GroupedImage& independent, const std::vector<unsigned char>& valid,
       const IduwOptions& o)
      : width_(crn.width),
        height_(crn.height),
        radius_(o.window / 2),
        n_(static_cast<float>(o.samples)),
        normalise_(1.0f / static_cast<float>(o.window * o.window - 1)) {
    // Invalid pixels get opposite values in the two halves that make a weight, so that the weight is zero.
    for (int half : {0, 1}) {
      z_half_[half] = means(crn, valid, radius_, half, 2, half ? -kFar : kFar);
      y_half_[half] = means(independent, valid, radius_, half, 2, 0);
      for (int quarter : {0, 1})
        z_quarter_[half][quarter] = means(crn, valid, radius_, half + 2 * quarter, 4, quarter ? -kFar : kFar);
    }
    z_ = means(crn, valid, radius_, 0, 1, 0);
    y_ = means(independent, valid, radius_, 0, 1, 0);
  }

  /// Mean over the image of the squared relative difference of the two halves' results, for each gamma.
  std::vector<double> losses(const std::vector<float>& gammas) const {
    const int n = static_cast<int>(gammas.size());
    std::vector<double> per_row(static_cast<size_t>(height_) * n);
    parallel_for(height_, [&](int y) {
      std::vector<vfloat> sums(static_cast<size_t>(n) * 2);
      for (int x = 0; x < width_; x += kLanes)
        for (int c = 0; c < 3; ++c) add_losses(c, x, y, gammas, sums, per_row.data() + static_cast<size_t>(y) * n);
    });
    std::vector<double> total(n);
    for (int y = 0; y < height_; ++y)
      for (int i = 0; i < n; ++i) total[i] += per_row[static_cast<size_t>(y) * n + i] / (3.0 * width_ * height_);
    return total;
  }

  void reconstruct(float gamma, Image& result) const {
    for_each_batch(width_, height_, [&](int x, int y, int n) {
      for (int c = 0; c < 3; ++c) {
        const vfloat a = load(z_half_[0].row(c, y) + x), b = load(z_half_[1].row(c, y) + x);
        const vfloat centre = load(z_.row(c, y) + x) - load(y_.row(c, y) + x);
        vfloat sum = {};
        for_each_neighbour(x, y, [&](int qx, int qy) {
          const vfloat change = (a - load(z_half_[0].row(c, qy) + qx)) - (b - load(z_half_[1].row(c, qy) + qx));
          const vfloat weight = exp_of_nonpositive(-gamma * n_ * change * change);  // [Back2023], as in iduw.h
          sum = fma(weight, centre - (load(z_.row(c, qy) + qx) - load(y_.row(c, qy) + qx)), sum);
        });
        const vfloat value = load(y_.row(c, y) + x) + normalise_ * sum;
        for (int l = 0; l < n; ++l) result.pixel(x + l, y)[c] = value[l];
      }
    });
  }

 private:
  template <typename Function>
  void for_each_neighbour(int x, int y, const Function& function) const {
    for (int dy = -radius_; dy <= radius_; ++dy)
      for (int dx = -radius_; dx <= radius_; ++dx)
        if (dx != 0 || dy != 0) function(x + dx, y + dy);
  }

  void add_losses(int c, int x, int y, const std::vector<float>& gammas, std::vector<vfloat>& sums,
                  double* losses) const {
    const size_t n = gammas.size();
    std::fill(sums.begin(), sums.end(), vfloat{});
    vfloat q[2][2], centre[2];
    for (int half : {0, 1}) {
      for (int quarter : {0, 1}) q[half][quarter] = load(z_quarter_[half][quarter].row(c, y) + x);
      centre[half] = load(z_half_[half].row(c, y) + x) - load(y_half_[half].row(c, y) + x);
    }
    vfloat box = load(y_.row(c, y) + x);
    for_each_neighbour(x, y, [&](int qx, int qy) {
      box += load(y_.row(c, qy) + qx);
      for (int half : {0, 1}) {
        const vfloat change = (q[half][0] - load(z_quarter_[half][0].row(c, qy) + qx)) -
                              (q[half][1] - load(z_quarter_[half][1].row(c, qy) + qx));
        const vfloat exponent = -n_ * change * change;
        const vfloat difference =
            centre[half] - (load(z_half_[half].row(c, qy) + qx) - load(y_half_[half].row(c, qy) + qx));
        for (size_t i = 0; i < n; ++i)
          sums[2 * i + half] = fma(exp_of_nonpositive(gammas[i] * exponent), difference, sums[2 * i + half]);
      }
    });
    box *= normalise_ * static_cast<float>(1.0 / (1.0 + normalise_));  // 1 / window^2
    const vfloat denominator = box * box + 0.01f;
    const vfloat base = load(y_half_[0].row(c, y) + x) - load(y_half_[1].row(c, y) + x);
    for (size_t i = 0; i < n; ++i) {
      const vfloat difference = base + normalise_ * (sums[2 * i] - sums[2 * i + 1]);
      const vfloat loss = difference * difference / denominator;
      for (int l = 0; l < std::min(kLanes, width_ - x); ++l) losses[i] += loss[l];
    }
  }

  int width_, height_, radius_;
  float n_, normalise_;
  Planes z_, y_, z_half_[2], y_half_[2], z_quarter_[2][2];
};

}  // namespace

void check_iduw(const GroupedImage& crn, const GroupedImage& independent, const IduwOptions& options) {
  COVARY_CHECK(!options.gammas.empty() && std::ranges::all_of(options.gammas, [](float gamma) { return gamma > 0; }),
               "options of iduw are in the ranges that iduw.h states");
  std::vector<std::string> problems;
  check_k(1, options.window, problems);
  if (options.samples < 1)
    problems.push_back(fmt::format("samples is {}, expected the samples per pixel of the CRN image", options.samples));
  check_inputs(crn, independent, 4, 4, problems);
  throw_if_any(kIduw, problems);
}

EstimatorResult iduw(const GroupedImage& crn, const GroupedImage& independent, const IduwOptions& options,
                     float* chosen_gamma) {
  check_iduw(crn, independent, options);
  EstimatorResult result;
  const std::vector<unsigned char> valid = finite_pixels(crn, independent, result.nonfinite_pixels);
  const Iduw method(crn, independent, valid, options);
  size_t best = 0;
  if (options.gammas.size() > 1) {
    const std::vector<double> losses = method.losses(options.gammas);
    best = std::min_element(losses.begin(), losses.end()) - losses.begin();
  }
  if (chosen_gamma) *chosen_gamma = options.gammas[best];
  result.estimate = Image(crn.width, crn.height, 3);
  method.reconstruct(options.gammas[best], result.estimate);
  fill_invalid(crn, independent, valid, result.estimate);
  return result;
}

IduwOptions declare_iduw(Settings& settings) {
  IduwOptions o;
  settings.whole("window", o.window, kWindowRange, kWindowHelp);
  return o;
}

Method make_iduw(Settings& parameters) {
  const IduwOptions o = declare_iduw(parameters);
  PassPair pair;
  pair.needs_sample_count = true;
  pair.image = [o](const GroupedImage& crn, const GroupedImage& independent, const MethodSettings& settings) {
    IduwOptions options = o;
    options.samples = static_cast<int>(settings.crn_samples);
    return iduw(crn, independent, options);
  };
  Method estimator;
  estimator.passes = pair;
  estimator.summary = "input-dependent uncorrelated weighting";
  estimator.min_groups = 4;
  estimator.halo = -1;
  estimator.memory.always = kIduwBytesPerPixel;
  return estimator;
}

}  // namespace covary
