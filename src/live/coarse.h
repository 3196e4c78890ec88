// SPDX-License-Identifier: Apache-2.0
// Smaller versions of images and films: means over squares of pixels, cheap to denoise and to show.
#pragma once

#include <vector>

#include "film/film.h"
#include "film/grouped_image.h"

namespace covary {

/// `image` refers to `data`.
struct CoarseGroups {
  std::vector<float> data;
  GroupedImage image;
};

/// Mean of each square of stride x stride pixels, smaller at the right and lower edges.
Image coarse_image(const Image& image, int stride);
/// The same of each of the first `groups` groups, which must have samples in all pixels.
CoarseGroups coarse_groups(const Film& film, int stride, int groups);

/// The mean of all samples of several films of the same window, each pixel's weighted by its samples, and its standard
/// error; empty if some pixel has too few samples to tell. Light films are added instead.
struct MeanAndError {
  Image mean, std_error;
};
MeanAndError mean_of_films(const std::vector<const Film*>& films, const Film* light);

}  // namespace covary
