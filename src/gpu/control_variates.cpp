// SPDX-License-Identifier: Apache-2.0
#include "gpu/control_variates.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "estimators/missing_light.h"
#include "estimators/pair_steps.h"
#include "filters/relative_counts.h"
#include "gpu/bands.h"
#include "gpu/denoising_parts.h"
#include "gpu/launch.h"
#include "gpu/residual_correction.h"

namespace covary::gpu {
namespace {

using device::Buffer;
using device::Device;

std::vector<int> flat_offsets(int window) {
  std::vector<int> flat;
  for (const Offset& o : window_offsets(window)) {
    flat.push_back(o.dx);
    flat.push_back(o.dy);
  }
  return flat;
}

/// Sizes of kernels/pixel_record.h and kernels/control_variates.cl, in floats.
struct Sizes {
  Sizes(int rows, const ControlVariateSettings& s) {
    const int condition = s.mean_constraint > 0 ? 3 : 0, penalties = s.shared ? 1 : 3;
    const int size = 3 * rows + condition + 9 + 2 * penalties;
    record = (size + 7) / 8 * 8;
    const int all = (3 * rows + condition) / (s.shared ? 1 : 3), k = s.k;
    const bool primal = k <= all;
    const auto padded = [](int n) { return (n + 3) / 4 * 4; };
    const int vectors = padded(primal ? k + 1 : all);
    const int pitch = std::max(vectors, padded((primal ? k : all) + 1 +
                                               (primal && s.std_error ? condition / 3 * (s.shared ? 3 : 1) : 0))) +
                      4;
    local =
        vectors * (primal ? all : k + 1) + vectors * pitch + (9 + 2 * penalties) * (k + 1) + 4 * k + 3 * vectors + 40;
  }
  int record;
  int local;  ///< at least what a work group needs
};

class Variates {
 public:
  Variates(Device& device, const GroupedImage& crn, const GroupedImage& independent, const VariateSteps& steps,
           const Trial& trial)
      : device_(device),
        stages_(device, trial),
        crn_(crn),
        independent_(independent),
        steps_(steps),
        s_(steps.settings),
        n_(static_cast<size_t>(crn.width) * crn.height),
        weights_differ_(!relative_counts(crn).empty()),
        sizes_(weights_differ_ ? crn.groups : crn.groups - 1, s_) {
    const auto define = [&](const char* name, int value) { definitions_.push_back(fmt::format("{}={}", name, value)); };
    define("GROUPS", crn.groups);
    define("WEIGHTS_DIFFER", weights_differ_);
    define("CONDITION", s_.mean_constraint > 0);
    define("SHARED", s_.shared);
  }

  EstimatorResult run() {
    find_moments();
    find_similar();
    find_nearest();
    solve();
    if (steps_.residual_correction)
      stages_.run("residual correction", [&] {
        correct_residual(device_, stages_, {crn_.width, crn_.height, &guide_, &other_, &valid_, &std_error_},
                         steps_.residual_options, estimate_);
      });
    EstimatorResult result;
    stages_.run("copy back", [&] { read(result); });
    return result;
  }

 private:
  std::vector<std::string> with(std::initializer_list<std::pair<const char*, int>> more) const {
    std::vector<std::string> all = definitions_;
    for (const auto& [name, value] : more) all.push_back(fmt::format("{}={}", name, value));
    return all;
  }

  /// A buffer of one element where there are none.
  Buffer<uint32_t> counts_of(const GroupedImage& image) {
    return image.counts ? device_.upload(std::span(image.counts, n_)) : device_.make<uint32_t>(1);
  }

  void find_moments() {
    Buffer<float> crn, independent, relative;
    Buffer<uint32_t> crn_counts, independent_counts;
    const std::vector<float> relative_count = relative_counts(independent_);
    stages_.run("copy there", [&] {
      crn = samples_on(device_, crn_);
      independent = samples_on(device_, independent_);
      crn_counts = counts_of(crn_), independent_counts = counts_of(independent_);
      relative = relative_count.empty() ? device_.make<float>(1) : device_.upload(std::span(relative_count));
    });
    stages_.run("moments", [&] {
      valid_ = device_.make<unsigned char>(n_);
      guide_ = device_.make<float>(4 * n_), other_ = device_.make<float>(4 * n_);
      own_ = device_.make<float>(n_);
      records_ = device_.make<float>(n_ * static_cast<size_t>(sizes_.record));
      const auto kernel = stages_.kernel("pair_moments.cl", "pair_moments",
                                         with({{"INDEPENDENT_GROUPS", independent_.groups},
                                               {"CRN_COUNTS", crn_.counts != nullptr},
                                               {"INDEPENDENT_COUNTS", independent_.counts != nullptr},
                                               {"RELATIVE", !relative_count.empty()},
                                               {"HAS_ERROR", steps_.error_of_h != ErrorOfH::kNone}}));
      device_.launch(kernel, list_of(n_), kOfList, crn, independent, crn_counts, independent_counts, relative,
                     static_cast<int>(n_), valid_, guide_, other_, own_, records_);
    });
  }

  void find_similar() {
    const bool pilot = steps_.error_of_h == ErrorOfH::kPilot;
    if (!pilot && !steps_.missing_light) return;
    stages_.run("similar pixels", [&] {
      const auto kernel = stages_.kernel("similar_pixels.cl", "similar_pixels",
                                         with({{"PILOT", pilot}, {"MISSING", steps_.missing_light}}));
      device_.launch(kernel, image_of(crn_.width, crn_.height), kOfImage, guide_, other_, own_, crn_.width, crn_.height,
                     records_);
    });
  }

