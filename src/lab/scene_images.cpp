// SPDX-License-Identifier: Apache-2.0
#include "lab/scene_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "film/image_file.h"
#include "metrics/alignment.h"

namespace covary::lab {
namespace {

Image read_one(const std::string& path, const SceneInstance& scene, const std::string& layer) {
  const PlacedImage source = read_image(path, layer.empty() ? scene.entry.layer : layer);
  const CropWindow &have = source.place.window, &want = scene.window;
  if (source.place.frame_width != scene.frame_width || source.place.frame_height != scene.frame_height)
    throw Error(ErrorCode::kInput, fmt::format("{} has a frame of {} x {} pixels, the scene one of {} x {}", path,
                                               source.place.frame_width, source.place.frame_height, scene.frame_width,
                                               scene.frame_height));
  if (want.x < have.x || want.y < have.y || want.x + want.width > have.x + have.width ||
      want.y + want.height > have.y + have.height)
    throw Error(ErrorCode::kInput, fmt::format("{} ({}) does not cover {}", path, text_of(have), text_of(want)));
  return cut(source, want);
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

double mean_metric(Metric metric, const Image& image, const std::vector<Image>& references,
                   const SceneInstance& scene) {
  if (scene.frames.empty()) return compute_metric(metric, image, references).value;
  const std::vector<Image> images = images_of(image, scene);
  std::vector<std::vector<Image>> of_references;
  for (const Image& reference : references) of_references.push_back(images_of(reference, scene));
  double sum = 0;
  for (size_t f = 0; f < images.size(); ++f) {
    std::vector<Image> of_frame;
    for (const std::vector<Image>& frames : of_references) of_frame.push_back(frames[f]);
    sum += compute_metric(metric, images[f], of_frame).value;
  }
  return sum / static_cast<double>(images.size());
}

std::vector<FrameErrors> frame_errors(const Image& image, const std::vector<Image>& references,
                                      const SceneInstance& scene) {
  if (scene.frames.empty()) return {};
  std::vector<Image> frames = images_of(image, scene);
  std::vector<std::vector<Image>> of_references;
  for (const Image& reference : references) of_references.push_back(images_of(reference, scene));
  SequenceErrors errors;
  for (size_t f = 0; f < frames.size(); ++f) {
    std::vector<Image> of_frame;
    for (std::vector<Image>& all : of_references) of_frame.push_back(std::move(all[f]));
    errors.add(std::move(frames[f]), std::move(of_frame));
  }
  return errors.frames();
}

}  // namespace covary::lab
