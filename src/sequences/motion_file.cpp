// SPDX-License-Identifier: Apache-2.0
#include "sequences/motion_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <vector>

#include "core/error.h"
#include "film/image_file.h"

namespace covary {
namespace {

/// The layer with this name or, because Blender prefixes the view layer's name, the only one that ends with it.
std::string layer_of(const ExrFile& file, const std::string& name) {
  std::set<std::string> found;
  for (const ExrFile::Channel& channel : file.channels()) {
    const std::string layer = channel.name.substr(0, std::min(channel.name.rfind('.'), channel.name.size()));
    if (layer == name || channel.name == name) return name;
    if (last_part(layer) == name) found.insert(layer);
  }
  return found.size() == 1 ? *found.begin() : name;
}

/// Both channels and their scale factors.
struct MotionChannels {
  std::array<std::string, 2> names;
  float scale_x, scale_y;
  bool is_ours = false;
};

std::optional<MotionChannels> motion_channels(const ExrFile& file, const MotionSource& source) {
  const std::string layer = layer_of(file, source.motion);
  for (const auto& [x, y] : {std::pair{".X", ".Y"}, {".R", ".G"}, {".U", ".V"}})
    if (file.find(layer + x) && file.find(layer + y))
      return MotionChannels{
          {layer + x, layer + y}, source.scale_x, source.scale_y, source.motion == MotionSource().motion};
  // Blender's pass: the first two channels point to the previous frame, with Y up; the others to the next frame.
  const std::string vector = layer_of(file, "Vector");
  if (source.motion == MotionSource().motion && file.find(vector + ".X") && file.find(vector + ".W"))
    return MotionChannels{{vector + ".X", vector + ".Y"}, source.scale_x, -source.scale_y};
  return std::nullopt;
}

std::optional<std::string> depth_channel(const ExrFile& file, const std::string& name) {
  const std::string layer = layer_of(file, name);
  for (const char* end : {"", ".V", ".Z", ".R", ".Y", ".X"})
    if (file.find(layer + end)) return layer + end;
  return std::nullopt;
}

}  // namespace

bool has_motion(const std::string& path, const MotionSource& source) {
  return motion_channels(ExrFile(path), source).has_value();
}

MotionLayers read_motion(const std::string& path, const MotionSource& source) {
  const ExrFile file(path);
  const int width = file.place().window.width, height = file.place().window.height;
  MotionLayers layers{Image(width, height, 1), Image(width, height, 3)};
  const std::optional<MotionChannels> found = motion_channels(file, source);
  if (!found) {
    std::vector<std::string> all;
    for (const ExrFile::Channel& channel : file.channels()) all.push_back(channel.name);
    throw Error(ErrorCode::kInput, fmt::format("{}: no layer '{}' of motion; it has the channels {}", path,
                                               source.motion, fmt::join(all, ", ")));
  }
  std::vector<ExrPlane> planes;
  const auto add = [&](const std::string& name, Image& image, int channel) {
    planes.push_back({name, ExrPlane::Type::kFloat, image.data.data() + channel, image.channels * sizeof(float)});
  };
  for (const int c : {0, 1}) add(found->names[c], layers.motion, c);
  const std::optional<std::string> depth = depth_channel(file, source.depth);
  if (depth) add(*depth, layers.depth, 0);
  const std::string change = source.motion + ".Z";
  const bool has_change = found->is_ours && file.find(change);
  if (has_change) add(change, layers.motion, 2);
  file.read(planes);
  layers.knows_depth = depth && has_change;
  for (size_t i = 0; i < layers.motion.data.size(); i += 3) {
    layers.motion.data[i] *= found->scale_x;
    layers.motion.data[i + 1] *= found->scale_y;
  }
  return layers;
}

std::vector<double> misfits(const Image& before, const Image& now, std::span<const MotionLayers> motions) {
  constexpr size_t kMinPart = 20;
  std::vector<History> moved;
  for (const MotionLayers& motion : motions) {
    MotionLayers only_motion = motion;  // depth is not tested
    only_motion.depth = Image(now.width, now.height, 1);
    moved.push_back(reproject(before, only_motion.depth, only_motion));
  }
  const size_t n_pixels = static_cast<size_t>(now.width) * now.height;
  std::vector<double> with(motions.size());
  double without = 0;
  size_t n_known = 0;
  for (size_t i = 0; i < n_pixels; ++i) {
    const int x = static_cast<int>(i) % now.width, y = static_cast<int>(i) / now.width;
    if (!std::ranges::all_of(moved, [&](const History& m) { return m.known[i] != 0; }) ||
        is_motion_edge(motions[0].motion, x, y))
      continue;
    ++n_known;
    for (size_t c = 3 * i; c < 3 * i + 3; ++c) {
      const double brightness = std::abs(now.data[c]) + 0.1;
      for (size_t m = 0; m < moved.size(); ++m) with[m] += std::abs(moved[m].image.data[c] - now.data[c]) / brightness;
      without += std::abs(before.data[c] - now.data[c]) / brightness;
    }
  }
  const bool is_measured = without > 0 && kMinPart * n_known >= n_pixels;
  for (double& sum : with) sum = is_measured ? sum / without : 1;
  return with;
}

}  // namespace covary
