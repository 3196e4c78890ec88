// SPDX-License-Identifier: Apache-2.0
#include "weighing/convolution.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/error.h"
#include "core/parallel.h"
#include "filters/lanes.h"

namespace covary {
namespace {

using namespace lanes;

/// Vectors of pixels of a row whose sums are kept in registers, beside those of kOutputsAtOnce outputs.
constexpr int kVectors = 3;

int rounded_up(int outputs) { return (outputs + kOutputsAtOnce - 1) / kOutputsAtOnce * kOutputsAtOnce; }

std::vector<float> read_halves(std::string_view& bytes, size_t n) {
  COVARY_CHECK(bytes.size() >= 2 * n, "enough weights");
  std::vector<float> values(n);
  for (size_t i = 0; i < n; ++i) {
    uint16_t half;
    std::memcpy(&half, bytes.data() + 2 * i, 2);
    values[i] = from_half(half);
  }
  bytes.remove_prefix(2 * n);
  return values;
}

/// The sums of outputs first … at pixels x … of row y.
template <int n_vectors>
void sum_block(const Convolution& layer, const std::array<const Planes*, 2>& sources, int first, int x, int y,
               vfloat (&sums)[kOutputsAtOnce][n_vectors]) {
  for (int o = 0; o < kOutputsAtOnce; ++o)
    for (int v = 0; v < n_vectors; ++v) sums[o][v] = splat(layer.offsets[static_cast<size_t>(first + o)]);
  const int outputs = rounded_up(layer.outputs), reach = layer.side / 2;
  const float* weights = layer.weights.data() + first;
  for (const Planes* source : sources) {
    if (!source) break;
    for (int i = 0; i < source->count(); ++i)
      for (int dy = -reach; dy <= reach; ++dy) {
        const float* row = source->row(i, y + dy) + x;
        for (int dx = -reach; dx <= reach; ++dx, weights += outputs) {
          vfloat in[n_vectors];
          for (int v = 0; v < n_vectors; ++v) in[v] = load(row + dx + v * kLanes);
          for (int o = 0; o < kOutputsAtOnce; ++o) {
            const vfloat weight = splat(weights[o]);
            for (int v = 0; v < n_vectors; ++v) sums[o][v] = fma(weight, in[v], sums[o][v]);
          }
        }
      }
  }
}

template <int n_vectors>
void write_block(const Convolution& layer, const std::array<const Planes*, 2>& sources, bool is_positive, int x, int y,
                 Planes& result) {
  const int n = std::min(n_vectors * kLanes, result.width() - x);
  for (int first = 0; first < layer.outputs; first += kOutputsAtOnce) {
    vfloat sums[kOutputsAtOnce][n_vectors];
    sum_block(layer, sources, first, x, y, sums);
    for (int o = 0; o < std::min(kOutputsAtOnce, layer.outputs - first); ++o) {
      float values[n_vectors * kLanes];
      for (int v = 0; v < n_vectors; ++v)
        store(values + v * kLanes, is_positive ? max(sums[o][v], vfloat{}) : sums[o][v]);
      std::copy_n(values, n, result.row(first + o, y) + x);
    }
  }
}

}  // namespace

float from_half(uint16_t half) {
  const uint32_t sign = static_cast<uint32_t>(half & 0x8000) << 16, exponent = half >> 10 & 31, fraction = half & 1023;
  if (exponent == 0) return std::bit_cast<float>(sign | std::bit_cast<uint32_t>(std::ldexp(float(fraction), -24)));
  const uint32_t wide = exponent == 31 ? 255 : exponent + 112;
  return std::bit_cast<float>(sign | wide << 23 | fraction << 13);
}

Convolution read_convolution(std::string_view& bytes, int side, int inputs, int outputs) {
  const int padded = rounded_up(outputs), squares = side * side;
  Convolution layer{side, inputs, outputs, {}, {}};
  layer.weights.resize(static_cast<size_t>(squares) * inputs * padded);
  const std::vector<float> weights = read_halves(bytes, static_cast<size_t>(squares) * inputs * outputs);
  for (int place = 0; place < squares; ++place)
    for (int i = 0; i < inputs; ++i)
      std::copy_n(&weights[static_cast<size_t>(place * inputs + i) * outputs], outputs,
                  &layer.weights[static_cast<size_t>(i * squares + place) * padded]);
  layer.offsets = read_halves(bytes, static_cast<size_t>(outputs));
  layer.offsets.resize(static_cast<size_t>(padded));
  return layer;
}

Planes convolved(const Convolution& layer, std::array<const Planes*, 2> sources, bool is_positive) {
  const int width = sources[0]->width(), height = sources[0]->height();
  COVARY_CHECK(sources[0]->count() + (sources[1] ? sources[1]->count() : 0) == layer.inputs, "a plane for each input");
  Planes result(width, height, layer.outputs, 1, 0);
  parallel_for(height, 2, [&](int y) {
    int x = 0;
    for (; x + kVectors * kLanes <= width; x += kVectors * kLanes)
      write_block<kVectors>(layer, sources, is_positive, x, y, result);
    for (; x < width; x += kLanes) write_block<1>(layer, sources, is_positive, x, y, result);
  });
  return result;
}

Planes halved(const Planes& planes) {
  const int width = planes.width() / 2, height = planes.height() / 2;
  Planes result(width, height, planes.count(), 1, 0);
  parallel_for(height, 8, [&](int y) {
    for (int c = 0; c < planes.count(); ++c) {
      const float *above = planes.row(c, 2 * y), *below = planes.row(c, 2 * y + 1);
      float* row = result.row(c, y);
      for (int x = 0; x < width; ++x)
        row[x] = 0.25f * ((above[2 * x] + above[2 * x + 1]) + (below[2 * x] + below[2 * x + 1]));
    }
  });
  return result;
}

Planes doubled(const Planes& planes) {
  Planes result(2 * planes.width(), 2 * planes.height(), planes.count(), 1, 0);
  parallel_for(result.height(), 8, [&](int y) {
    for (int c = 0; c < planes.count(); ++c) {
      const float* from = planes.row(c, y / 2);
      float* row = result.row(c, y);
      for (int x = 0; x < result.width(); ++x) row[x] = from[x / 2];
    }
  });
  return result;
}

}  // namespace covary
