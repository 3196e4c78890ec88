// SPDX-License-Identifier: Apache-2.0
#include "frame_history.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <string_view>

#include "core/content_hash.h"
#include "core/number_text.h"
#include "film/image_file.h"
#include "frame_files.h"
#include "imageio/checksums.h"
#include "motion_checks.h"
#include "sequences/frame_names.h"
#include "usage_error.h"

namespace covary {
namespace {

/// The layer whose history is used; none if there are several pictures.
std::optional<std::string> layer_with_history(const FramePatterns& patterns, int frame) {
  const std::string path = frame_name(patterns.images[0], frame);
  const std::vector<ExrFile::Channel> channels = inspect_image(path).channels;
  const std::vector<Picture> pictures =
      is_unnamed(patterns.choice) ? find_pictures(channels) : chosen_pictures(path, channels, patterns.choice);
  if (pictures.size() > 1) return std::nullopt;
  return pictures.empty() ? "" : pictures[0].layer;
}

/// Identifies the picture in a result, by the checksums of its channels; "" if the file has none.
std::string picture_in(const std::string& path) {
  const std::optional<Checksums> checksums = find_checksums(path, inspect_image(path).attributes);
  return checksums ? hash_text(hash_bytes(fmt::format("{:08x}", fmt::join(checksums->channels, "")))) : std::string();
}

/// Whether covary's renderer wrote the motion, and it is read as such: it needs no check, which noise might fail.
bool is_own_motion(const std::string& path, const MotionSource& source) {
  const MotionSource own;
  const bool is_read_so = source.motion == own.motion && source.scale_x == own.scale_x && source.scale_y == own.scale_y;
  return is_read_so && inspect_image(path).attributes.contains("covary:scene_hash");
}

}  // namespace

MotionSource motion_source(const FrameOptions& o) {
  MotionSource source = o.motion;
  if (o.motion_scale.empty()) return source;
  const std::string_view text = o.motion_scale;
  const size_t comma = std::min(text.find(','), text.size());
  const auto x = parse_real(text.substr(0, comma)), y = parse_real(text.substr(std::min(comma + 1, text.size())));
  if (!x || !y) usage(fmt::format("--motion-scale '{}': expected X,Y, e.g. 1,-1", o.motion_scale));
  source.scale_x = static_cast<float>(*x), source.scale_y = static_cast<float>(*y);
  return source;
}

std::optional<std::string> motion_pattern(const MotionSource& source, const FramePatterns& patterns, int frame) {
  std::vector<std::string> all = patterns.images;
  all.insert(all.end(), patterns.others.begin(), patterns.others.end());
  for (const std::string& pattern : all)
    if (is_frame_pattern_of_input(pattern) && has_motion(frame_name(pattern, frame), source)) return pattern;
  if (source.motion == MotionSource().motion) return std::nullopt;
  return patterns.images[0];  // whose layers the error then lists
}

HistorySource::HistorySource(const FrameOptions& o, const FramePatterns& patterns, const std::vector<int>& frames,
                             bool has_history) {
  if (!has_history || o.no_history || frames.size() < 2) return;
  const MotionSource source = motion_source(o);
  motion = motion_pattern(source, patterns, frames[0]);
  const std::optional<std::string> only = layer_with_history(patterns, frames[0]);
  if (!motion && !o.quiet)
    fmt::print(stderr, "note: the frames have no layer '{}' (--motion); each is denoised alone, without history\n",
               source.motion);
  else if (!only && !o.quiet)
    fmt::print(stderr, "note: the frames have several pictures; each is denoised alone, without history\n");
  if (!only) motion.reset();
  layer = only.value_or("");
}

std::shared_ptr<const History> history_of(const HistorySource& from, const MotionSource& source,
                                          const FramePatterns& patterns, int frame) {
  const std::string before = frame_name(patterns.images[0], frame - 1), now = frame_name(patterns.images[0], frame);
  const MotionLayers layers = read_motion(frame_name(*from.motion, frame), source);
  const MotionLayers old = read_motion(frame_name(*from.motion, frame - 1), source);
  const std::string result = frame_name(patterns.output, frame - 1);
  const PlacedImage earlier = read_image(result, from.layer, ChecksumPolicy::kCheck, std::nullopt);
  for (const Image* image : {&old.depth, &earlier.image})
    if (image->width != layers.depth.width || image->height != layers.depth.height) {
      fmt::print(stderr, "warning: '{}' has {} x {} pixels, '{}' {} x {}, which is denoised without it\n",
                 image == &earlier.image ? result : before, image->width, image->height, now, layers.depth.width,
                 layers.depth.height);
      return nullptr;
    }
  check_seeds(before, now);
  if (!is_own_motion(frame_name(*from.motion, frame), source)) check_motion(before, now, from.layer, layers);
  History history = reproject(earlier.image, old.depth, layers);
  history.of = picture_in(result);
  return std::make_shared<History>(std::move(history));
}

std::string outdated(const FramePatterns& patterns, int frame) {
  const std::string result = frame_name(patterns.output, frame), before = frame_name(patterns.output, frame - 1);
  if (!is_exr_image(result) || !is_exr_image(before)) return "";  // which do not say
  const std::map<std::string, std::string> attributes = inspect_image(result).attributes;
  if (!attributes.contains("covary:estimator")) return "";  // of one render, by a network that takes no history
  const auto of = attributes.find(kHistoryAttribute);
  if (of == attributes.end()) return fmt::format("'{}' was made without the frame before, which was missing", result);
  return of->second == picture_in(before)
             ? ""
             : fmt::format("'{}' was made with another picture of the frame before", result);
}

}  // namespace covary
