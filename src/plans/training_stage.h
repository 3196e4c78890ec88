// SPDX-License-Identifier: Apache-2.0
// The training of a scene's integrator before the phases of a plan, and what its samples add to the image.
#pragma once

#include "film/grouped_image.h"
#include "passes/training.h"
#include "plans/render.h"

namespace covary {

/// Trains a prepared integrator of the scene if it learns, or takes what it learnt from the request's file; keeps it in
/// a file where the request names one. Sets settings.importance and seed, and of `seconds` those of the training. False
/// when stopped.
bool train(const LoadedScene& scene, const RenderRequest& request, Integrator& integrator, TrainingSettings settings,
           RenderSeconds& seconds);

/// Makes the standard errors of rows first_row, … of the film's image those of film and training together: the
/// training's image has, about, the variance of so many samples of the film.
void add_training(const Film& film, const TrainingImage& training, int first_row, EstimatorResult& image);

}  // namespace covary
