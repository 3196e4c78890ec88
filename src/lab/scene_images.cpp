// SPDX-License-Identifier: Apache-2.0
#include "lab/scene_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "denoising/denoised_references.h"
#include "film/image_file.h"
#include "metrics/alignment.h"

namespace covary::lab {
namespace {

Image read_one(const std::string& path, const SceneInstance& scene, const std::string& layer) {
  const PlacedImage source = read_image(path, layer.empty() ? scene.entry.layer : layer);
  const CropWindow &have = source.place.window, &want = scene.window;
  // The crop as an image of its own, as one's own methods make it.
  const CropWindow own{0, 0, want.width, want.height};
  if (have == own && source.place.frame_width == want.width && source.place.frame_height == want.height)
    return cut(source, own);
  if (source.place.frame_width != scene.frame_width || source.place.frame_height != scene.frame_height)
    throw Error(ErrorCode::kInput, fmt::format("{} has a frame of {} x {} pixels, the scene one of {} x {}", path,
                                               source.place.frame_width, source.place.frame_height, scene.frame_width,
                                               scene.frame_height));
  if (want.x < have.x || want.y < have.y || want.x + want.width > have.x + have.width ||
      want.y + want.height > have.y + have.height)
    throw Error(ErrorCode::kInput, fmt::format("{} ({}) does not cover {}", path, text_of(have), text_of(want)));
  return cut(source, want);
}

/// The references of each image.
std::vector<SceneReferences> by_frame(const SceneReferences& references, const SceneInstance& scene) {
  std::vector<SceneReferences> frames(scene.n_images());
  const auto split = [&](const std::vector<Image>& all, std::vector<Image> SceneReferences::*member) {
    for (const Image& pixels : all) {
      std::vector<Image> images = images_of(pixels, scene);
      for (size_t f = 0; f < frames.size(); ++f) (frames[f].*member).push_back(std::move(images[f]));
    }
  };
  split(references.images, &SceneReferences::images), split(references.denominators, &SceneReferences::denominators);
  return frames;
}

/// Adds rows below.
void append(const Image& rows, Image& image) {
  image.width = rows.width, image.height += rows.height, image.channels = 3;
  image.data.insert(image.data.end(), rows.data.begin(), rows.data.end());
}

}  // namespace

Image read_window(const std::string& path, const SceneInstance& scene, const std::string& layer) {
  if (scene.frames.empty()) return read_one(path, scene, layer);
  Image all(scene.window.width, scene.window.height * static_cast<int>(scene.frames.size()), 3);
  auto end = all.data.begin();
  for (const std::string& file : files_of(scene.frames, path)) {
    const Image frame = read_one(file, scene, layer);
    end = std::copy(frame.data.begin(), frame.data.end(), end);
  }
  return all;
}

std::vector<Image> images_of(const Image& pixels, const SceneInstance& scene) {
  std::vector<Image> images;
  for (size_t f = 0; f < scene.n_images(); ++f) {
    Image& image = images.emplace_back(scene.window.width, scene.window.height, 3);
    std::copy_n(pixels.data.begin() + static_cast<ptrdiff_t>(f * image.data.size()), image.data.size(),
                image.data.begin());
  }
  return images;
}

SceneReferences read_references(const std::vector<std::string>& files, const SceneInstance& scene) {
  SceneReferences references;
  for (const std::string& file : files) references.images.push_back(read_window(file, scene));
  for (const SceneReferences& of_frame : by_frame(references, scene)) {
    const std::vector<Image> denoised = denoised_references(of_frame.images);
    references.denominators.resize(denoised.size());
    for (size_t i = 0; i < denoised.size(); ++i) append(denoised[i], references.denominators[i]);
  }
  return references;
}

double mean_metric(Metric metric, const Image& image, const SceneReferences& references, const SceneInstance& scene) {
  const std::vector<Image> images = images_of(image, scene);
  const std::vector<SceneReferences> all = by_frame(references, scene);
  double sum = 0;
  for (size_t f = 0; f < images.size(); ++f)
    sum += compute_metric(metric, images[f], all[f].images, false, all[f].denominators).value;
  return sum / static_cast<double>(images.size());
}

std::vector<FrameErrors> frame_errors(const Image& image, const SceneReferences& references,
                                      const SceneInstance& scene) {
  if (scene.frames.empty()) return {};
  std::vector<Image> frames = images_of(image, scene);
  std::vector<SceneReferences> all = by_frame(references, scene);
  SequenceErrors errors;
  for (size_t f = 0; f < frames.size(); ++f)
    errors.add(std::move(frames[f]), std::move(all[f].images), false, std::move(all[f].denominators));
  return errors.frames();
}

}  // namespace covary::lab
