// SPDX-License-Identifier: Apache-2.0
// Writes the image made by an estimator.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "estimators/estimator_result.h"
#include "film/exr.h"
#include "film/grouped_image.h"
#include "risk/predicted_error.h"

namespace covary {

/// Attributes that describe the predicted error of an image, film_key::kPredicted and kPredictedBounds.
std::map<std::string, std::string> prediction_attributes(const std::optional<PredictedError>& predicted);

/// Writes R, G, B, if there is an error estimate StdError.R, .G, .B and Bias.R, .G, .B, and the auxiliary images by
/// name, with string attributes. The file appears under its name only when complete. Throws Error(kIo).
void write_result(const std::string& path, const ImagePlace& place,
                  const std::map<std::string, std::string>& attributes, EstimatorResult& result,
                  std::map<std::string, Image>& aovs);

}  // namespace covary
