// SPDX-License-Identifier: Apache-2.0
#include "combine/grouped_source.h"

#include <fmt/format.h>

#include <memory>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/number_text.h"

namespace covary {

GroupedSource source_of(const GroupedFile& file) {
  GroupedSource source;
  source.origin = {file.name(),        file.place(),    file.sampling(),      file.scene_hash(),
                   file.settings(),    file.has_half(), file.is_light_film(), file.has_light_added(),
                   file.is_one_film(), file.denoised(), file.colours()};
  source.origin.renderer = file.renderer();
  if (file.source().files.size() == static_cast<size_t>(file.groups())) source.origin.renders = file.source().files;
  source.width = file.width(), source.height = file.height(), source.groups = file.groups();
  source.samples = file.samples();
  struct Read {
    GroupedFile::Rows rows;
    int first = -1, n = 0;
  };
  source.rows = [&file, read = std::make_shared<Read>()](int first, int n) {
    if (first != read->first || n != read->n) file.read_rows(first, n, read->rows);
    read->first = first, read->n = n;
    return file.view(read->rows, n);
  };
  return source;
}

GroupedSource source_of(const GroupedImage& image, ImageOrigin origin) {
  if (image.width < 1 || image.height < 1 || image.groups < 1 || !image.data)
    throw Error(ErrorCode::kUsage,
                fmt::format("{}: the image is empty: {} x {} pixels, {}{}", origin.name, image.width, image.height,
                            counted(image.groups, "group"), image.data ? "" : ", no data"));
  GroupedSource source;
  source.origin = std::move(origin);
  source.width = image.width, source.height = image.height, source.groups = image.groups;
  ImagePlace& place = source.origin.place;
  if (place.frame_width == 0) place = {image.width, image.height, {0, 0, image.width, image.height}};
  if (place.window.width != image.width || place.window.height != image.height)
    throw Error(ErrorCode::kUsage, fmt::format("{}: {} x {} pixels, but its place has {} x {}", source.origin.name,
                                               image.width, image.height, place.window.width, place.window.height));
  GroupedImage whole = image;  // its rows know the mean count of the whole
  if (image.counts && image.mean_count == 0) {
    const size_t n_pixels = static_cast<size_t>(image.width) * image.height;
    whole.mean_count = std::accumulate(image.counts, image.counts + n_pixels, 0.0) / static_cast<double>(n_pixels);
  }
  source.samples = whole.mean_count;
  source.rows = [image = whole](int first, int n) { return rows_of(image, first, n); };
  return source;
}

GroupedSource source_of(const Film& film, const std::string& name) {
  ImageOrigin origin;
  origin.name = name, origin.is_one_film = true;
  origin.place = {film.frame_width(), film.frame_height(), film.crop()};
  return source_of(rows_of(film, 0, film.height()), origin);
}

}  // namespace covary
