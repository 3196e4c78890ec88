// SPDX-License-Identifier: Apache-2.0
// New versions of EXR files of any renderer: some channels change, everything else stays as it is, whatever it means.
#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "film/exr.h"

namespace covary {

/// How a new version of a file differs from it. Channels have the names of ExrFile::channels().
struct ExrChanges {
  std::vector<ExrPlane> planes;  ///< read only; each replaces the channel of its name, or is a new one
  std::set<std::string> left_out;
  bool only_planes = false;  ///< leave out all channels that the planes do not replace, and all other parts
  std::map<std::string, std::string> attributes;  ///< instead of all of the file's attributes covary:…
  std::string picture;  ///< a channel of the part to which new channels and attributes go; "": the first part
};

/// Writes `path` as the file `source` with these changes, row by row. Kept are all other channels with their types and
/// bits, all attributes but thumbnails and hashes of the old pixels, windows, parts and views. Parts without changes
/// are copied as they are, deep ones, too; others become scan lines in ZIP, which loses nothing. Parts without any
/// channel left disappear. Returns what could not be kept, one sentence each. Throws Error(kIo), and like ExrFile.
std::vector<std::string> write_changed_exr(const std::string& path, const std::string& source,
                                           const ExrChanges& changes,
                                           ChecksumPolicy checksums = ChecksumPolicy::kCheck);

/// The alpha channel of the picture with this first channel (R, X or Y): "left.A" for "left.R"; "" if there is none.
std::string alpha_channel(std::span<const ExrFile::Channel> channels, const std::string& first);

}  // namespace covary
