// SPDX-License-Identifier: Apache-2.0
// The files that an image was made of, which say what it takes over from them.
#pragma once

#include <array>
#include <set>
#include <string>
#include <vector>

namespace covary {

/// An image in EXR takes over from the first of these files all that it does not replace (docs/file-formats.md). Empty:
/// a new file.
struct ResultSource {
  std::vector<std::string> files;                        ///< renders of one picture
  std::array<std::string, 3> picture = {"R", "G", "B"};  ///< its channels in the first file, replaced by the image
  std::set<std::string> used;                            ///< channels in the first file that the image is made of
  std::string prefix;  ///< of the names of new layers ("left."), if the file has several pictures
};

}  // namespace covary
