// SPDX-License-Identifier: Apache-2.0
#include "sequences/reprojection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/vec.h"
#include "sequences/feature_slopes.h"

namespace covary {
namespace {

constexpr float kAtRest = 1e-3f;          // pixels
constexpr float kEdge = 0.25f;            // difference of neighbours' motions, pixels
constexpr float kOfEdges = 0.2f;          // fraction of edge_error() that counts
constexpr float kRelative = 0.01f;        // tolerance of depth, relative
constexpr float kRelativeUnknown = 0.1f;  // the same if its change is not known
constexpr int kSlopes = std::tuple_size_v<FeatureSlopes>;
constexpr float kOfSlope = 1.5f;  // tolerance of depth, relative to its change between pixels

struct Tap {
  int first;                     // index of the first of four pixels
  std::array<float, 4> weights;  // Catmull-Rom
  float part;                    // linear weight of the third pixel; the second has the rest
};

/// The tap at a position in pixels, whose centres are at + 0.5.
Tap tap(float at) {
  const float shifted = at - 0.5f, base = std::floor(shifted), t = shifted - base;
  return {static_cast<int>(base) - 1,
          {0.5f * t * (-1 + t * (2 - t)), 1 + 0.5f * t * t * (3 * t - 5), 0.5f * t * (1 + t * (4 - 3 * t)),
           0.5f * t * t * (t - 1)},
          t};
}

/// Sum over the axes of depth's smaller change to a neighbour, which is the surface's rather than an edge's.
float slope(const Image& depth, int x, int y) {
  const float here = *depth.pixel(x, y);
  const auto change = [&](int dx, int dy) {
    const int nx = x + dx, ny = y + dy;
    const bool inside = nx >= 0 && ny >= 0 && nx < depth.width && ny < depth.height;
    return inside ? std::abs(*depth.pixel(nx, ny) - here) : kInfinity;
  };
  const float along_x = std::min(change(-1, 0), change(1, 0)), along_y = std::min(change(0, -1), change(0, 1));
  return (std::isfinite(along_x) ? along_x : 0) + (std::isfinite(along_y) ? along_y : 0);
}

/// The position of a pixel's point in the previous frame.
struct Place {
  int x, y;
  bool rests;
  Tap h, v;  // horizontal and vertical; unused if it rests

  /// The pixel that it was in.
  std::array<int, 2> pixel(const Image& image) const {
    if (rests) return {x, y};
    return {std::clamp(h.first + (h.part < 0.5f ? 1 : 2), 0, image.width - 1),
            std::clamp(v.first + (v.part < 0.5f ? 1 : 2), 0, image.height - 1)};
  }

  /// The value of an image there; `difference`: minus bilinear interpolation, before clamping.
  float value(const Image& image, int c, float& difference) const {
    difference = 0;
    if (rests) return image.pixel(x, y)[c];
    float sum = 0, low = kInfinity, high = -kInfinity, linear = 0;
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const int column = std::clamp(h.first + i, 0, image.width - 1),
                  row = std::clamp(v.first + j, 0, image.height - 1);
        const float pixel = image.pixel(column, row)[c];
        sum += h.weights[i] * v.weights[j] * pixel;
        if (i == 0 || i == 3 || j == 0 || j == 3) continue;
        low = std::min(low, pixel), high = std::max(high, pixel);
        linear += (i == 2 ? h.part : 1 - h.part) * (j == 2 ? v.part : 1 - v.part) * pixel;
      }
    difference = sum - linear;
    return std::clamp(sum, low, high);
  }
};

/// Finds the points of a frame in the previous one.
class Reprojection {
 public:
  Reprojection(const Image& depth_before, const MotionLayers& now) : depth_before_(depth_before), now_(now) {}

  /// Nothing if it is unknown.
  std::optional<Place> place(int x, int y) const {
    const float* motion = now_.motion.pixel(x, y);
    if (std::abs(motion[0]) < kAtRest && std::abs(motion[1]) < kAtRest) {
      if (!is_same_depth(x, y, x, y)) return std::nullopt;
      return Place{x, y, true, {}, {}};
    }
    const int width = depth_before_.width, height = depth_before_.height;
    const float old_x = static_cast<float>(x) + 0.5f + motion[0], old_y = static_cast<float>(y) + 0.5f + motion[1];
    if (!(old_x >= 0.5f && old_y >= 0.5f && old_x < static_cast<float>(width) - 0.5f &&
          old_y < static_cast<float>(height) - 0.5f))
      return std::nullopt;
    const Tap h = tap(old_x), v = tap(old_y);
    for (const int j : {1, 2})
      for (const int i : {1, 2})
        if (!is_same_depth(x, y, std::clamp(h.first + i, 0, width - 1), std::clamp(v.first + j, 0, height - 1)))
          return std::nullopt;
    return Place{x, y, false, h, v};
  }

