// SPDX-License-Identifier: Apache-2.0
#include "metrics/compared_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/error.h"

namespace covary {
namespace {

constexpr int kBandPixels = 1 << 20;  // 12 MB per image

}  // namespace

ComparedRows::Band ComparedRows::rows(int first_row, int n_rows) {
  Band band = read(first_row, n_rows);
  for (const Image& image : denominators_) band.denominators.push_back(image.pixel(0, first_row));
  return band;
}

void ComparedRows::set_denominators(std::span<const Image> denominators) {
  for (const Image& image : denominators) {
    COVARY_CHECK(image.channels == 3, "3 channels");
    if (image.width != width_ || image.height != height_)
      throw Error(ErrorCode::kInput, fmt::format("{} x {} pixels are compared; the denominator has {} x {}", width_,
                                                 height_, image.width, image.height));
  }
  denominators_ = denominators;
}

WholeImages::WholeImages(const Image& image, std::span<const Image> references) {
  COVARY_CHECK(references.size() == 1 || references.size() == 2, "one or two references");
  for (const Image& r : references) {
    if (r.width != image.width || r.height != image.height)
      throw Error(ErrorCode::kInput, fmt::format("the image has {} x {} pixels, the reference {} x {}", image.width,
                                                 image.height, r.width, r.height));
    COVARY_CHECK(r.channels == 3 && image.channels == 3, "3 channels");
    whole_.references.push_back(&r);
  }
  whole_.image = &image;
  width_ = image.width, height_ = band_rows_ = image.height;
}

ComparedRows::Band WholeImages::read(int first_row, int n_rows) {
  COVARY_CHECK(first_row == 0 && n_rows == height_, "all rows");
  return whole_;
}

ComparedFiles::ComparedFiles(std::span<ImageRows* const> images, const CropWindow& window) : window_(window) {
  COVARY_CHECK(images.size() == 2 || images.size() == 3, "an image and one or two references");
  for (ImageRows* file : images) sources_.push_back({file, {}, 0});
  width_ = window.width, height_ = window.height;
  band_rows_ = std::clamp(kBandPixels / std::max(width_, 1), 1, height_);
}

/// Keeps the rows that both bands share: many formats restart from the top to go back.
void ComparedFiles::move_to(int first_row, int n_rows, Source& source) const {
  const int kept_end = source.first + source.rows.height;
  const int n_kept = first_row >= source.first ? std::clamp(kept_end - first_row, 0, n_rows) : 0;
  Image rows(width_, n_rows, 3);
  if (n_kept > 0)
    std::copy_n(source.rows.pixel(0, first_row - source.first), static_cast<size_t>(n_kept) * width_ * 3,
                rows.data.begin());
  source.rows = Image();
  if (n_kept < n_rows) {
    const CropWindow& own = source.file->place().window;
    const Image read = source.file->read(first_row + n_kept + window_.y - own.y, n_rows - n_kept);
    for (int y = 0; y < read.height; ++y)
      std::copy_n(read.pixel(window_.x - own.x, y), static_cast<size_t>(width_) * 3, rows.pixel(0, n_kept + y));
  }
  source.rows = std::move(rows), source.first = first_row;
}

ComparedRows::Band ComparedFiles::read(int first_row, int n_rows) {
  for (Source& source : sources_) move_to(first_row, n_rows, source);
  Band band;
  band.image = &sources_[0].rows;
  for (size_t i = 1; i < sources_.size(); ++i) band.references.push_back(&sources_[i].rows);
  return band;
}

}  // namespace covary
