// SPDX-License-Identifier: Apache-2.0
// Pictures as luminance and chroma, Y at every pixel and RY, BY at every other one, as OpenEXR's RgbaOutputFile writes
// them (WRITE_YC). The library's RgbaInputFile makes red, green and blue of them.
#pragma once

#include <OpenEXR/ImfChannelList.h>

#include <memory>
#include <span>
#include <string>

#include "film/exr.h"

namespace covary {

/// Whether these are the channels of such a picture.
bool has_luminance_chroma(const OPENEXR_IMF_NAMESPACE::ChannelList& channels);

class LuminanceChroma {
 public:
  /// A file of one part. Throws what OpenEXR does.
  explicit LuminanceChroma(const std::string& path);
  ~LuminanceChroma();
  /// Reads `n_rows` rows, the first of which is y in the file, to the planes R, G and B. Throws what OpenEXR does.
  void read_rows(std::span<const ExrPlane> planes, int y, int n_rows) const;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

}  // namespace covary
