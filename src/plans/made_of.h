// SPDX-License-Identifier: Apache-2.0
// What an image is made of, as text in its file, so that a render with other settings does not replace it unasked.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "settings/option.h"

namespace covary {

namespace film_key {
/// made_of() of the render.
inline constexpr const char* kMadeOf = "made_of";
}  // namespace film_key

/// Names of what is no option: hashes of the camera's place and of the frame before, and the scene's time.
inline constexpr const char *kMadeAtPlace = "place of the camera", *kMadeAfter = "previous frame",
                            *kMadeAtTime = "time";

/// A line "name=value" for the scene's hash and each option that changes the image; options that say where it goes, or
/// whether it continues, are left out.
std::string made_of(const std::string& scene_hash, const std::vector<OptionValues>& options);

/// What differs between two texts of made_of(): "spp 16, now 64; another scene, or a changed one"; empty if nothing
/// does. The scene is named only if no option that changes it is. `continues`: a higher or lower limit of samples, time
/// or error is no difference.
std::string differences(const std::string& earlier, const std::string& now, bool continues = false);

/// How the file at `path` was made, according to its attributes.
struct MadeFile {
  std::string made_of;  ///< empty: unknown, or there is no image
  bool complete = false;
  std::optional<double> predicted;  ///< relMSE
  double samples = 0;               ///< per pixel; 0: unknown
};
MadeFile made_file(const std::string& path);

/// Whether it is complete, was made as `made_of` says apart from the goal, and its predicted relMSE is at most `until`.
bool reaches(const MadeFile& file, const std::string& made_of, double until);

/// Throws Error(kInput) if the file at `path` is an image that covary made with other settings, according to its
/// attribute; does nothing if there is no file, or one without the attribute. `continues`: as for differences().
/// `resumes`: the render was to be continued; without `continues`, its samples were not kept.
void check_made_alike(const std::string& path, const std::string& made_of, bool continues, bool resumes);

}  // namespace covary
