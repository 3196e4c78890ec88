// SPDX-License-Identifier: Apache-2.0
// Row-by-row reading of images of any renderer that are larger than memory.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "film/image_file.h"
#include "imageio/image_io.h"

namespace covary {

/// An open image file, of which three channels are read as linear RGB.
class ImageRows {
 public:
  /// `layer` as in read_image(), and the same errors. Reads no pixels yet.
  explicit ImageRows(const std::string& path, const std::string& layer = "",
                     ChecksumPolicy checksums = ChecksumPolicy::kCheck);

  const ImagePlace& place() const { return place_; }
  /// Whether the file holds 8- or 16-bit integers.
  bool low_dynamic_range() const { return low_dynamic_range_; }
  /// Of the three channels as stored.
  const ColourSpace& colours() const { return colours_; }
  /// From now on, read() converts colours (holds_colours) to this space. At first, it returns values as stored. Throws
  /// Error(kInput) if the file's own space is none.
  void convert_to(const ColourSpace& colours);

  /// `n_rows` rows of the window, starting at `first_row`. Formats without row access (tiles, except in EXR) are read
  /// whole, once. The checksums of a film are verified before its first rows are returned. Throws like read_image().
  Image read(int first_row, int n_rows);
  Image read_all() { return read(0, place_.window.height); }

  /// Whether the layer has alpha; whether its colours are not multiplied by it, as in PNG.
  bool has_alpha() const;
  bool has_straight_alpha() const;
  /// Its values, 1 channel, likewise.
  Image read_alpha(int first_row, int n_rows);

 private:
  Image read_stored(int first_row, int n_rows);
  Image read_exr(int first_row, int n_rows);
  Image read_other(int first_row, int n_rows);
  std::string path_, layer_;
  ImagePlace place_;
  ColourSpace colours_;
  std::optional<RgbMatrix> conversion_;
  bool low_dynamic_range_ = false;
  std::vector<std::string> names_;           // of the three channels
  std::unique_ptr<ExrFile> exr_;             // exactly one of
  std::unique_ptr<ImageReader> file_;        // these two is set
  std::unique_ptr<ImageReader> alpha_file_;  // its own, since formats go back only to the top
  std::string alpha_;                        // channel of EXR
  bool checked_ = false;                     // whether checksums were verified
  Image whole_;                              // of a format without row access
};

}  // namespace covary
