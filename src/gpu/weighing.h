// SPDX-License-Identifier: Apache-2.0
// The small network that weighs candidates, weighing/weighing.h, on a device.
#pragma once

#include <vector>

#include "gpu/held_out.h"
#include "weighing/weighing.h"

namespace covary::gpu {

struct WeighingBuffers {
  int width = 0, height = 0;
  const Buffer<float>* mean = nullptr;
  const Buffer<float>* candidates = nullptr;  ///< one after another, with space for one more
  const Buffer<float>* std_error = nullptr;   ///< of the mean without fireflies
  SurfaceBuffers surfaces;                    ///< without the second ones, the first are used twice
  bool planted_bug = false;
};

/// Planes of cells.
struct WeighingCells {
  int columns = 0, rows = 0, count = 0;
  Buffer<float> values;
};

/// A network's layers on a device, for so many candidates.
class Weighing {
 public:
  Weighing(Device& device, const WeighingNetwork& network);

  /// Writes the mixture that the network makes of the candidates behind them. Returns the shares in it.
  WeighingCells add_weighed(const WeighingBuffers& in) const;
  /// The weights of the candidates in a mixture of them and of that with these shares, whose weights are given.
  Buffer<float> share_weight(const WeighingCells& shares, const WeighingBuffers& in,
                             const Buffer<float>& weights) const;

 private:
  struct Layer {
    const Convolution& shape;
    Buffer<float> weights, offsets;
  };
  using Cells = WeighingCells;
  device::Kernel kernel(const char* name, const WeighingBuffers& in, int side = 1) const;
  Cells make(int columns, int rows, int count) const;
  Cells features_of(const WeighingBuffers& in) const;
  Cells shares_of(const WeighingBuffers& in) const;

  Device& device_;
  const int candidates_;
  std::vector<Layer> layers_;
};

}  // namespace covary::gpu