 private:
  bool is_same_depth(int x, int y, int old_x, int old_y) const {
    const float depth = *now_.depth.pixel(x, y), old = *depth_before_.pixel(old_x, old_y);
    if (depth == 0 || old == 0) return depth == old;
    const float expected = depth + now_.motion.pixel(x, y)[2];
    const float relative = now_.knows_depth ? kRelative : kRelativeUnknown;
    return std::abs(old - expected) <= relative * expected + kOfSlope * slope(now_.depth, x, y);
  }

  const Image& depth_before_;
  const MotionLayers& now_;
};

/// A colour and the features that belong to it.
struct Shown {
  std::array<float, 3> colour;
  std::array<float, kHistoryFeatures> features = {};
};

/// The squared difference of colours that the features do not explain, averaged over the channels.
float squared(const Shown& difference, const FeatureSlopes& slopes) {
  float squares = 0;
  for (size_t c = 0; c < 3; ++c) {
    float rest = difference.colour[c];
    for (size_t i = 0; i < kHistoryFeatures; ++i) rest -= slopes[3 * i + c] * difference.features[i];
    squares += sqr(rest) / 3;
  }
  return squares;
}

Shown operator-(Shown a, const Shown& b) {
  for (size_t c = 0; c < 3; ++c) a.colour[c] -= b.colour[c];
  for (size_t i = 0; i < kHistoryFeatures; ++i) a.features[i] -= b.features[i];
  return a;
}

/// The previous frame.
struct Before {
  const Image& picture;
  const Image& features;  // or empty

  bool has_features() const { return !features.data.empty(); }

  FeatureSlopes slopes(const Place& place) const {
    if (place.rests || !has_features()) return {};
    const auto [x, y] = place.pixel(picture);
    return feature_slopes(picture, features, x, y);
  }

  /// Its interpolated values; nothing if one is not finite. `difference`: minus bilinear interpolation.
  std::optional<Shown> at(const Place& place, Shown& difference) const {
    Shown moved;
    bool is_finite = true;
    const auto interpolate = [&](const Image& image, int c, float& value, float& of_value) {
      value = place.value(image, c, of_value);
      is_finite = is_finite && std::isfinite(value);
    };
    for (size_t c = 0; c < 3; ++c) interpolate(picture, static_cast<int>(c), moved.colour[c], difference.colour[c]);
    for (size_t i = 0; has_features() && i < kHistoryFeatures; ++i)
      interpolate(features, static_cast<int>(i), moved.features[i], difference.features[i]);
    return is_finite ? std::optional(moved) : std::nullopt;
  }
};

/// Copies the samples of the pixel where the point was: interpolation would correlate the noise of neighbouring pixels,
/// which denoisers take for detail. `moved`, the interpolated picture, minus that pixel of `before` is added. Returns
/// whether the value is finite.
bool move_samples(const Image& samples, const Image& before, const Place& place, const float* moved, float* value) {
  const auto [x, y] = place.pixel(before);
  bool finite = true;
  for (int c = 0; c < 3; ++c) {
    value[c] = samples.pixel(x, y)[c] + (moved[c] - before.pixel(x, y)[c]);
    finite = finite && std::isfinite(value[c]);
  }
  return finite;
}

/// Whether `is_so` holds for a motion in the surrounding 3 x 3 pixels that differs from that of (x, y).
template <class F>
bool any_other_motion(const Image& motion, int x, int y, const F& is_so) {
  const float* here = motion.pixel(x, y);
  for (int ny = std::max(y - 1, 0); ny <= std::min(y + 1, motion.height - 1); ++ny)
    for (int nx = std::max(x - 1, 0); nx <= std::min(x + 1, motion.width - 1); ++nx) {
      const float* there = motion.pixel(nx, ny);
      const bool is_alike = std::abs(there[0] - here[0]) <= kEdge && std::abs(there[1] - here[1]) <= kEdge;
      if (!is_alike && is_so(there)) return true;
    }
  return false;
}

/// Error from neighbours that move differently and may be visible in the pixel, too: the largest squared difference
/// between `moved` and the picture where their motions point; infinite if that is unknown, 0 if all move alike.
float edge_error(const Before& before, const Image& motion, int x, int y, const Shown& moved,
                 const FeatureSlopes& slopes) {
  float most = 0;
  any_other_motion(motion, x, y, [&](const float* there) {
    const auto within = [](float at, int size) { return std::clamp(at, 0.5f, static_cast<float>(size) - 0.5f); };
    const Place other{x, y, false, tap(within(static_cast<float>(x) + 0.5f + there[0], motion.width)),
                      tap(within(static_cast<float>(y) + 0.5f + there[1], motion.height))};
    Shown difference;
    const std::optional<Shown> shown = before.at(other, difference);
    most = shown ? std::max(most, squared(*shown - moved, slopes)) : kInfinity;
    return !shown;
  });
  return most;
}

/// Means over the 3 x 3 pixels that are inside the image.
Image smoothed(const Image& image) {
  Image result(image.width, image.height, 1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      float sum = 0, n = 0;
      for (int ny = std::max(y - 1, 0); ny <= std::min(y + 1, image.height - 1); ++ny)
        for (int nx = std::max(x - 1, 0); nx <= std::min(x + 1, image.width - 1); ++nx)
          sum += *image.pixel(nx, ny), n += 1;
      *result.pixel(x, y) = sum / n;
    }
  return result;
}

}  // namespace

