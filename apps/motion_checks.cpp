// SPDX-License-Identifier: Apache-2.0
#include "motion_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "combine/grouped_file.h"
#include "combine/grouped_source.h"
#include "core/parallel.h"
#include "estimators/mean.h"
#include "film/image_file.h"

namespace covary {
namespace {

/// If the motion does not match, the signs of another convention with which it does; nullopt if there are none.
std::optional<std::array<float, 2>> better_signs(const Image& before, const Image& now, const MotionLayers& motion) {
  constexpr double kClearly = 0.95;
  constexpr std::array<std::array<float, 2>, 4> kSigns = {{{1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};
  std::vector<MotionLayers> turned(kSigns.size(), motion);
  for (size_t s = 0; s < kSigns.size(); ++s)
    for (size_t i = 0; i < motion.motion.data.size(); ++i)
      if (i % 3 < 2) turned[s].motion.data[i] *= kSigns[s][i % 3];
  const std::vector<double> fits = misfits(before, now, turned);
  const size_t best = std::ranges::min_element(fits) - fits.begin();
  return fits[best] < kClearly * fits[0] ? std::optional(kSigns[best]) : std::nullopt;
}

/// The mean over 5 x 5 pixels, so that noise does not decide what fits.
Image smoothed(const Image& image) {
  constexpr int kRadius = 2;
  Image result(image.width, image.height, image.channels);
  parallel_for(static_cast<size_t>(image.height), [&](size_t row) {
    const int y = static_cast<int>(row), last_y = std::min(y + kRadius, image.height - 1);
    for (int x = 0; x < image.width; ++x) {
      const int first_y = std::max(y - kRadius, 0), first_x = std::max(x - kRadius, 0);
      const int last_x = std::min(x + kRadius, image.width - 1);
      for (int c = 0; c < image.channels; ++c) {
        float sum = 0;
        for (int v = first_y; v <= last_y; ++v)
          for (int u = first_x; u <= last_x; ++u) sum += image.pixel(u, v)[c];
        result.pixel(x, y)[c] = sum / static_cast<float>((last_y - first_y + 1) * (last_x - first_x + 1));
      }
    }
  });
  return result;
}

}  // namespace

void check_motion(const std::string& before, const std::string& now, const std::string& layer,
                  const MotionLayers& motion) {
  const auto picture = [&](const std::string& path) {
    const GroupedFile file({path}, layer);
    const GroupedSource source = source_of(file);
    return smoothed(mean_of_groups(source.all()).estimate);
  };
  const Image image_before = picture(before), image_now = picture(now);
  const double fit = misfits(image_before, image_now, {&motion, 1})[0];
  const std::optional<std::array<float, 2>> signs = better_signs(image_before, image_now, motion);
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
