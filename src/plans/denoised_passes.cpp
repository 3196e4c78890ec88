// SPDX-License-Identifier: Apache-2.0
#include "plans/denoised_passes.h"

#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "film/groups.h"
#include "passes/ray_costs.h"
#include "plans/render.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

constexpr uint32_t kTrialPass = 2;  // pass number in its random numbers, which no pass of the plan uses

}  // namespace

std::vector<double> filtered_errors(const DenoisedMean& denoise, const Film& first, const PlanState& state) {
  MethodSettings settings;
  settings.std_error = true;
  settings.features = state.features;
  const EstimatorResult image = denoise(rows_of(first, 0, first.height()), settings);
  std::vector<double> errors(first.counts().size());
  if (image.std_error.data.empty()) return errors;
  PassSettings trial;
  trial.seed = state.request.seed;
  trial.pass = kTrialPass;
  trial.filter = state.request.filter.value_or(state.scene.filter);
  const std::vector<double> costs = ray_costs(*state.scene.scene, *state.integrator, trial, first, state.stop);
  for (size_t i = 0; i < errors.size(); ++i) {
    double squares = 0;
    for (size_t c = 0; c < 3; ++c) squares += square(image.std_error.data[3 * i + c]);
    const double error = squares / 3 * relative_weight(&image.estimate.data[3 * i]) / costs[i];
    if (std::isfinite(error)) errors[i] = error;
  }
  return errors;
}

Film joined(const Film& first, const Film& last) {
  COVARY_CHECK(first.groups() == last.groups() && first.crop() == last.crop(), "films of the same groups and pixels");
  Film sum = first;
  const int T = first.groups();
  parallel_for(first.height(), 8, [&](int y) {
    for (int x = 0; x < first.width(); ++x) {
      const size_t pixel = static_cast<size_t>(y) * first.width() + x;
      const uint32_t a = first.count(x, y), b = last.count(x, y);
      float* to = &sum.data()[pixel * T * 3];
      const float *p = first.groups_of(x, y), *q = last.groups_of(x, y);
      for (int t = 0; t < T; ++t) {
        const double n = group_size(a, T, t), m = group_size(b, T, t);
        for (int c = 3 * t; n + m > 0 && c < 3 * t + 3; ++c)
          to[c] = static_cast<float>((n * p[c] + m * q[c]) / (n + m));
      }
      sum.counts()[pixel] = a + b;
    }
  });
  return sum;
}

}  // namespace covary