bool is_motion_edge(const Image& motion, int x, int y) {
  return any_other_motion(motion, x, y, [](const float*) { return true; });
}

History reproject(const Image& before, const Image& depth_before, const MotionLayers& now,
                  const std::array<Image, 2>& samples, const Image& features) {
  const int width = now.depth.width, height = now.depth.height;
  const bool has_samples = !samples[0].data.empty();
  std::vector<const Image*> images = {&before, &depth_before, &now.motion};
  if (has_samples) images.insert(images.end(), {&samples[0], &samples[1]});
  if (!features.data.empty()) images.push_back(&features);
  for (const Image* image : images)
    if (image->width != width || image->height != height)
      throw Error(ErrorCode::kInput, "frames of a sequence differ in size");
  History history{Image(width, height, 3),
                  Image(width, height, 1),
                  std::vector<unsigned char>(static_cast<size_t>(width) * height),
                  {},
                  Image(),
                  Image()};
  if (has_samples) history.samples = {history.image, history.image};
  if (!features.data.empty())
    history.features = Image(width, height, kHistoryFeatures), history.slopes = Image(width, height, kSlopes);
  const Before picture{before, features};
  Image edges(width, height, 1);
  const Reprojection reprojection(depth_before, now);
  parallel_for(height, 4, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const std::optional<Place> place = reprojection.place(x, y);
      if (!place) continue;
      Shown difference;
      const FeatureSlopes slopes = picture.slopes(*place);
      const std::optional<Shown> moved = picture.at(*place, difference);
      if (!moved) continue;
      std::copy_n(moved->colour.begin(), 3, history.image.pixel(x, y));
      if (picture.has_features()) {
        std::copy_n(moved->features.begin(), kHistoryFeatures, history.features.pixel(x, y));
        std::copy_n(slopes.begin(), kSlopes, history.slopes.pixel(x, y));
      }
      bool known = true;
      for (size_t i = 0; has_samples && i < samples.size(); ++i)
        known = move_samples(samples[i], before, *place, history.image.pixel(x, y), history.samples[i].pixel(x, y)) &&
                known;
      *history.squared_error.pixel(x, y) = squared(difference, slopes);
      if (!place->rests) *edges.pixel(x, y) = edge_error(picture, now.motion, x, y, *moved, slopes);
      history.known[static_cast<size_t>(y) * width + x] = known;
    }
  });
  history.squared_error = smoothed(history.squared_error);
  for (size_t i = 0; i < edges.data.size(); ++i) history.squared_error.data[i] += kOfEdges * edges.data[i];
  return history;
}

}  // namespace covary
