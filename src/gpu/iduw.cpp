// SPDX-License-Identifier: Apache-2.0
#include "gpu/iduw.h"

#include <fmt/format.h>

#include <algorithm>

#include "estimators/pair_steps.h"
#include "filters/planes.h"
#include "gpu/denoising_parts.h"
#include "gpu/launch.h"

namespace covary::gpu {
namespace {

using device::Buffer;
using device::Device;

/// An image's groups on the device.
struct Groups {
  const GroupedImage& image;
  Buffer<float> data;
  Buffer<uint32_t> counts;
};

class Iduw {
 public:
  Iduw(Device& device, const GroupedImage& crn, const GroupedImage& independent, const IduwOptions& options,
       const Trial& trial)
      : device_(device),
        stages_(device, trial),
        options_(options),
        width_(crn.width),
        height_(crn.height),
        n_(static_cast<size_t>(crn.width) * crn.height) {
    stages_.run("copy there", [&] { crn_.emplace(upload(crn)), independent_.emplace(upload(independent)); });
    stages_.run("moments", [&] { find_means(); });
  }

  /// The candidate whose halves differ least.
  float best_gamma() {
    if (options_.gammas.size() == 1) return options_.gammas[0];
    const size_t n_gammas = options_.gammas.size(), n_rows = n_gammas * static_cast<size_t>(height_);
    std::vector<float> rows;
    stages_.run("losses", [&] {
      const Buffer<float> gammas = device_.upload(std::span(options_.gammas)),
                          losses = device_.make<float>(n_gammas * n_);
      const Buffer<float> sums = device_.make<float>(n_rows);
      device_.launch(kernel("iduw_losses"), image_of(width_, height_), kOfImage, y_, z_half_[0], z_half_[1], y_half_[0],
                     y_half_[1], z_quarter_[0][0], z_quarter_[0][1], z_quarter_[1][0], z_quarter_[1][1], gammas, width_,
                     height_, -static_cast<float>(options_.samples), losses);
      device_.launch(kernel("sum_rows"), list_of(n_rows), kOfList, losses, width_, static_cast<int>(n_rows), sums);
      rows = device_.download(sums);
    });
    std::vector<double> totals(n_gammas);
    for (size_t i = 0; i < n_rows; ++i) totals[i / static_cast<size_t>(height_)] += rows[i];
    return options_.gammas[std::ranges::min_element(totals) - totals.begin()];
  }

  EstimatorResult reconstruct(float gamma) {
    const Buffer<float> estimate = device_.make<float>(3 * n_);
    stages_.run("reconstruction", [&] {
      device_.launch(kernel("iduw"), image_of(width_, height_), kOfImage, z_, y_, z_half_[0], z_half_[1], width_,
                     height_, -gamma * static_cast<float>(options_.samples), estimate);
    });
    EstimatorResult result;
    stages_.run("copy back", [&] {
      result.estimate = Image(width_, height_, 3);
      device_.read(estimate, result.estimate.data);
      const std::vector<unsigned char> valid = device_.download(valid_);
      result.nonfinite_pixels = std::ranges::count(valid, 0);
      if (result.nonfinite_pixels > 0) fill_invalid(crn_->image, independent_->image, valid, result.estimate);
    });
    return result;
  }

 private:
  device::Kernel kernel(const char* name, const GroupedImage* image = nullptr) {
    return stages_.kernel(
        "iduw.cl", name,
        {fmt::format("RADIUS={}", options_.window / 2), fmt::format("GAMMAS={}", options_.gammas.size()),
         fmt::format("GROUPS={}", image ? image->groups : 1),
         fmt::format("COUNTS={}", image && image->counts ? 1 : 0)});
  }

  Groups upload(const GroupedImage& image) {
    return {image, samples_on(device_, image),
            image.counts ? device_.upload(std::span(image.counts, n_)) : device_.make<uint32_t>(1)};
  }

  Buffer<float> means(const Groups& groups, int first, int step, float invalid) {
    Buffer<float> made = device_.make<float>(3 * n_);
    device_.launch(kernel("group_means", &groups.image), list_of(n_), kOfList, groups.data, groups.counts, valid_,
                   static_cast<int>(n_), first, step, invalid, made);
    return made;
  }

  void find_means() {
    valid_ = device_.upload(std::span<const unsigned char>(std::vector<unsigned char>(n_, 1)));
    for (const Groups* groups : {&*crn_, &*independent_})
      device_.launch(kernel("find_usable", &groups->image), list_of(n_), kOfList, groups->data, static_cast<int>(n_),
                     valid_);
    // Invalid pixels get opposite values in the two halves that make a weight, so that the weight is zero.
    for (int half : {0, 1}) {
      z_half_[half] = means(*crn_, half, 2, half ? -kFar : kFar);
      y_half_[half] = means(*independent_, half, 2, 0);
      for (int quarter : {0, 1})
        z_quarter_[half][quarter] = means(*crn_, half + 2 * quarter, 4, quarter ? -kFar : kFar);
    }
    z_ = means(*crn_, 0, 1, 0);
    y_ = means(*independent_, 0, 1, 0);
  }

  Device& device_;
  Stages stages_;
  const IduwOptions& options_;
  const int width_, height_;
  const size_t n_;
  std::optional<Groups> crn_, independent_;
  Buffer<unsigned char> valid_;
  Buffer<float> z_, y_, z_half_[2], y_half_[2], z_quarter_[2][2];
};

}  // namespace

EstimatorResult iduw(Device& device, const GroupedImage& crn, const GroupedImage& independent,
                     const IduwOptions& options, float* chosen_gamma, const Trial& trial) {
  check_iduw(crn, independent, options);
  Iduw method(device, crn, independent, options, trial);
  const float gamma = method.best_gamma();
  if (chosen_gamma) *chosen_gamma = gamma;
  return method.reconstruct(gamma);
}

}  // namespace covary::gpu
