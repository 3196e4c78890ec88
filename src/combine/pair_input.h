// SPDX-License-Identifier: Apache-2.0
// Two images for a two-image estimator, as programs receive them: what their files or films say about themselves, and
// what the caller requests.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "combine/input_checks.h"
#include "combine/registry.h"
#include "estimators/method.h"
#include "film/exr.h"
#include "film/written_by.h"
#include "settings/settings.h"

namespace covary {

/// What is known about an image besides its pixels; unknown texts are empty.
struct ImageOrigin {
  std::string name = {};  ///< for messages
  ImagePlace place = {};
  std::string sampling = {};                   ///< attribute of films: "crn", "independent"
  std::string scene_hash = {}, settings = {};  ///< attributes of films
  bool has_half = false;                       ///< a channel has only 16 bits
  bool is_light_film = false;                  ///< film/splat_layer.h
  bool has_light_added = false;                ///< an image to which a light film was added
  bool is_one_film = false;                    ///< all groups are of one film of covary, and so of different samples
  std::string denoised = {};                   ///< denoised_by() of film/denoised_by.h
  ColourSpace colours = {};
  std::vector<std::string> renders = {};   ///< files, if each holds one group
  Renderer renderer = Renderer::kUnknown;  ///< that made them
};

/// Appends to `findings` what in the origins argues against combining the images. Throws Error(kInput) if they do not
/// show the same pixels.
void check_origins(const ImageOrigin& crn, const ImageOrigin& independent, std::vector<Finding>& findings);

/// Appends to `findings` what the origins say about light films: `light` is the one to add, or null. Throws
/// Error(kInput) if it is not a light film, or shows different pixels.
void check_light(const ImageOrigin& crn, const ImageOrigin& independent, const ImageOrigin* light,
                 std::vector<Finding>& findings);

/// The errors among the findings, separated by "; "; empty if there are none.
std::string errors_text(const std::vector<Finding>& findings);

/// Whether any group of any pixel has no samples.
bool lacks_samples(const GroupedImage& image);
/// The report for such images, which an adaptive estimator may accept: they were not checked.
InputReport unchecked_report();

/// Whether it needs the number of samples of the CRN image.
bool needs_sample_count(const Method& method);
/// Names of the estimators that need the number of samples of the CRN image.
std::vector<std::string> estimators_with_samples();
/// `samples`: per pixel of the CRN image, if given by the caller; `known_samples`: according to the image, 0 if
/// unknown. Throws Error(kUsage) for a setting that the estimator does not have.
MethodSettings pair_settings(const Method& estimator, std::optional<int> samples, double known_samples, bool std_error);

/// Why the estimator cannot be applied to images; empty if it can, or if there is no such estimator.
std::string needs_samples_text(const std::string& name);
/// make_estimator() for two-image estimators. Throws Error(kUsage) for any other.
Method make_pair_estimator(const std::string& name, const OptionValues& values, const MethodTarget& target = {});

}  // namespace covary
