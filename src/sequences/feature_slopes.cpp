// SPDX-License-Identifier: Apache-2.0
#include "sequences/feature_slopes.h"

#include <Eigen/Dense>
#include <algorithm>

namespace covary {
namespace {

constexpr int kRadius = 3;
constexpr float kRidge = 0.001f;

}  // namespace

Image history_features(const Image& albedo, const Image& normal) {
  if (albedo.data.empty() || normal.data.empty()) return {};
  Image features(albedo.width, albedo.height, kHistoryFeatures);
  for (size_t i = 0; i < albedo.data.size(); i += 3) {
    std::copy_n(&albedo.data[i], 3, &features.data[2 * i]);
    std::copy_n(&normal.data[i], 3, &features.data[2 * i + 3]);
  }
  return features;
}

FeatureSlopes feature_slopes(const Image& picture, const Image& features, int x, int y) {
  using Features = Eigen::Matrix<float, kHistoryFeatures, 1>;
  using Colour = Eigen::Vector3f;
  // Differences from the centre pixel avoid cancellation in sums of squares.
  const Eigen::Map<const Features> own_features(features.pixel(x, y));
  const Eigen::Map<const Colour> own_colour(picture.pixel(x, y));
  Features sum = Features::Zero();
  Colour colours = Colour::Zero();
  Eigen::Matrix<float, kHistoryFeatures, kHistoryFeatures> products = products.Zero();
  Eigen::Matrix<float, kHistoryFeatures, 3> with_colours = with_colours.Zero();
  float n = 0;
  for (int j = std::max(y - kRadius, 0); j <= std::min(y + kRadius, picture.height - 1); ++j)
    for (int i = std::max(x - kRadius, 0); i <= std::min(x + kRadius, picture.width - 1); ++i) {
      const Features f = Eigen::Map<const Features>(features.pixel(i, j)) - own_features;
      const Colour s = Eigen::Map<const Colour>(picture.pixel(i, j)) - own_colour;
      if (!f.allFinite() || !s.allFinite()) continue;
      n += 1;
      sum += f;
      colours += s;
      products.noalias() += f * f.transpose();
      with_colours.noalias() += f * s.transpose();
    }
  FeatureSlopes slopes{};
  if (n < 2) return slopes;
  products.noalias() -= sum * sum.transpose() / n;
  with_colours.noalias() -= sum * colours.transpose() / n;
  products.diagonal().array() += kRidge * n;
  const Eigen::Matrix<float, kHistoryFeatures, 3> solved = products.llt().solve(with_colours);
  for (int i = 0; i < kHistoryFeatures; ++i)
    for (int c = 0; c < 3; ++c) slopes[static_cast<size_t>(3 * i + c)] = solved(i, c);
  return slopes;
}

}  // namespace covary
