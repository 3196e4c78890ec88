// SPDX-License-Identifier: Apache-2.0
// Checks the images of a device against the processor's and times each stage, transfers apart. Run by `measure` beside
// this file. The images are made up: noise around a smooth picture, as in the tests.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/random.h"
#include "core/stopwatch.h"
#include "denoising/candidates.h"
#include "denoising/denoising_parts.h"
#include "denoising/mixed_denoising.h"
#include "denoising/weighed_candidate.h"
#include "gpu/control_variates.h"
#include "gpu/iduw.h"
#include "gpu/mixed_denoising.h"

namespace covary {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kGroups = 12;

struct Images {
  int width, height;
  std::vector<float> crn, independent;
  Image albedo, normal;
  GroupedImage view(const std::vector<float>& data) const { return {width, height, kGroups, data.data()}; }

  Images(int w, int h) : width(w), height(h), albedo(w, h, 3), normal(w, h, 3) {
    const size_t n = static_cast<size_t>(w) * h * kGroups * 3;
    crn.resize(n), independent.resize(n);
    uint64_t state = 1;
    const auto noise = [&state] {
      state = mix64(state + 0x9e3779b97f4a7c15u);
      return static_cast<float>(state >> 40) * 0x1p-24f - 0.5f;
    };
    std::vector<float> common(kGroups * 3);
    for (float& v : common) v = noise();
    for (size_t i = 0; i < n; ++i) {
      const size_t pixel = i / (kGroups * 3), element = i % (kGroups * 3);
      const auto x = static_cast<float>(pixel % w) / static_cast<float>(w),
                 y = static_cast<float>(pixel / w) / static_cast<float>(h);
      const float expected = (x + y > 1 ? 0.3f : 1.0f) * (1.5f + std::sin(9 * x) * std::cos(7 * y));
      if (element < 3) {
        albedo.data[3 * pixel + element] = 0.3f + 0.5f * static_cast<float>((pixel % w / 16 + pixel / w / 16) % 2);
        normal.data[3 * pixel + element] = x + y > 1 ? 0.5f : -0.5f;
      }
      crn[i] = expected * (1 + 0.8f * common[element] + 0.2f * noise());
      independent[i] = expected * (1 + noise());
    }
  }
};

/// A method by name, on the device or, without one, on the processor.
struct Measured {
  std::string name;
  std::function<EstimatorResult(device::Device*, const Images&, const gpu::Trial&)> run;
};

template <typename Options, typename OnDevice, typename OnProcessor>
Measured measured(const std::string& name, const Options& options, OnDevice on_device, OnProcessor on_processor) {
  return {name, [=](device::Device* device, const Images& in, const gpu::Trial& trial) {
            const GroupedImage crn = in.view(in.crn), independent = in.view(in.independent);
            return device ? on_device(*device, crn, independent, options, trial)
                          : on_processor(crn, independent, options);
          }};
}

/// The default without a network.
EstimatorResult denoised(device::Device* device, const Images& in, const gpu::Trial& trial) {
  const GroupedImage independent = in.view(in.independent);
  const Features features{&in.albedo, &in.normal};
  const FilterKinds kinds = kinds_of_mean(false);
  if (device)
    return gpu::mix_mean(*device, {independent, features, kinds, {1, 1, false}, {}, true, false}, trial).result;
  std::vector<CandidateMaker> makers = {filtered_candidates(features, CandidateBase::kMean, kinds)};
  add_weighing_maker(features, makers);
  return denoise_by_mixture(parts_of_mean(independent), makers, DenoiseMode::kAuto, true).result;
}

std::vector<Measured> methods() {
  const auto iicv_there = [](auto&&... a) { return gpu::iicv(a...); };
  const auto iicv_here = [](auto&&... a) { return iicv(a...); };
  IicvOptions with_error;
  with_error.std_error = true;
  CvBaselineOptions baseline;
  baseline.ridge = 0.01f;
  IduwOptions of_iduw;
  of_iduw.samples = 96;
  return {measured("iicv --paper", IicvOptions::paper(), iicv_there, iicv_here),
          measured("iicv, with its error", with_error, iicv_there, iicv_here),
          measured(
              "cv-baseline", baseline, [](auto&&... a) { return gpu::cv_baseline(a...); },
              [](auto&&... a) { return cv_baseline(a...); }),
          measured(
              "iduw", of_iduw,
              [](auto& device, auto& crn, auto& independent, auto& options, auto& trial) {
                return gpu::iduw(device, crn, independent, options, nullptr, trial);
              },
              [](auto&... a) { return iduw(a...); }),
          {"mixture --oidn off, with its error", denoised}};
}

/// The fraction of values within 1e-4 of the processor's |value| + 0.01.
double agreeing(const Image& found, const Image& expected) {
  size_t n = 0;
  for (size_t i = 0; i < expected.data.size(); ++i)
    n += std::abs(found.data[i] - expected.data[i]) <= 1e-4 * (std::abs(expected.data[i]) + 0.01);
  return static_cast<double>(n) / static_cast<double>(expected.data.size());
}

/// Median of the seconds of each stage, in their order, and of the whole without waiting between stages.
Json times(device::Device& device, const Measured& method, const Images& images, double seconds) {
  gpu::Trial plain;
  const Stopwatch first;
  method.run(&device, images, plain);  // compiles kernels, allocates memory
  const double first_seconds = first.seconds();
  std::vector<std::string> order;
  std::map<std::string, std::vector<double>> stages;
  std::vector<double> whole;
  gpu::Trial timed;
  timed.timing = [&](const std::string& stage, double s) {
    if (!stages.contains(stage)) order.push_back(stage);
    stages[stage].push_back(s);
  };
  const Stopwatch watch;
  do {
    const Stopwatch one;
    method.run(&device, images, plain);
    whole.push_back(one.seconds());
    method.run(&device, images, timed);
  } while (watch.seconds() < seconds && whole.size() < 50);
  const auto median = [](std::vector<double> v) {
    std::ranges::sort(v);
    return v[v.size() / 2];
  };
  Json json{{"first_seconds", first_seconds}, {"runs", whole.size()}, {"whole_seconds", median(whole)}};
  double on_device = 0;
  for (const std::string& stage : order) {
    const double s = median(stages[stage]);
    json["stages"][stage] = s;
    if (!stage.starts_with("copy")) on_device += s;
  }
  json["device_seconds"] = on_device;
  return json;
}

void print_times(const std::string& name, const Json& times) {
  const auto ms = [](const Json& seconds) { return 1e3 * seconds.get<double>(); };
  fmt::print("| {} | {:.2f} | {:.2f} |", name, ms(times["device_seconds"]), ms(times["whole_seconds"]));
  for (const auto& [stage, seconds] : times["stages"].items()) fmt::print(" {} {:.2f};", stage, ms(seconds));
  fmt::print(" |\n");
  std::fflush(stdout);
}

/// For the least number of runs that times() makes, from the seconds of one of a small image.
double seconds_needed(double of_small, const Images& small, const Images& images) {
  constexpr int kLeastRuns = 3;
  return kLeastRuns * of_small * images.width * images.height / (static_cast<double>(small.width) * small.height);
}

int run(const std::string& name, double budget, bool large, const std::string& file) {
  const Stopwatch watch;
  device::Device device = device::Device::open(name);
  const device::DeviceInfo& info = device.info();
  fmt::print("{}, {} units, {} MiB, {}\n\n", info.text(), info.units, info.memory >> 20, info.driver);
  Json json{{"device", info.text()}, {"driver", info.driver}, {"units", info.units}, {"memory_bytes", info.memory}};
  bool good = true;
  const Images small(320, 180);
  std::map<std::string, double> seconds_of_small;
  fmt::print("| 320 x 180 | values that agree with the processor's | standard errors |\n|---|---|---|\n");
  for (const Measured& method : methods()) {
    const EstimatorResult found = method.run(&device, small, {}), expected = method.run(nullptr, small, {});
    const Stopwatch once_more;  // with kernels that are compiled
    method.run(&device, small, {});
    seconds_of_small[method.name] = once_more.seconds();
    const double values = agreeing(found.estimate, expected.estimate);
    const double errors = expected.std_error.data.empty() ? 1 : agreeing(found.std_error, expected.std_error);
    good = good && values >= 0.999 && errors >= 0.999;
    fmt::print("| {} | {:.3f} % | {} |\n", method.name, 100 * values,
               expected.std_error.data.empty() ? "none" : fmt::format("{:.3f} %", 100 * errors));
    std::fflush(stdout);
    json["agreement"][method.name] = {{"values", values}, {"standard_errors", errors}};
  }
  for (const auto& [width, height] : {std::pair{1280, 720}, {3840, 2160}}) {
    if (!large && width > 1280) continue;
    const Images images(width, height);
    const std::string size = fmt::format("{} x {}", width, height);
    fmt::print("\n| {}, {} + {} groups | on the device, ms | with transfers, ms | stages, ms |\n|---|---|---|---|\n",
               size, kGroups, kGroups);
    for (const Measured& method : methods()) {
      const double needed = seconds_needed(seconds_of_small[method.name], small, images);
      if (watch.seconds() + needed > budget) {
        fmt::print("| {} | left out | | it would take about {:.0f} s |\n", method.name, needed);
        json["left_out"][size].push_back(method.name);
        continue;
      }
      const Json measured = times(device, method, images, std::min(2.0, budget / 40));
      print_times(method.name, measured);
      json["times"][size][method.name] = measured;
    }
  }
  json["seconds"] = watch.seconds();
  std::ofstream(file) << json.dump(2) << "\n";
  fmt::print("\n{} in {:.0f} s; {}\n", good ? "images agree" : "IMAGES DIFFER", watch.seconds(), file);
  return good ? 0 : 1;
}

}  // namespace
}  // namespace covary

/// DEVICE SECONDS JSON [small]
int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr, "usage: gpu_measure DEVICE SECONDS JSON [small]\n");
    return 2;
  }
  try {
    return covary::run(argv[1], std::atof(argv[2]), argc < 5, argv[3]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "gpu_measure: {}\n", error.what());
    return 1;
  }
}
