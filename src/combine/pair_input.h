// SPDX-License-Identifier: Apache-2.0
// Two images for an estimator of pairs, as programs are given them: what their files or films say of themselves, and
// what the caller asks for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "combine/input_checks.h"
#include "estimators/estimator.h"
#include "film/exr.h"
#include "settings/settings.h"

namespace covary {

/// What is known of an image beside its pixels; texts are empty where nothing is.
struct ImageOrigin {
  std::string name;  ///< for messages
  ImagePlace place;
  std::string sampling;              ///< attribute of films: "crn", "independent"
  std::string scene_hash, settings;  ///< attributes of films
  bool has_half = false;             ///< a channel has 16 bits only
  bool is_light_film = false;        ///< film/splat_layer.h
  bool has_light_added = false;      ///< an image to which a light film was added
};

/// Appends to `findings` what the origins say against combining the images. Throws Error(kInput) where they do not show
/// the same pixels.
void check_origins(const ImageOrigin& crn, const ImageOrigin& independent, std::vector<Finding>& findings);

/// Appends to `findings` what the origins say about light films: `light` is the one to add, or null. Throws
/// Error(kInput) where it is none, or shows other pixels.
void check_light(const ImageOrigin& crn, const ImageOrigin& independent, const ImageOrigin* light,
                 std::vector<Finding>& findings);

/// The errors among the findings, separated by "; "; empty where there are none.
std::string errors_text(const std::vector<Finding>& findings);

/// Whether a group of a pixel has no samples.
bool lacks_samples(const GroupedImage& image);
/// The report on such images, which an estimator with adaptive sampling may take: that they were not checked.
InputReport unchecked_report();

/// Names of those that need the number of samples of the CRN image.
std::vector<std::string> estimators_with_samples();
/// `samples`: per pixel of the CRN image, where the caller gives them; `known_samples`: as the image tells, 0 where it
/// does not. Throws Error(kUsage) for a setting that the estimator does not have.
PairSettings pair_settings(const Estimator& estimator, std::optional<int> samples, double known_samples,
                           bool std_error);

/// Why images are not enough for the estimator; empty where they are, or where there is none of that name.
std::string needs_samples_text(const std::string& name);
/// make_estimator() for those of two images. Throws Error(kUsage) for any other, too.
Estimator make_pair_estimator(const std::string& name, const OptionValues& values);

}  // namespace covary
