// SPDX-License-Identifier: Apache-2.0
#include "motion_checks.h"

#include <fmt/format.h>

#include <array>
#include <optional>

#include "combine/grouped_file.h"
#include "combine/grouped_source.h"
#include "estimators/mean.h"
#include "film/image_file.h"

namespace covary {
namespace {

/// If the motion does not match, the signs of another convention with which it does; nullopt if there are none.
std::optional<std::array<float, 2>> better_signs(const Image& before, const Image& now, const MotionLayers& motion,
                                                 double fit) {
  constexpr double kClearly = 0.95;
  std::optional<std::array<float, 2>> best;
  for (const std::array<float, 2> signs : {std::array{-1.0f, -1.0f}, {1.0f, -1.0f}, {-1.0f, 1.0f}}) {
    MotionLayers turned = motion;
    for (size_t i = 0; i < turned.motion.data.size(); ++i)
      if (i % 3 < 2) turned.motion.data[i] *= signs[i % 3];
    const double fit_of_turned = misfit(before, now, turned);
    if (fit_of_turned < kClearly * fit) fit = fit_of_turned / kClearly, best = signs;
  }
  return best;
}

}  // namespace

void check_motion(const std::string& before, const std::string& now, const std::string& layer,
                  const MotionLayers& motion) {
  const auto picture = [&](const std::string& path) {
    const GroupedFile file({path}, layer);
    const GroupedSource source = source_of(file);
    return mean_of_groups(source.all()).estimate;
  };
  const Image image_before = picture(before), image_now = picture(now);
  const double fit = misfit(image_before, image_now, motion);
  const std::optional<std::array<float, 2>> signs = better_signs(image_before, image_now, motion, fit);
  if (fit <= 1 && !signs) return;
  const std::string instead =
      signs ? fmt::format("; multiplied by {},{} (--motion-scale) it fits better", (*signs)[0], (*signs)[1]) : "";
  throw WrongSequence(
      fmt::format("'{}': its motion does not match '{}': after warping, the difference is {:.2f} times that "
                  "without motion{}. Expected are pixels to the right and down, from a pixel to its point's "
                  "position in the previous frame; see --motion-scale, or --no-history",
                  now, before, fit, instead));
}

void check_seeds(const std::string& before, const std::string& now) {
  const auto seed = [](const std::string& path) {
    const auto attributes = inspect_image(path).attributes;
    const auto found = attributes.find("covary:seed");
    return found == attributes.end() ? std::string() : found->second;
  };
  const std::string own = seed(now);
  if (!own.empty() && own == seed(before))
    throw WrongSequence(
        fmt::format("'{}' and '{}' have the same seed, {}; each frame needs its own seed, "
                    "or --no-history",
                    before, now, own));
}

}  // namespace covary
