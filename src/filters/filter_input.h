// SPDX-License-Identifier: Apache-2.0
// Input of the filters of dependent tests [Csonka2002]: mean colours of both images, sample variance, and numbers of
// samples.
#pragma once

#include <vector>

#include "film/grouped_image.h"
#include "filters/norm.h"
#include "filters/planes.h"

namespace covary {

/// Planes have a border that matches nothing: far away, without samples.
struct FilterInput {
  Planes dependent;        ///< 3: means C_d of the CRN image; kFar outside and at invalid pixels
  Planes independent;      ///< 3: means C_i of the independent image
  Planes variance;         ///< 1: sigma^2 of one sample
  Planes count;            ///< 1: samples N of the independent image; 0 outside and at invalid pixels
  Norm norm = Norm::kSum;  ///< of sigma

  int width() const { return count.width(); }
  int height() const { return count.height(); }
};

/// sigma^2 from the samples of the CRN image, or of both images weighted by degrees of freedom.
enum class VarianceSource { kDependent, kBoth };

/// Degrees of freedom of GroupedImage::sample_variance(): samples minus one if it uses individual samples, otherwise
/// groups minus one.
double variance_freedom(const GroupedImage& image, int x, int y);

/// `smoothing`: side of the window over which sigma^2 is averaged, odd; 1: none.
FilterInput filter_input(const GroupedImage& crn, const GroupedImage& independent,
                         const std::vector<unsigned char>& valid, VarianceSource source, int smoothing, int border,
                         Norm norm = Norm::kSum);

/// Mean over the window around each pixel of a plane, restricted to pixels inside the frame with nonzero `valid`; 0 if
/// there are none. The result has the border `border`, filled with `outside`.
Planes box_mean(const Planes& image, const std::vector<unsigned char>& valid, int window, int border, float outside,
                int plane = 0);

/// Plane c is the mean of channel c over all samples of a pixel, 0 if it has none; `outside` beyond the frame and where
/// `valid` is 0.
Planes mean_planes(const GroupedImage& image, const std::vector<unsigned char>& valid, int border, float outside);

}  // namespace covary
