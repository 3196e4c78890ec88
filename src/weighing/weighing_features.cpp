// SPDX-License-Identifier: Apache-2.0
#include "weighing/weighing_features.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"

namespace covary {
namespace {

constexpr int kPixels = kWeighedCell * kWeighedCell;
constexpr float kMinBrightness = 1e-10f, kMaxSquare = 1e6f;

using Colours = std::array<std::array<float, 3>, kPixels>;

/// The pixels of a cell; beyond the image, those of its edge.
Colours cell_of(const Image& image, int x, int y) {
  Colours cell;
  for (int i = 0; i < kPixels; ++i) {
    const int px = std::min(kWeighedCell * x + i % kWeighedCell, image.width - 1);
    const int py = std::min(kWeighedCell * y + i / kWeighedCell, image.height - 1);
    std::copy_n(image.pixel(px, py), 3, cell[static_cast<size_t>(i)].begin());
  }
  return cell;
}

/// From squares of any size to [-1, 1).
float rooted(float square) {
  const float root = std::sqrt(std::sqrt(std::min(square, kMaxSquare)));
  return 2 * root / (root + 0.3f) - 1;
}

std::array<float, 3> mean_of(const Colours& cell) {
  std::array<float, 3> mean{};
  for (const std::array<float, 3>& colour : cell)
    for (size_t c = 0; c < 3; ++c) mean[c] += colour[c];
  for (float& value : mean) value /= kPixels;
  return mean;
}

/// Mean square of the differences times `scale`.
float mean_square(const Colours& a, const Colours& b, float scale) {
  float sum = 0;
  for (size_t i = 0; i < kPixels; ++i)
    for (size_t c = 0; c < 3; ++c) {
      const float difference = scale * (a[i][c] - b[i][c]);
      sum += difference * difference;
    }
  return sum / (3 * kPixels);
}

/// The mean in every pixel.
Colours spread_over(const std::array<float, 3>& mean) {
  Colours cell;
  cell.fill(mean);
  return cell;
}

/// Mean brightness of the cells, with the cells of the edge repeated around.
Planes brightness_of(const Image& image, int width, int height) {
  Planes result(width, height, 1, 1, 0);
  parallel_for(height + 2, 8, [&](int row) {
    const int y = row - 1;
    for (int x = -1; x <= width; ++x) {
      float sum = 0;
      const Colours cell = cell_of(image, std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1));
      for (const std::array<float, 3>& rgb : cell) sum += std::max((rgb[0] + rgb[1] + rgb[2]) / 3, 0.0f);
      result.row(0, y)[x] = sum / kPixels;
    }
  });
  return result;
}

float around(const Planes& brightness, int x, int y) {
  float sum = 0;
  for (int j = y - 1; j <= y + 1; ++j)
    for (int i = x - 1; i <= x + 1; ++i) sum += brightness.row(0, j)[i];
  return std::max(sum / 9, kMinBrightness);
}

/// Appends features of a cell.
class Features {
 public:
  Features(Planes& planes, int x, int y) : planes_(planes), x_(x), y_(y) {}
  void add(float value) { planes_.row(plane_++, y_)[x_] = value; }

 private:
  Planes& planes_;
  const int x_, y_;
  int plane_ = 0;
};

void add_difference(const Colours& image, const Colours& base, float inverse, Features& features) {
  float sum = 0;
  for (size_t i = 0; i < kPixels; ++i)
    for (size_t c = 0; c < 3; ++c) sum += (image[i][c] - base[i][c]) * inverse;
  const float signed_mean = 4 * (sum / (3 * kPixels));
  features.add(signed_mean / (1 + std::abs(signed_mean)));
  features.add(rooted(mean_square(image, base, inverse)));
}

void add_surfaces(const WeighingSurfaces& surfaces, int x, int y, Features& features) {
  if (!surfaces.albedo) {
    for (int i = 0; i < 10; ++i) features.add(0);
    return;
  }
  const Colours second[2] = {cell_of(*surfaces.denoising_albedo, x, y), cell_of(*surfaces.denoising_normal, x, y)};
  const Colours first[2] = {cell_of(*surfaces.albedo, x, y), cell_of(*surfaces.normal, x, y)};
  for (const Colours& cell : second)
    for (const float value : mean_of(cell)) features.add(value);
  for (const Colours& cell : second) features.add(std::sqrt(mean_square(cell, spread_over(mean_of(cell)), 1)));
  features.add(std::sqrt(mean_square(second[0], first[0], 1) + mean_square(second[1], first[1], 1)));
  features.add(1);
}

void add_cell(const WeighingInput& in, float local, int x, int y, Features& features) {
  const float inverse = 1 / local;
  const Colours base = cell_of(in.candidates[0], x, y), black{};
  add_difference(cell_of(*in.mean, x, y), base, inverse, features);
  for (size_t k = 1; k < in.candidates.size(); ++k)
    add_difference(cell_of(in.candidates[k], x, y), base, inverse, features);
  features.add(rooted(mean_square(cell_of(*in.std_error, x, y), black, inverse)));
  const std::array<float, 3> mean = mean_of(base);
  for (const float value : mean) {
    const float ratio = std::max(value, 0.0f) * inverse;
    features.add(ratio / (1 + ratio));
  }
  features.add(rooted(mean_square(base, spread_over(mean), inverse)));
  add_surfaces(in.surfaces, x, y, features);
}

}  // namespace

Planes weighing_features(const WeighingInput& in, int multiple) {
  const int width = (in.mean->width + 1) / kWeighedCell, height = (in.mean->height + 1) / kWeighedCell;
  const auto padded = [&](int n) { return (n + multiple - 1) / multiple * multiple; };
  const Planes brightness = brightness_of(in.candidates[0], width, height);
  Planes planes(padded(width), padded(height), n_weighing_features(static_cast<int>(in.candidates.size())), 0, 0);
  parallel_for(planes.height(), 4, [&](int y) {
    const int row = std::min(y, height - 1);
    for (int x = 0; x < planes.width(); ++x) {
      const int column = std::min(x, width - 1);
      Features features(planes, x, y);
      add_cell(in, around(brightness, column, row), column, row, features);
    }
  });
  return planes;
}

}  // namespace covary
