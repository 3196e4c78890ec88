// SPDX-License-Identifier: Apache-2.0
// Reconstruction filters with negative lobes. Positions are drawn in proportion to the filter's magnitude, and samples
// get weights of either sign, so that each still belongs to one pixel.
#pragma once

#include <array>
#include <string>

namespace covary {

/// Such a filter along one axis; a pixel's filter is the product of two.
class LobedFilter {
 public:
  /// Mitchell and Netravali's with B and C [MitchellNetravali1988], radius 2.
  static const LobedFilter& mitchell(float b, float c);
  /// Catmull and Rom's spline, radius 2: Mitchell's with B = 0 and C = 1/2.
  static const LobedFilter& catmull_rom();
  /// A sinc times the main lobe of a wider one, radius `lobes` >= 1.
  static const LobedFilter& lanczos(int lobes);

  /// Name and parameters.
  const std::string& text() const { return text_; }
  float radius() const { return radius_; }
  /// The filter at a distance in pixels from the pixel's centre; its integral is 1.
  double value(double distance) const;

  struct Sample {
    float offset;  ///< from the pixel's centre
    float weight;  ///< filter over density; its magnitude is about the integral of the filter's magnitude
  };
  Sample sample(float u) const;

 private:
  static constexpr int kCells = 512;

  /// `lobes` 0: a cubic spline.
  LobedFilter(std::string text, float radius, int lobes, double b, double c);
  /// The same, alive as long as the process; there are few.
  static const LobedFilter& shared(const std::string& text, float radius, int lobes, double b, double c);
  double shape(double x) const;

  std::string text_;
  float radius_;
  int lobes_;
  double b_, c_, scale_ = 1;
  std::array<double, kCells + 1> sums_{};  // of the filter's magnitude, from 0 to 1, at the edges of equal cells
};

}  // namespace covary
