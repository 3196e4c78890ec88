// SPDX-License-Identifier: Apache-2.0
// Images of any renderer read row by row, for those that are larger than memory.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "film/image_file.h"
#include "imageio/image_io.h"

namespace covary {

/// An open image, of which three channels are read as linear RGB.
class ImageRows {
 public:
  /// `layer` as in read_image(), which throws likewise. Reads no pixel yet.
  explicit ImageRows(const std::string& path, const std::string& layer = "",
                     ChecksumPolicy checksums = ChecksumPolicy::kCheck);

  const ImagePlace& place() const { return place_; }
  /// Whether the file holds 8- or 16-bit integers.
  bool low_dynamic_range() const { return low_dynamic_range_; }

  /// `n_rows` rows from `first_row` of the window on. Formats without rows of their own (tiles, but for EXR) are read
  /// as a whole, once. The checksums of a film are checked before its first rows are given away. Throws like
  /// read_image().
  Image read(int first_row, int n_rows);
  Image read_all() { return read(0, place_.window.height); }

 private:
  Image read_exr(int first_row, int n_rows);
  Image read_other(int first_row, int n_rows);
  std::string path_, layer_;
  ImagePlace place_;
  bool low_dynamic_range_ = false;
  std::vector<std::string> names_;     // of the three channels
  std::unique_ptr<ExrFile> exr_;       // either this
  std::unique_ptr<ImageReader> file_;  // or that
  bool checked_ = false;               // the checksums
  Image whole_;                        // of a file without rows
};

}  // namespace covary
