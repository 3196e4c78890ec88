// SPDX-License-Identifier: Apache-2.0
// Writes the image made by an estimator.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "combine/result_source.h"
#include "estimators/estimator_result.h"
#include "film/exr.h"
#include "film/grouped_image.h"
#include "risk/predicted_error.h"

namespace covary {

/// Attributes that describe the predicted error of an image, film_key::kPredicted and kPredictedBounds.
std::map<std::string, std::string> prediction_attributes(const std::optional<PredictedError>& predicted);

/// Writes R, G, B, if there is an error estimate StdError.R, .G, .B and Bias.R, .G, .B, and the auxiliary images by
/// name, with string attributes; if `source` has files, as a new version of the first one. Its alpha is the mean over
/// the files, as the picture is; statistics of its samples by covary are left out. The file appears under its name only
/// when complete. Returns what could not be kept, one sentence each. Throws Error(kUsage) for another ending than .exr
/// or a place of another size than the image, Error(kIo), and like ExrFile.
std::vector<std::string> write_result(const std::string& path, const ImagePlace& place,
                                      const std::map<std::string, std::string>& attributes, EstimatorResult& result,
                                      std::map<std::string, Image>& aovs, const ResultSource& source = {});

/// A picture of a result.
struct ResultPicture {
  EstimatorResult image;
  std::map<std::string, Image> aovs;
  ResultSource source;
};

/// The same for several pictures of the same files, such as views.
std::vector<std::string> write_results(const std::string& path, const std::map<std::string, std::string>& attributes,
                                       std::vector<ResultPicture>& pictures);

/// Channels in a file of covary that describe its samples: groups, their number, errors, history.
std::set<std::string> statistics_channels(const ExrFile& file);

}  // namespace covary
