// SPDX-License-Identifier: Apache-2.0
// Training of a scene's integrator before the phases of a plan, and the contribution of its samples to the image.
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "denoising/denoise.h"
#include "film/film.h"
#include "film/grouped_image.h"
#include "passes/integrator.h"
#include "passes/training.h"
#include "plans/render.h"
#include "scene/scene.h"

namespace covary {

/// Trains a prepared integrator of the scene if it learns, or loads the request's training file; saves it if the
/// request names a file. Sets settings.importance and seed, and the training's part of `seconds`. False if stopped.
bool train(const LoadedScene& scene, const RenderRequest& request, Integrator& integrator, TrainingSettings settings,
           RenderSeconds& seconds);

/// Updates the standard errors of rows first_row, … of the film's image to those of film and training together: the
/// training's image has approximately the variance of that many samples of the film.
void add_training(const Film& film, const TrainingImage& training, int first_row, EstimatorResult& image);

// What integrators that learn are told about the image before training.

/// Albedo and normals of the pixels of a film, which guide the denoising of its values.
struct PixelFeatures {
  Image albedo, normal;
  bool empty() const { return normal.data.empty(); }
};

/// Renders those of `film`'s pixels; empty if stopped.
PixelFeatures pixel_features(const Scene& scene, const FilterSettings& filter, const Film& film,
                             const std::atomic<bool>* stop);

/// Weight of an error in each channel of each pixel, so that relative errors count equally: 1 / √(value² + 0.01), with
/// the value of the denoised film ([Hua2023] Eq. 25) and the constant of relMSE. Denoised by joint_bilateral(), or with
/// `oidn` by Open Image Denoise, which must then be installed. Empty without features.
std::vector<Spectrum> pixel_importance(const PixelFeatures& features, const Film& film,
                                       const std::optional<DenoiseOptions>& oidn);

// Training files (docs/file-formats.md).

/// Writes what a trained integrator has learnt in the scene with this hash. Throws Error(kUsage) if its training cannot
/// be saved (LearningIntegrator::keeps_training), and Error(kIo).
void save_training(const std::string& scene_hash, const Integrator& integrator, const std::string& path);

/// Loads it into a prepared integrator, which is then not trained. Throws Error(kUsage) likewise, Error(kIo), and
/// Error(kInput) for a file that is damaged, of another version, or of another scene or other settings.
void load_training(const std::string& scene_hash, Integrator& integrator, const std::string& path);

}  // namespace covary
