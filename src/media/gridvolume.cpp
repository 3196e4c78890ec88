// SPDX-License-Identifier: Apache-2.0
// gridvolume: values on a grid, read from Mitsuba's volume files.
//
// | name          | type      | default   | meaning                                                              |
// |---------------|-----------|-----------|----------------------------------------------------------------------|
// | filename      | string    | required  | one or three channels of 32-bit floats                               |
// | to_world      | transform | identity  | moves the unit cube, over which the grid lies                        |
// | use_grid_bbox | boolean   | false     | the grid lies over the box that the file names                       |
// | filter_type   | string    | trilinear | or nearest                                                           |
// | wrap_mode     | string    | clamp     | or repeat, mirror, zero (our own): of what lies outside              |
// | raw, accel    | boolean   |           | accepted, no effect                                                  |
#include <algorithm>
#include <cmath>
#include <utility>

#include "media/registry.h"
#include "media/volume_file.h"
#include "scene/embedded_data.h"

namespace covary {
namespace {

enum class Wrap { kClamp, kRepeat, kMirror, kZero };

class GridVolume final : public Volume {
 public:
  GridVolume(VolumeFile file, const Transform& to_world, bool nearest, Wrap wrap)
      : file_(std::move(file)),
        to_grid_(to_world.inverse()),
        bounds_(to_world.bounds({{0, 0, 0}, {1, 1, 1}})),
        largest_(-kInfinity),
        smallest_(kInfinity),
        nearest_(nearest),
        wrap_(wrap) {
    const size_t n = file_.values.size() / static_cast<size_t>(file_.channels);
    for (size_t cell = 0; cell < n; ++cell) {
      const Spectrum v = value(cell);
      for (int c = 0; c < 3; ++c)
        largest_[c] = std::max(largest_[c], v[c]), smallest_[c] = std::min(smallest_[c], v[c]);
    }
    for (int c = 0; wrap_ == Wrap::kZero && c < 3; ++c) smallest_[c] = std::min(smallest_[c], 0.0f);
  }

  Spectrum eval(const Vec3& p) const override {
    // Cell i along an axis is centred at (i + 1/2) / size, like texels.
    const Vec3 local = to_grid_.point(p);
    if (wrap_ == Wrap::kZero)
      for (int axis = 0; axis < 3; ++axis)
        if (!(local[axis] >= 0 && local[axis] <= 1)) return {};
    int low[3], high[3];
    float t[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int n = file_.size[axis];
      const float x = std::clamp(local[axis], -kFar, kFar) * static_cast<float>(n) - (nearest_ ? 0 : 0.5f);
      const float floor = std::floor(x);
      t[axis] = x - floor;
      low[axis] = wrapped(static_cast<int64_t>(floor), n);
      high[axis] = nearest_ ? low[axis] : wrapped(static_cast<int64_t>(floor) + 1, n);
    }
    if (nearest_) return value(cell(low[0], low[1], low[2]));
    const auto at = [&](int x, int y, int z) {
      return wrap_ == Wrap::kZero && std::min({x, y, z}) < 0 ? Spectrum() : value(cell(x, y, z));
    };
    const auto row = [&](int y, int z) { return lerp(t[0], at(low[0], y, z), at(high[0], y, z)); };
    const auto plane = [&](int z) { return lerp(t[1], row(low[1], z), row(high[1], z)); };
    return lerp(t[2], plane(low[2]), plane(high[2]));
  }
  Spectrum largest() const override { return largest_; }
  Spectrum smallest() const override { return smallest_; }
  Bounds3 bounds() const override { return bounds_; }

 private:
  static constexpr float kFar = 1e6f;  // in unit cubes; keeps indices within the range of int

  /// -1: outside.
  int wrapped(int64_t i, int n) const {
    if (wrap_ == Wrap::kZero) return i >= 0 && i < n ? static_cast<int>(i) : nearest_ ? (i < 0 ? 0 : n - 1) : -1;
    if (wrap_ == Wrap::kClamp) return static_cast<int>(std::clamp<int64_t>(i, 0, n - 1));
    const int64_t period = wrap_ == Wrap::kMirror ? 2 * int64_t{n} : n;
    const int64_t j = ((i % period) + period) % period;
    return static_cast<int>(j < n ? j : period - 1 - j);
  }
  size_t cell(int x, int y, int z) const {
    return (static_cast<size_t>(z) * static_cast<size_t>(file_.size[1]) + static_cast<size_t>(y)) *
               static_cast<size_t>(file_.size[0]) +
           static_cast<size_t>(x);
  }
  Spectrum value(size_t cell) const {
    if (file_.channels == 1) return Spectrum(file_.values[cell]);
    const float* v = &file_.values[3 * cell];
    return {v[0], v[1], v[2]};
  }

  VolumeFile file_;
  Transform to_grid_;
  Bounds3 bounds_;
  Spectrum largest_, smallest_;
  bool nearest_;
  Wrap wrap_;
};

/// Maps the unit cube to the box.
Transform over(const Bounds3& box) { return Transform::translate(box.lower) * Transform::scale(box.upper - box.lower); }

}  // namespace

std::shared_ptr<Volume> make_gridvolume(Parameters& p) {
  const std::string* data = find_embedded(p);
  const std::string path = data ? "" : p.require_file("filename");
  Transform to_world = p.get_transform("to_world");
  const bool use_box = p.get_bool("use_grid_bbox", false);
  const bool nearest = p.get_choice("filter_type", "trilinear", {"nearest", "trilinear"}) == "nearest";
  const std::string wrap = p.get_choice("wrap_mode", "clamp", {"clamp", "mirror", "repeat", "zero"});
  for (const char* ignored : {"raw", "accel"}) p.get_bool(ignored, false);
  if (path.empty() && !data) return nullptr;
  VolumeFile file = data ? parse_volume(p.object().where.text(), *data) : read_volume_file(path);
  if (use_box) {
    const Vec3 extent = file.bounds.upper - file.bounds.lower;
    if (!(std::min({extent.x, extent.y, extent.z}) > 0 && std::isfinite(length_squared(extent)))) {
      p.error_at("use_grid_bbox", "asks for the box of the file, which is empty");
      return nullptr;
    }
    to_world = to_world * over(file.bounds);
  }
  return std::make_shared<GridVolume>(std::move(file), to_world, nearest,
                                      wrap == "clamp"    ? Wrap::kClamp
                                      : wrap == "repeat" ? Wrap::kRepeat
                                      : wrap == "zero"   ? Wrap::kZero
                                                         : Wrap::kMirror);
}

}  // namespace covary
