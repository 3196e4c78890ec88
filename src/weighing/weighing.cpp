// SPDX-License-Identifier: Apache-2.0
#include "weighing/weighing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "core/parallel.h"
#include "weighing/embedded.h"

namespace covary {
namespace {

constexpr int kSmall = 24, kMiddle = 28, kLarge = 40;  // outputs of the layers by size of cells
constexpr int kMultiple = kWeighingRows / kWeighedCell;

/// Powers of four of y / 2 + sqrt(y^2 / 4 + 1) over their sum, in place.
void share_out(Planes& planes) {
  parallel_for(planes.height(), 8, [&](int y) {
    for (int x = 0; x < planes.width(); ++x) {
      float sum = 0;
      for (int k = 0; k < planes.count(); ++k) {
        float& value = planes.row(k, y)[x];
        float power = 0.5f * value + std::sqrt(0.25f * value * value + 1);
        power *= power, power *= power;
        value = power, sum += power;
      }
      for (int k = 0; k < planes.count(); ++k) planes.row(k, y)[x] /= sum;
    }
  });
}

}  // namespace

WeighingNetwork::WeighingNetwork(std::string_view bytes, int candidates) {
  const auto add = [&](int side, int inputs, int outputs) {
    layers_.push_back(read_convolution(bytes, side, inputs, outputs));
  };
  add(1, n_weighing_features(candidates), kSmall);
  add(3, kSmall, kSmall);
  add(3, kSmall, kMiddle), add(3, kMiddle, kMiddle);
  add(3, kMiddle, kLarge), add(3, kLarge, kLarge);
  add(3, kLarge + kMiddle, kMiddle);
  add(3, kMiddle + kSmall, kSmall);
  add(1, kSmall, candidates + 1);
  COVARY_CHECK(bytes.empty(), "the weights of all layers");
}

const WeighingNetwork* WeighingNetwork::find(std::span<const std::string> names) {
  constexpr std::array<std::string_view, 4> kFilters = {"regression", "sharp", "smooth", "demodulated"};
  if (!std::ranges::equal(names, kFilters)) return nullptr;
  static const WeighingNetwork network(weighing_files::of_filters_f16, static_cast<int>(kFilters.size()));
  return &network;
}

Planes WeighingNetwork::shares(const WeighingInput& input) const {
  using enum WeighingLayer;
  const auto layer = [&](WeighingLayer i, const Planes& first, const Planes* second = nullptr) {
    return convolved(layers_[static_cast<size_t>(i)], {&first, second}, i != kOut);
  };
  const Planes a = layer(kA, layer(kMix, weighing_features(input, kMultiple)));
  const Planes b = layer(kB2, layer(kB, halved(a)));
  Planes up = doubled(layer(kC2, layer(kC, halved(b))));
  up = doubled(layer(kD, up, &b));
  Planes result = layer(kOut, layer(kE, up, &a));
  share_out(result);
  return result;
}

float PixelShares::at(int image, int x, int y) const {
  const auto place = [](int i, int n, int& near, int& far) {
    near = i / kWeighedCell;
    far = std::clamp(i % kWeighedCell == 0 ? near - 1 : near + 1, 0, n - 1);
  };
  int x0, x1, y0, y1;
  place(x, cells_.width(), x0, x1), place(y, cells_.height(), y0, y1);
  const float *near = cells_.row(image, y0), *far = cells_.row(image, y1);
  return 0.75f * (0.75f * near[x0] + 0.25f * near[x1]) + 0.25f * (0.75f * far[x0] + 0.25f * far[x1]);
}

Image weighed(const WeighingInput& input, const Planes& shares) {
  Image result(input.mean->width, input.mean->height, 3);
  const PixelShares pixels(shares);
  parallel_for(result.height, 8, [&](int y) {
    for (int x = 0; x < result.width; ++x) {
      std::array<float, 3> sum{};
      for (int k = 0; k < shares.count(); ++k) {
        const float* rgb = (k == 0 ? *input.mean : input.candidates[static_cast<size_t>(k) - 1]).pixel(x, y);
        const float share = pixels.at(k, x, y);
        for (size_t c = 0; c < 3; ++c) sum[c] += share * rgb[c];
      }
      std::copy_n(sum.begin(), 3, result.pixel(x, y));
    }
  });
  return result;
}

Image share_of(const Planes& shares, int image, const Image& weight) {
  Image result(weight.width, weight.height, 1);
  const PixelShares pixels(shares);
  parallel_for(result.height, 8, [&](int y) {
    for (int x = 0; x < result.width; ++x) *result.pixel(x, y) = *weight.pixel(x, y) * pixels.at(image, x, y);
  });
  return result;
}

}  // namespace covary
