// SPDX-License-Identifier: Apache-2.0
// An image and its references, read in bands of rows so that they need not fit in memory.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "film/image_rows.h"

namespace covary {

/// An image F and one or two references, all of the same size, 3 channels.
class ComparedRows {
 public:
  virtual ~ComparedRows() = default;
  int width() const { return width_; }
  int height() const { return height_; }
  /// Recommended number of rows per call, at least 1.
  int band_rows() const { return band_rows_; }

  struct Band {
    const Image* image = nullptr;
    std::vector<const Image*> references;
    std::vector<const float*> denominators;  ///< first values of these rows; empty: none
  };
  /// Rows [first_row, first_row + n_rows); valid until the next call. Bands may overlap.
  Band rows(int first_row, int n_rows);
  /// What relative errors are relative to (compute_metric()): images of the same size, which must outlive the rows.
  /// Throws Error(kInput) if their sizes differ.
  void set_denominators(std::span<const Image> denominators);

 protected:
  /// Image and references of rows().
  virtual Band read(int first_row, int n_rows) = 0;
  int width_ = 0, height_ = 0, band_rows_ = 0;

 private:
  std::span<const Image> denominators_;
};

/// Images in memory, as one band. Throws Error(kInput) if their sizes differ.
class WholeImages final : public ComparedRows {
 public:
  /// Stores pointers; the images must outlive it. `references`: one or two.
  WholeImages(const Image& image, std::span<const Image> references);

 private:
  Band read(int first_row, int n_rows) override;
  Band whole_;
};

/// Images in files, read band by band.
class ComparedFiles final : public ComparedRows {
 public:
  /// `images`: F and its references, each covering `window`.
  ComparedFiles(std::span<ImageRows* const> images, const CropWindow& window);

 private:
  Band read(int first_row, int n_rows) override;
  struct Source {
    ImageRows* file;
    Image rows;     ///< the current band
    int first = 0;  ///< its first row
  };
  void move_to(int first_row, int n_rows, Source& source) const;
  std::vector<Source> sources_;
  CropWindow window_;
};

}  // namespace covary
