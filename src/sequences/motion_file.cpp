// SPDX-License-Identifier: Apache-2.0
#include "sequences/motion_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "core/error.h"
#include "film/image_file.h"

namespace covary {
namespace {

/// The names of both channels, or none.
std::optional<std::array<std::string, 2>> motion_channels(const ExrFile& file, const std::string& layer) {
  for (const auto& [x, y] : {std::pair{".X", ".Y"}, {".R", ".G"}, {".U", ".V"}})
    if (file.find(layer + x) && file.find(layer + y)) return std::array{layer + x, layer + y};
  return std::nullopt;
}

std::optional<std::string> depth_channel(const ExrFile& file, const std::string& layer) {
  for (const char* end : {"", ".V", ".Z", ".R", ".Y", ".X"})
    if (file.find(layer + end)) return layer + end;
  return std::nullopt;
}

}  // namespace

bool has_motion(const std::string& path, const MotionSource& source) {
  return motion_channels(ExrFile(path), source.motion).has_value();
}

MotionLayers read_motion(const std::string& path, const MotionSource& source) {
  const ExrFile file(path);
  const int width = file.place().window.width, height = file.place().window.height;
  MotionLayers layers{Image(width, height, 1), Image(width, height, 3)};
  const auto names = motion_channels(file, source.motion);
  if (!names) {
    std::vector<std::string> all;
    for (const ExrFile::Channel& channel : file.channels()) all.push_back(channel.name);
    throw Error(ErrorCode::kInput, fmt::format("{}: no layer '{}' of motion; there are the channels {}", path,
                                               source.motion, fmt::join(all, ", ")));
  }
  std::vector<ExrPlane> planes;
  const auto add = [&](const std::string& name, Image& image, int channel) {
    planes.push_back({name, ExrPlane::Type::kFloat, image.data.data() + channel, image.channels * sizeof(float)});
  };
  for (const int c : {0, 1}) add((*names)[c], layers.motion, c);
  const std::optional<std::string> depth = depth_channel(file, source.depth);
  if (depth) add(*depth, layers.depth, 0);
  const std::string change = source.motion + ".Z";
  const bool has_change = source.motion == MotionSource().motion && file.find(change);
  if (has_change) add(change, layers.motion, 2);
  file.read(planes);
  layers.knows_depth = depth && has_change;
  for (size_t i = 0; i < layers.motion.data.size(); i += 3) {
    layers.motion.data[i] *= source.scale_x;
    layers.motion.data[i + 1] *= source.scale_y;
  }
  return layers;
}

double misfit(const Image& before, const Image& now, const MotionLayers& motion) {
  // Depth is the renderer's, and not what is asked about.
  MotionLayers only_motion = motion;
  only_motion.depth = Image(now.width, now.height, 1);
  const History moved = reproject(before, only_motion.depth, only_motion);
  double with = 0, without = 0;
  for (size_t i = 0; i < moved.known.size(); ++i) {
    if (!moved.known[i]) continue;
    for (size_t c = 3 * i; c < 3 * i + 3; ++c) {
      const double brightness = std::abs(now.data[c]) + 0.1;
      with += std::abs(moved.image.data[c] - now.data[c]) / brightness;
      without += std::abs(before.data[c] - now.data[c]) / brightness;
    }
  }
  return without > 0 ? with / without : 1;
}

}  // namespace covary
