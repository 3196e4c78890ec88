// SPDX-License-Identifier: Apache-2.0
// From two grouped images, or an independent one, to one with less noise: look at the inputs, estimate, calibrate the
// error, add the light film. The one pipeline of `covary combine`, Python and C++; renders end with its last two steps.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "combine/grouped_source.h"
#include "combine/input_checks.h"
#include "combine/layer_sources.h"
#include "estimators/estimator.h"
#include "risk/predicted_error.h"

namespace covary {

/// What is known of the inputs before anything is estimated.
struct InputFindings {
  InputReport report;
  std::vector<Finding> findings;  ///< of the report, and what the images say of themselves
};

struct CombineRequest {
  std::optional<GroupedSource> crn;  ///< none with an estimator of EstimatorPasses::kIndependent
  GroupedSource independent;
  std::optional<GroupedSource> light;  ///< a light film (film/splat_layer.h), to be added
  std::vector<LayerSource> layers;     ///< parts of the independent image, for estimators that split them
  Estimator estimator;                 ///< of a pair of images, or of an independent one
  PairSettings settings;
  bool force = false;  ///< combine even where the findings hold errors
  /// Bytes to work in: larger images are combined in bands of rows, with the same bits, by estimators whose reach is
  /// limited.
  double memory = std::numeric_limits<double>::infinity();
  /// Bytes that it may take where bands do not help; memory_limit() (core/memory_limit.h) where not given.
  std::optional<double> most_memory;
  /// Called when the inputs have been looked at, before errors among the findings are thrown.
  std::function<void(const InputFindings&)> checked;
};

struct CombinedImage {
  EstimatorResult image;
  /// Of the request by name, and kRest where they leave some of the image: together they are its estimate.
  std::map<std::string, Image> layers;
  std::optional<PredictedError> predicted;  ///< where there is a standard error
  InputFindings inputs;
  double planned_memory = 0;  ///< planned_memory() of the request
  double check_seconds = 0, estimate_seconds = 0;
};

/// Looks at the two images as combine() does. Throws Error(kInput) where they do not show the same pixels.
InputFindings examine(const CombineRequest& request);

/// Throws Error(kUsage) where it would take too much memory, Error(kInput) where the findings hold errors and `force`
/// is not set, and what the estimator throws.
CombinedImage combine(const CombineRequest& request);

/// relMSE that the groups of `image` predict of their mean, read so many rows at a time: what the samples have alone.
double predicted_relmse_of_mean(const GroupedSource& image, int rows);

/// Bytes that combine() takes at its peak, about: input, what the estimator works with, and the result.
double planned_memory(const CombineRequest& request);
/// The same of as many rows at a time.
double memory_of_rows(const CombineRequest& request, int rows);
/// Rows that combine() has in memory at a time.
int rows_in_memory(const CombineRequest& request);

/// Rows of both images; of a missing one none.
struct Band {
  GroupedImage crn, independent;
  int first = 0;
};
/// Rows first … last - 1 with the estimator's reach on both sides, so that bands have the bits of the whole.
Band band_around(const CombineRequest& request, int first, int last);

/// The last steps of every image that an estimator made of films: its standard error is calibrated by held-out samples,
/// and the mean of the light film's rows, if there is one, is added.
void finish(EstimatorResult& result, const GroupedImage* light);

}  // namespace covary
