// SPDX-License-Identifier: Apache-2.0
#include "gpu/regression.h"

#include <fmt/format.h>

#include <algorithm>

#include "gpu/launch.h"

namespace covary::gpu {
namespace {

constexpr const char* kFile = "regression.cl";
/// As in kernels/regression.cl.
constexpr int kRadius = 10, kWindow = 441;
constexpr uint32_t kItems = 128;

}  // namespace

FeatureBuffer features_of(device::Device& device, const std::vector<const device::Buffer<float>*>& images,
                          const device::Buffer<float>* position) {
  std::vector<const device::Buffer<float>*> all = images;
  if (position) all.push_back(position);
  FeatureBuffer result{{}, 3 * static_cast<int>(all.size()), position != nullptr};
  const size_t pixels = all[0]->size() / 3;
  result.values = device.make<float>(pixels * result.count);
  const device::Kernel kernel =
      device.kernel(kFile, "set_features", with_bug({"TERMS=6", "FIRST_OF_POSITION=6"}, false));
  for (size_t i = 0; i < all.size(); ++i)
    device.launch(kernel, list_of(pixels), kOfList, *all[i], 3 * static_cast<int>(i), result.count,
                  static_cast<int>(pixels), result.values);
  return result;
}

void regressed(device::Device& device, const RegressionBuffers& in, const device::Buffer<float>& result) {
  const int step = in.coarse ? 4 : 3, terms = 3 + in.features->count;
  const std::vector<std::string> definitions =
      with_bug({fmt::format("TERMS={}", terms),
                fmt::format("FIRST_OF_POSITION={}", in.features->has_position ? terms - 3 : terms)},
               in.planted_bug);
  const int columns = (in.width + step - 1) / step, rows = (in.height + step - 1) / step;
  const size_t weights_at_once = std::min<size_t>(in.weights_at_once, device.info().memory / (16 * sizeof(float)));
  const int most = static_cast<int>(weights_at_once / (static_cast<size_t>(columns) * kWindow));
  const int rows_at_once = std::clamp(most, 1, rows);
  const size_t windows = static_cast<size_t>(columns) * rows_at_once,
               pixels = static_cast<size_t>(in.width) * in.height;
  const auto weights = device.make<float>(windows * kWindow), models = device.make<float>(windows * 3 * terms);
  const auto sums = device.make<float>(4 * pixels);
  device.launch(device.kernel(kFile, "clear", definitions), list_of(4 * pixels), kOfList, static_cast<int>(4 * pixels),
                sums);
  const device::Kernel fit = device.kernel(kFile, "fit_windows", definitions);
  const device::Kernel predict = device.kernel(kFile, "add_predictions", definitions);
  for (int row = 0; row < rows; row += rows_at_once) {
    const int n = std::min(rows_at_once, rows - row);
    device.launch(fit, {static_cast<uint32_t>(columns) * kItems, static_cast<uint32_t>(n)}, {kItems}, *in.image,
                  in.source ? *in.source : *in.image, *in.std_error, *in.valid, in.features->values, in.width,
                  in.height, step, row, columns, weights, models);
    const int first_y = std::max(0, step * row + 1 - kRadius);
    const int end_y = std::min(in.height, step * (row + n - 1) + 2 + kRadius);
    device.launch(predict, image_of(in.width, end_y - first_y), kOfImage, weights, models, in.features->values,
                  in.width, in.height, step, row, n, columns, first_y, sums);
  }
  device.launch(device.kernel(kFile, "finish_regression", definitions), list_of(pixels), kOfList, sums,
                *in.other.buffer, static_cast<int>(in.other.first), *in.valid, static_cast<int>(pixels), result);
}

}  // namespace covary::gpu
