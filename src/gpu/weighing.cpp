// SPDX-License-Identifier: Apache-2.0
#include "gpu/weighing.h"

#include <fmt/format.h>

#include <span>

#include "gpu/launch.h"

namespace covary::gpu {
namespace {

bool has_surfaces(const SurfaceBuffers& surfaces) { return surfaces.albedo && surfaces.normal; }

/// An item for each cell of `count` planes.
device::Range planes_of(int columns, int rows, int count) {
  return {static_cast<uint32_t>(columns), static_cast<uint32_t>(rows), static_cast<uint32_t>(count)};
}

}  // namespace

Weighing::Weighing(Device& device, const WeighingNetwork& network)
    : device_(device), candidates_(network.candidates()) {
  for (const Convolution& layer : network.layers())
    layers_.push_back({layer, device.upload(std::span(layer.weights)), device.upload(std::span(layer.offsets))});
}

device::Kernel Weighing::kernel(const char* name, const WeighingBuffers& in, int side) const {
  return device_.kernel("weighing.cl", name,
                        with_bug({fmt::format("M={}", candidates_), fmt::format("SIDE={}", side),
                                  fmt::format("SURFACES={}", int{has_surfaces(in.surfaces)})},
                                 in.planted_bug));
}

Weighing::Cells Weighing::make(int columns, int rows, int count) const {
  return {columns, rows, count, device_.make<float>(static_cast<size_t>(columns) * rows * count)};
}

Weighing::Cells Weighing::features_of(const WeighingBuffers& in) const {
  const auto cells = [](int pixels) {
    constexpr int kMultiple = kWeighingRows / kWeighedCell;
    return ((pixels + 1) / kWeighedCell + kMultiple - 1) / kMultiple * kMultiple;
  };
  Cells result = make(cells(in.width), cells(in.height), n_weighing_features(candidates_));
  const SurfaceBuffers& s = in.surfaces;
  const bool has_any = has_surfaces(s), has_second = s.albedo_behind && s.normal_behind;
  const Buffer<float>&albedo = has_any ? *s.albedo : *in.mean, &normal = has_any ? *s.normal : *in.mean;
  device_.launch(kernel("weighing_features", in), image_of(result.columns, result.rows), kOfImage, *in.mean,
                 *in.candidates, *in.std_error, albedo, normal, has_second ? *s.albedo_behind : albedo,
                 has_second ? *s.normal_behind : normal, in.width, in.height, result.columns, result.rows,
                 result.values);
  return result;
}

Weighing::Cells Weighing::shares_of(const WeighingBuffers& in) const {
  const auto layer = [&](WeighingLayer number, const Cells& first, const Cells* second = nullptr) {
    const Layer& l = layers_[static_cast<size_t>(number)];
    Cells result = make(first.columns, first.rows, l.shape.outputs);
    const int blocks = (l.shape.outputs + kOutputsAtOnce - 1) / kOutputsAtOnce;
    device_.launch(kernel("convolve", in, l.shape.side), planes_of(first.columns, first.rows, blocks), kOfImage,
                   first.values, first.count, second ? second->values : first.values, second ? second->count : 0,
                   l.weights, l.offsets, l.shape.outputs, int{number != WeighingLayer::kOut}, first.columns, first.rows,
                   result.values);
    return result;
  };
  const auto resized = [&](const char* how, const Cells& from, int columns, int rows) {
    Cells result = make(columns, rows, from.count);
    device_.launch(kernel(how, in), planes_of(columns, rows, from.count), kOfImage, from.values, columns, rows,
                   result.values);
    return result;
  };
  const auto halved = [&](const Cells& c) { return resized("halve", c, c.columns / 2, c.rows / 2); };
  const auto doubled = [&](const Cells& c) { return resized("repeat", c, 2 * c.columns, 2 * c.rows); };

  using enum WeighingLayer;
  const Cells a = layer(kA, layer(kMix, features_of(in)));
  const Cells b = layer(kB2, layer(kB, halved(a)));
  Cells up = doubled(layer(kC2, layer(kC, halved(b))));
  up = doubled(layer(kD, up, &b));
  Cells result = layer(kOut, layer(kE, up, &a));
  const int n = result.columns * result.rows;
  device_.launch(kernel("share_out", in), list_of(static_cast<size_t>(n)), kOfList, n, result.values);
  return result;
}

WeighingCells Weighing::add_weighed(const WeighingBuffers& in) const {
  Cells shares = shares_of(in);
  device_.launch(kernel("weigh", in), image_of(in.width, in.height), kOfImage, *in.mean, shares.values, in.width,
                 in.height, shares.columns, shares.rows, *in.candidates);
  return shares;
}

Buffer<float> Weighing::share_weight(const WeighingCells& shares, const WeighingBuffers& in,
                                     const Buffer<float>& weights) const {
  auto shared = device_.make<float>(static_cast<size_t>(candidates_) * in.width * in.height);
  device_.launch(kernel("share_weight", in), image_of(in.width, in.height), kOfImage, shares.values, weights, in.width,
                 in.height, shares.columns, shares.rows, shared);
  return shared;
}

}  // namespace covary::gpu