  void find_nearest() {
    stages_.run("nearest pixels", [&] {
      const std::vector<int> offsets = flat_offsets(s_.window);
      offsets_ = device_.upload(std::span(offsets));
      chosen_ = device_.make<uint16_t>(n_ * static_cast<size_t>(s_.k));
      const auto candidates = static_cast<unsigned>(s_.window * s_.window);
      const auto kernel = stages_.kernel("nearest.cl", "nearest",
                                         {fmt::format("K={}", s_.k), fmt::format("WINDOW={}", s_.window),
                                          fmt::format("INDEX_MASK={}", std::bit_ceil(candidates) - 1)});
      device_.launch(kernel, image_of(crn_.width, crn_.height), kOfImage, guide_, offsets_, crn_.width, crn_.height,
                     chosen_);
    });
  }

  void solve() {
    stages_.run("systems", [&] {
      estimate_ = device_.make<float>(3 * n_), std_error_ = device_.make<float>(s_.std_error ? 3 * n_ : 1);
      const auto kernel = stages_.kernel("control_variates.cl", "control_variates",
                                         with({{"K", s_.k},
                                               {"HAS_ERROR", steps_.error_of_h != ErrorOfH::kNone},
                                               {"SYMMETRIC", s_.symmetric},
                                               {"STD_ERROR", s_.std_error}}));
      constexpr uint32_t kItems = 32;  // LANES
      device_.launch(kernel, {kItems * static_cast<uint32_t>(crn_.width), static_cast<uint32_t>(crn_.height)}, {kItems},
                     records_, guide_, other_, chosen_, offsets_, crn_.width, crn_.height, s_.sample_fraction,
                     s_.mean_constraint, s_.ridge, estimate_, std_error_);
    });
  }

  void read(EstimatorResult& result) {
    result.estimate = Image(crn_.width, crn_.height, 3);
    device_.read(estimate_, result.estimate.data);
    if (steps_.std_error) {
      result.std_error = Image(crn_.width, crn_.height, 3);
      device_.read(std_error_, result.std_error.data);
    }
    const std::vector<unsigned char> valid = device_.download(valid_);
    result.nonfinite_pixels = std::ranges::count(valid, 0);
    if (result.nonfinite_pixels > 0) fill_invalid(crn_, independent_, valid, result.estimate);
  }

  Device& device_;
  Stages stages_;
  const GroupedImage& crn_;
  const GroupedImage& independent_;
  const VariateSteps& steps_;
  const ControlVariateSettings& s_;
  const size_t n_;
  const bool weights_differ_;
  const Sizes sizes_;
  std::vector<std::string> definitions_;
  Buffer<unsigned char> valid_;
  Buffer<float> guide_, other_, own_, records_, estimate_, std_error_;
  Buffer<int> offsets_;
  Buffer<uint16_t> chosen_;
};

EstimatorResult run(Device& device, const GroupedImage& crn, const GroupedImage& independent, const VariateSteps& steps,
                    const Trial& trial) {
  const ControlVariateSettings& s = steps.settings;
  const Sizes sizes(crn.groups, s);
  constexpr uint64_t kStatic = 48 << 10;  // of every GPU, without asking for more
  const uint64_t local = std::min<uint64_t>(device.info().local_memory, kStatic);
  if (sizes.local * sizeof(float) > local)
    throw device::Failure(
        device::FailureKind::kMemory,
        fmt::format("{} control variates with {} groups need {} KB of local memory; {} has {}", s.k, crn.groups,
                    sizes.local * sizeof(float) >> 10, device.info().text(), local >> 10));
  BandNeeds needs;
  const double groups = 12.0 * std::max(crn.groups, independent.groups), record = 4.0 * sizes.record;
  needs.bytes_per_pixel = 12.0 * (crn.groups + independent.groups) + record + 2.0 * s.k + 24 + 45 + 84;
  needs.largest_buffer_per_pixel = std::max({groups, record, 2.0 * s.k});
  needs.alignment = kResidualCell;
  needs.halo = s.window / 2 + kMissingWindow / 2 +
               (steps.residual_correction ? residual_correction_halo(steps.residual_options) : 0);
  const int rows =
      trial.rows_at_once > 0 ? trial.rows_at_once : rows_that_fit(device.info(), crn.width, crn.height, needs);
  EstimatorResult result = in_bands(crn, independent, needs, rows, [&](const GroupedImage& a, const GroupedImage& b) {
    return Variates(device, a, b, steps, trial).run();
  });
  // Bands overlap.
  if (result.nonfinite_pixels > 0) finite_pixels(crn, independent, result.nonfinite_pixels);
  return result;
}

}  // namespace

EstimatorResult iicv(Device& device, const GroupedImage& crn, const GroupedImage& independent,
                     const IicvOptions& options, const Trial& trial) {
  return run(device, crn, independent, steps_of(crn, independent, options), trial);
}

EstimatorResult cv_baseline(Device& device, const GroupedImage& crn, const GroupedImage& independent,
                            const CvBaselineOptions& options, const Trial& trial) {
  return run(device, crn, independent, steps_of(crn, independent, options), trial);
}

}  // namespace covary::gpu
