// SPDX-License-Identifier: Apache-2.0
// Films on disk: multi-channel float EXR files, described in docs/file-formats.md. Round trips are bit-exact.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "film/film.h"
#include "film/image_file.h"

namespace covary {

/// Attributes of files only, derived from the image: its predicted relMSE; two bounds, separated by a space, that
/// contain it in 80 of 100 renders; and why the prediction is unreliable, if it is.
namespace film_key {
inline constexpr const char* kPredicted = "predicted_relmse";
inline constexpr const char* kPredictedBounds = "predicted_relmse_80";
inline constexpr const char* kPredictionDoubt = "prediction_doubt";
inline constexpr const char* kCleanFeatures = "clean_features";  ///< "true": the auxiliary images are nearly noise-free
}  // namespace film_key

/// kPredictedBounds of a file; empty if it has none.
std::optional<std::array<double, 2>> predicted_bounds(const ImageInfo& file);

/// Writes `film`; the file appears under its name only when complete. `std_error`, if not empty, is the standard error
/// of the shown image, for the layer StdError, which is never read back. Throws Error(kIo).
void write_film(const std::string& path, const Film& film, const Image& std_error = {});

/// Reads a film written by write_film. Throws Error(kIo) when the file cannot be read, Error(kInput) when it is not a
/// film or is damaged.
Film read_film(const std::string& path);

/// Only the attributes, without reading pixels; throws like read_film.
std::map<std::string, std::string> read_film_attributes(const std::string& path);

}  // namespace covary
