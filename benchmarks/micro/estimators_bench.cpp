// SPDX-License-Identifier: Apache-2.0
// The image-space estimators on a synthetic frame of 1280 x 720 pixels with 12 + 12 groups: the stages of iicv one by
// one, and whole estimators. Stages run on one thread, estimators on all. items_per_second are pixels per second; flops
// are counted from the formulas, with 20 for an exponential function, and bytes are the minimum that must be read.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <cmath>
#include <vector>

#include "combine/registry.h"
#include "core/random.h"
#include "dependent_tests/dependent_tests.h"
#include "estimators/control_variates.h"
#include "estimators/cv_baseline.h"
#include "estimators/iduw.h"
#include "estimators/iicv.h"
#include "estimators/method.h"
#include "estimators/pilot.h"
#include "estimators/polynomials.h"
#include "filters/neighbours.h"
#include "filters/nl_means.h"
#include "filters/residual_correction.h"

namespace covary {
namespace {

constexpr int kWidth = 1280, kHeight = 720, kGroups = 12, kBorder = 5;

float noise(uint64_t seed, uint64_t a, uint64_t b) {
  return static_cast<float>(mix64(combine64(combine64(seed, a), b)) >> 40) * 0x1p-24f - 0.5f;
}

/// A smooth picture with edges and a textured part; `own`: part of the noise that pixels do not share.
std::vector<float> make_image(uint64_t seed, float own, int groups = kGroups) {
  std::vector<float> data(static_cast<size_t>(kWidth) * kHeight * groups * 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const uint64_t pixel = 1 + static_cast<uint64_t>(y) * kWidth + x;
      const float texture = y > kHeight / 2 ? noise(1, pixel, 1) : 0.0f;
      const float base =
          ((x / 90 + y / 70) % 2 ? 0.3f : 1.0f) * (1.0f + 0.5f * std::sin(0.02f * x) * std::cos(0.03f * y));
      for (int i = 0; i < groups * 3; ++i)
        data[(pixel - 1) * groups * 3 + i] =
            base * (1.0f + 0.5f * texture) * (1.0f + (1.0f - own) * noise(seed, 0, i) + own * noise(seed, pixel, i));
    }
  return data;
}

struct Input {
  std::vector<float> crn_data = make_image(2, 0.2f), independent_data = make_image(3, 1.0f);
  GroupedImage crn{kWidth, kHeight, kGroups, crn_data.data()},
      independent{kWidth, kHeight, kGroups, independent_data.data()};
  std::vector<unsigned char> valid = std::vector<unsigned char>(static_cast<size_t>(kWidth) * kHeight, 1);
  Moments g = moments(crn, valid, kBorder, kFar), h = moments(independent, valid, kBorder, 0.0f);
  Planes error = pilot_error(g, h, 11, kBorder);
};

const Input& input() {
  static const Input instance;
  return instance;
}

void count(benchmark::State& state) { state.SetItemsProcessed(state.iterations() * kWidth * kHeight); }

/// Sets what a stage does for each pixel as a rate per second: "flops" or "bytes".
void count_work(benchmark::State& state, const char* name, double per_pixel) {
  state.counters[name] =
      benchmark::Counter(per_pixel * kWidth * kHeight, benchmark::Counter::kIsIterationInvariantRate);
}

void one_moments(benchmark::State& state) {
  const Input& in = input();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  for (auto _ : state) benchmark::DoNotOptimize(moments(in.crn, in.valid, kBorder, kFar));
  count(state);
  count_work(state, "bytes", 3 * kGroups * sizeof(float));
}

void one_pilot(benchmark::State& state) {
  const Input& in = input();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  for (auto _ : state) benchmark::DoNotOptimize(pilot_error(in.g, in.h, 11, kBorder));
  count(state);
  count_work(state, "flops", 121 * 36);
}

void one_neighbours(benchmark::State& state) {
  const Input& in = input();
  const NeighbourSearch search(25, 11);
  std::vector<lanes::vint> keys(search.offsets().size());
  std::vector<uint16_t> chosen(search.chosen_size());
  for (auto _ : state)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; x += lanes::kLanes) {
        search.find(in.g.mean, x, y, keys.data(), chosen.data());
        benchmark::DoNotOptimize(chosen.data());
      }
  count(state);
}

/// Search, gathering and solving, without and with error estimate.
void one_regression(benchmark::State& state) {
  const Input& in = input();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  ControlVariateSettings settings;
  settings.sample_fraction = IicvOptions().sample_fraction;
  settings.mean_constraint = IicvOptions().mean_constraint;
  settings.std_error = state.range(0) != 0;
  const ControlVariateInput data{in.crn, &in.g, &in.h.mean, &in.error, &in.h.variance_of_mean};
  for (auto _ : state) {
    EstimatorResult result;
    apply_control_variates(data, settings, in.valid, result);
    benchmark::DoNotOptimize(result.estimate.data.data());
  }
  count(state);
  if (state.range(0)) count_work(state, "flops", 41e3);  // of them 23e3 for the Gram matrix
}

void one_residual_correction(benchmark::State& state) {
  const Input& in = input();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  IicvOptions options;
  options.residual_correction = false;
  options.std_error = true;
  const EstimatorResult before = iicv(in.crn, in.independent, options);
  for (auto _ : state) {
    Image estimate = before.estimate;
    add_residual_correction(in.h, ResidualCorrectionOptions(), in.valid, before.std_error, estimate);
    benchmark::DoNotOptimize(estimate.data.data());
  }
  count(state);
  count_work(state, "flops", (441 + 441 + 121) * 40);
}

/// NL-means with two bandwidths and six planes of features, for the image alone (1) or with both halves (3), as the
/// candidates of a mixture are made.
void one_nl_means(benchmark::State& state) {
  const Input& in = input();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const auto image_of = [](const Planes& planes, bool root) {
    Image image(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) {
          const float value = planes.row(c, y)[x];
          image.pixel(x, y)[c] = root ? std::sqrt(value) : value;
        }
    return image;
  };
  std::vector<Image> images, errors;
  for (const int first : {0, 0, 1}) {
    const Moments m = moments(in.independent, in.valid, 0, 0.0f, first, images.empty() ? 1 : 2);
    images.push_back(image_of(m.mean, false));
    errors.push_back(image_of(m.variance_of_mean, true));
  }
  std::vector<NlMeansSteering> steerings;
  for (size_t i = 0; i < static_cast<size_t>(state.range(0)); ++i)
    steerings.push_back({&images[i], &errors[i], {{0.5f, {&images[i]}}, {1.0f, {&images[i]}}}});
  Planes features(kWidth, kHeight, 6, kNlMeansRadius, 0.0f);
  for (int i = 0; i < 6; ++i)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) features.row(i, y)[x] = ((x / 90 + y / 70 + i) % 2 ? 0.3f : 1.0f) / 0.2f;
  for (auto _ : state) benchmark::DoNotOptimize(nl_means(steerings, &features, in.valid));
  count(state);
  // By pair of pixels and image: distances 33 and their sums 8, two weights of 22 each, two sums of 16 each.
  count_work(state, "flops", 220.0 * (20 + static_cast<double>(state.range(0)) * (33 + 8 + 2 * (22 + 16))));
}

