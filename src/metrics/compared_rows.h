// SPDX-License-Identifier: Apache-2.0
// An image and its references, given in bands of rows, so that their size is not limited by memory.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "film/image_rows.h"

namespace covary {

/// One image F and one or two references, of equal size, 3 channels.
class ComparedRows {
 public:
  virtual ~ComparedRows() = default;
  int width() const { return width_; }
  int height() const { return height_; }
  /// How many rows to ask for at a time, at least 1.
  int band_rows() const { return band_rows_; }

  struct Band {
    const Image* image = nullptr;
    std::vector<const Image*> references;
  };
  /// Rows [first_row, first_row + n_rows), valid until the next call. Bands may overlap.
  virtual Band rows(int first_row, int n_rows) = 0;

 protected:
  int width_ = 0, height_ = 0, band_rows_ = 0;
};

/// Images in memory, given as one band. Throws Error(kInput) when their sizes differ.
class WholeImages final : public ComparedRows {
 public:
  /// Keeps pointers. `references`: one or two.
  WholeImages(const Image& image, std::span<const Image> references);
  Band rows(int first_row, int n_rows) override;

 private:
  Band whole_;
};

/// Images in files, read band by band.
class ComparedFiles final : public ComparedRows {
 public:
  /// `images`: F and its references, all of which hold the pixels of `window`.
  ComparedFiles(std::span<ImageRows* const> images, const CropWindow& window);
  Band rows(int first_row, int n_rows) override;

 private:
  struct Source {
    ImageRows* file;
    Image rows;     ///< last given
    int first = 0;  ///< which they are
  };
  void move_to(int first_row, int n_rows, Source& source) const;
  std::vector<Source> sources_;
  CropWindow window_;
};

}  // namespace covary
