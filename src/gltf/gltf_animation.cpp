// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_animation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace covary {
namespace {

using Numbers = std::vector<double>;

void normalise(Numbers& q) {
  double sum = 0;
  for (const double x : q) sum += x * x;
  for (double& x : q) x /= sum > 0 ? std::sqrt(sum) : 1;
}

/// Along the shorter arc; glTF 2.0, appendix C.4.
Numbers slerp(const Numbers& a, const Numbers& b, double t) {
  double cosine = 0;
  for (size_t i = 0; i < 4; ++i) cosine += a[i] * b[i];
  const double sign = cosine < 0 ? -1 : 1, angle = std::acos(std::min(std::abs(cosine), 1.0));
  const double sine = std::sin(angle);
  const double of_a = sine > 1e-6 ? std::sin(angle * (1 - t)) / sine : 1 - t,
               of_b = sine > 1e-6 ? std::sin(angle * t) / sine : t;
  Numbers result(4);
  for (size_t i = 0; i < 4; ++i) result[i] = of_a * a[i] + sign * of_b * b[i];
  return result;
}

/// The values of a channel, `width` numbers per key.
struct Track {
  Numbers times, values;
  size_t width = 1;
  bool is_rotation = false, is_spline = false, is_step = false;

  /// Value (1), tangent before (0) or after (2) a key.
  Numbers part(size_t key, size_t which) const {
    const size_t from = (is_spline ? 3 * key + which : key) * width;
    return {values.begin() + static_cast<ptrdiff_t>(from), values.begin() + static_cast<ptrdiff_t>(from + width)};
  }
  Numbers at(double time) const {
    const size_t n = times.size();
    const auto next = static_cast<size_t>(std::upper_bound(times.begin(), times.end(), time) - times.begin());
    Numbers result;
    if (next == 0 || next == n || is_step) {
      result = part(next == 0 ? 0 : next - 1, 1);
    } else {
      const double step = times[next] - times[next - 1], t = (time - times[next - 1]) / step;
      const Numbers a = part(next - 1, 1), b = part(next, 1);
      if (is_spline) {
        result = spline(a, part(next - 1, 2), b, part(next, 0), t, step);
      } else if (is_rotation) {
        result = slerp(a, b, t);
      } else {
        for (size_t i = 0; i < width; ++i) result.push_back(a[i] + t * (b[i] - a[i]));
      }
    }
    if (is_rotation) normalise(result);
    return result;
  }

 private:
  /// Appendix C.5.
  static Numbers spline(const Numbers& a, const Numbers& leaving, const Numbers& b, const Numbers& arriving, double t,
                        double step) {
    const double t2 = t * t, t3 = t2 * t;
    Numbers result;
    for (size_t i = 0; i < a.size(); ++i)
      result.push_back((2 * t3 - 3 * t2 + 1) * a[i] + step * (t3 - 2 * t2 + t) * leaving[i] +
                       (-2 * t3 + 3 * t2) * b[i] + step * (t3 - t2) * arriving[i]);
    return result;
  }
};

/// Nullopt after an error.
std::optional<Track> read_track(GltfFile& file, const GltfChannel& channel, const std::string& what) {
  Track track;
  track.is_rotation = channel.path == "rotation";
  track.is_spline = channel.interpolation == "CUBICSPLINE", track.is_step = channel.interpolation == "STEP";
  const int width = channel.path == "weights" ? 1 : track.is_rotation ? 4 : 3;
  track.times = file.numbers(channel.input, 1, what);
  track.values = file.numbers(channel.output, width, what);
  if (track.times.empty() || track.values.empty()) return std::nullopt;
  const size_t n_values = track.times.size() * (track.is_spline ? 3 : 1);
  track.width = channel.path == "weights" ? track.values.size() / n_values : static_cast<size_t>(width);
  const bool increases = std::ranges::adjacent_find(track.times, std::ranges::greater_equal()) == track.times.end();
  if (increases && track.width > 0 && track.values.size() == n_values * track.width) return track;
  file.error(fmt::format("{}: has {} numbers for {} keys, or times that do not increase", what, track.values.size(),
                         track.times.size()));
  return std::nullopt;
}

}  // namespace

void move_gltf_nodes(GltfFile& file, double time) {
  std::set<std::pair<int, std::string>> moved;
  std::string left_out;
  for (const GltfAnimation& animation : file.animations()) {
    std::set<std::pair<int, std::string>> here;
    bool is_alternative = false;
    for (const GltfChannel& channel : animation.channels) {
      if (static_cast<size_t>(channel.node) >= file.model().nodes.size()) continue;
      is_alternative |= moved.contains({channel.node, channel.path});
      if (is_alternative) break;
    }
    if (is_alternative) {
      left_out += fmt::format("{}'{}'", left_out.empty() ? "" : ", ", animation.name);
      continue;
    }
    for (const GltfChannel& channel : animation.channels) {
      if (static_cast<size_t>(channel.node) >= file.model().nodes.size()) continue;
      const auto track =
          read_track(file, channel, fmt::format("animation '{}', node {}", animation.name, channel.node));
      if (!track) continue;
      here.insert({channel.node, channel.path});
      tinygltf::Node& node = file.node(channel.node);
      node.matrix.clear();  // an animated node has none
      if (channel.path == "translation") node.translation = track->at(time);
      if (channel.path == "rotation") node.rotation = track->at(time);
      if (channel.path == "scale") node.scale = track->at(time);
      if (channel.path == "weights") node.weights = track->at(time);
    }
    moved.merge(here);
  }
  if (!left_out.empty()) file.warn(fmt::format("of several animations, the first is shown; left out: {}", left_out));
}

}  // namespace covary