/// One pixel of range(1) samples in range(0) dimensions.
void one_polynomials(benchmark::State& state) {
  const auto dimensions = static_cast<int>(state.range(0));
  std::vector<Spectrum> values;
  std::vector<float> coordinates;
  for (int s = 0; s < state.range(1); ++s) {
    values.emplace_back(1 + noise(5, s, 0), 1 + noise(5, s, 1), 1 + noise(5, s, 2));
    for (int i = 0; i < dimensions; ++i) coordinates.push_back(0.5f + noise(6, s, i));
  }
  for (auto _ : state) benchmark::DoNotOptimize(polynomials(values, coordinates, dimensions));
  state.SetItemsProcessed(state.iterations());
}

void whole_iicv(benchmark::State& state, const IicvOptions& options) {
  const Input& in = input();
  for (auto _ : state) benchmark::DoNotOptimize(iicv(in.crn, in.independent, options).estimate.data.data());
  count(state);
}

/// As published, on one thread: range(0) control variates from windows of side range(1), range(2) groups ([YM2025]
/// Sec. 4 and Fig. 11).
void one_published_iicv(benchmark::State& state) {
  const auto groups = static_cast<int>(state.range(2));
  const std::vector<float> crn_data = make_image(2, 0.2f, groups), independent_data = make_image(3, 1.0f, groups);
  const GroupedImage crn{kWidth, kHeight, groups, crn_data.data()};
  const GroupedImage independent{kWidth, kHeight, groups, independent_data.data()};
  IicvOptions options = IicvOptions::paper();
  options.k = static_cast<int>(state.range(0)), options.window = static_cast<int>(state.range(1));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  for (auto _ : state) benchmark::DoNotOptimize(iicv(crn, independent, options).estimate.data.data());
  count(state);
}

