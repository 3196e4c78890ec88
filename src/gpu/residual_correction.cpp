// SPDX-License-Identifier: Apache-2.0
#include "gpu/residual_correction.h"

#include <fmt/format.h>

#include <utility>

#include "gpu/launch.h"

namespace covary::gpu {
namespace {

constexpr const char* kFile = "residual_correction.cl";

class Correction {
 public:
  Correction(Device& device, Stages& stages, const ResidualBuffers& in, const ResidualCorrectionOptions& options,
             const Buffer<float>& estimate)
      : device_(device), stages_(stages), in_(in), options_(options), estimate_(estimate) {}

  void run() {
    const float bandwidth = options_.bandwidth * options_.bandwidth;
    {
      const auto pixels = cells(1), pairs = cells(2);
      device_.launch(kernel("correct_mixed", 1), image_of(in_.width, in_.height), kOfImage, pixels.first, pixels.second,
                     pairs.first, pairs.second, *in_.valid, *in_.std_error, in_.width, in_.height, options_.window / 4,
                     options_.window / 2 / 2, bandwidth, estimate_);
    }
    const auto wide = cells(kResidualCell);
    device_.launch(kernel("correct_again", kResidualCell), image_of(in_.width, in_.height), kOfImage, wide.first,
                   wide.second, *in_.valid, *in_.std_error, in_.width, in_.height, options_.window / 2 / kResidualCell,
                   bandwidth, estimate_);
  }

 private:
  device::Kernel kernel(const char* name, int side) {
    return stages_.kernel(kFile, name, {fmt::format("SIDE={}", side)});
  }
  /// Of side x side pixels: guides and residuals.
  std::pair<Buffer<float>, Buffer<float>> cells(int side) {
    const int columns = (in_.width + side - 1) / side, rows = (in_.height + side - 1) / side;
    const size_t size = 4 * static_cast<size_t>(columns) * rows;
    std::pair<Buffer<float>, Buffer<float>> made{device_.make<float>(size), device_.make<float>(size)};
    device_.launch(kernel("residual_cells", side), image_of(columns, rows), kOfImage, estimate_, *in_.valid, *in_.guide,
                   *in_.other, in_.width, in_.height, made.first, made.second);
    return made;
  }

  Device& device_;
  Stages& stages_;
  const ResidualBuffers& in_;
  const ResidualCorrectionOptions& options_;
  const Buffer<float>& estimate_;
};

}  // namespace

ResidualInput residual_input(Device& device, const Buffer<float>& mean, const Buffer<float>& variance_of_mean,
                             const Buffer<float>& relative_counts) {
  const size_t pixels = mean.size() / 3;
  ResidualInput result{device.make<float>(4 * pixels), device.make<float>(4 * pixels)};
  const Buffer<float>& counts = relative_counts ? relative_counts : mean;  // not read without them
  device.launch(device.kernel(kFile, "residual_input", with_bug({"SIDE=1"}, false)), list_of(pixels), kOfList, mean,
                variance_of_mean, counts, int{static_cast<bool>(relative_counts)}, static_cast<int>(pixels),
                result.guide, result.other);
  return result;
}

void correct_residual(Device& device, Stages& stages, const ResidualBuffers& in,
                      const ResidualCorrectionOptions& options, const Buffer<float>& estimate) {
  Correction(device, stages, in, options, estimate).run();
}

}  // namespace covary::gpu
