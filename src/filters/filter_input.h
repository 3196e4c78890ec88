// SPDX-License-Identifier: Apache-2.0
// What the filters of dependent tests [Csonka2002] read: the mean colours of both images, the variance of samples, and
// how many there are.
#pragma once

#include <cmath>
#include <vector>

#include "film/grouped_image.h"
#include "filters/planes.h"

namespace covary {

/// Planes have a border that reads as "no partner": far away, without samples.
struct FilterInput {
  Planes dependent;    ///< 3: means C_d of the CRN image; kFar outside and at pixels that are not valid
  Planes independent;  ///< 3: means C_i of the independent image
  Planes variance;     ///< 1: sigma^2 of one sample
  Planes count;        ///< 1: samples N of the independent image; 0 outside and at pixels that are not valid

  int width() const { return count.width(); }
  int height() const { return count.height(); }
};

/// Length of a colour or of a difference of colours: sum of the absolute values of the channels, [Csonka2002] end of
/// Sec. 4.
inline float colour_length(const Spectrum& colour) {
  return std::abs(colour.r) + std::abs(colour.g) + std::abs(colour.b);
}

/// sigma^2 from the samples of the CRN image, or of both images weighted by their degrees of freedom.
enum class VarianceSource { kDependent, kBoth };

/// Degrees of freedom of GroupedImage::sample_variance(): samples beyond the first where these tell of the variance,
/// otherwise groups beyond the first.
double variance_freedom(const GroupedImage& image, int x, int y);

/// `smoothing`: side of the window over which sigma^2 is averaged, odd; 1: not at all.
FilterInput filter_input(const GroupedImage& crn, const GroupedImage& independent,
                         const std::vector<unsigned char>& valid, VarianceSource source, int smoothing, int border);

/// Mean of the pixels of a window inside the frame where `valid` is not 0, for each pixel of a plane; 0 where there are
/// none. The result has the border and, outside, the value `outside`.
Planes box_mean(const Planes& image, const std::vector<unsigned char>& valid, int window, int border, float outside,
                int plane = 0);

/// Plane c is the mean of channel c of all samples of a pixel, 0 where it has none; `outside` beyond the frame and
/// where `valid` is 0.
Planes mean_planes(const GroupedImage& image, const std::vector<unsigned char>& valid, int border, float outside);

}  // namespace covary