/// With its standard error calibrated by both halves of the samples: three runs of the estimator.
void whole_calibrated(benchmark::State& state) {
  const Input& in = input();
  const Method estimator = make_estimator("iicv");
  MethodSettings settings;
  settings.std_error = true;
  for (auto _ : state)
    benchmark::DoNotOptimize(estimator.image({in.crn, in.independent}, settings).estimate.data.data());
  count(state);
}

void whole_cv_baseline(benchmark::State& state) {
  const Input& in = input();
  for (auto _ : state) benchmark::DoNotOptimize(cv_baseline(in.crn, in.independent).estimate.data.data());
  count(state);
}

void whole_iduw(benchmark::State& state) {
  const Input& in = input();
  IduwOptions options;
  options.samples = 96;
  for (auto _ : state) benchmark::DoNotOptimize(iduw(in.crn, in.independent, options).estimate.data.data());
  count(state);
}

void one_cv_baseline(benchmark::State& state) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  whole_cv_baseline(state);
}

void one_iduw(benchmark::State& state) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  whole_iduw(state);
}

/// Means and variances as films have them, one group: what the filters of dependent tests read.
const FilterInput& filter_inputs() {
  static const FilterInput instance =
      filter_input(input().crn, input().independent, input().valid, VarianceSource::kBoth, 7, 16);
  return instance;
}

void filter_paper(benchmark::State& state) {
  const FilterInput& in = filter_inputs();
  for (auto _ : state) benchmark::DoNotOptimize(region_filter(in, RegionOptions()).colour.data.data());
  count(state);
}

void filter_exact(benchmark::State& state) {
  const FilterInput& in = filter_inputs();
  for (auto _ : state) benchmark::DoNotOptimize(bound_filter(in, static_cast<int>(state.range(0))).colour.data.data());
  count(state);
}

void whole_dependent_tests(benchmark::State& state, const DependentTestsOptions& options) {
  const Input& in = input();
  for (auto _ : state) benchmark::DoNotOptimize(dependent_tests(in.crn, in.independent, options).estimate.data.data());
  count(state);
}

BENCHMARK(one_moments)->Unit(benchmark::kMillisecond);
BENCHMARK(one_pilot)->Unit(benchmark::kMillisecond);
BENCHMARK(one_neighbours)->Unit(benchmark::kMillisecond);
BENCHMARK(one_regression)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(one_residual_correction)->Unit(benchmark::kMillisecond);
BENCHMARK(one_nl_means)->Arg(1)->Arg(3)->Unit(benchmark::kMillisecond);
BENCHMARK(one_polynomials)->ArgsProduct({{2, 4, 6}, {48, 192}});
BENCHMARK_CAPTURE(whole_iicv, default, IicvOptions())->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(whole_iicv, paper, IicvOptions::paper())->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(one_published_iicv)
    ->Args({6, 11, 12})
    ->Args({12, 11, 12})
    ->Args({25, 11, 12})
    ->Args({50, 21, 12})
    ->Args({100, 21, 12})
    ->Args({25, 11, 4})
    ->Args({25, 11, 24})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(whole_calibrated)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(filter_paper)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(filter_exact)->Arg(7)->Arg(15)->Arg(31)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(whole_dependent_tests, default, DependentTestsOptions())
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(whole_dependent_tests, paper, DependentTestsOptions::paper())
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(whole_cv_baseline)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(one_cv_baseline)->Unit(benchmark::kMillisecond);
BENCHMARK(one_iduw)->Unit(benchmark::kMillisecond);
BENCHMARK(whole_iduw)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace covary
