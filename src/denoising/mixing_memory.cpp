// SPDX-License-Identifier: Apache-2.0
#include "denoising/mixing_memory.h"

#include <algorithm>

#include "denoising/network_memory.h"

namespace covary {
namespace {

// Measured: differences between images of 320 x 240 and 640 x 480 pixels, and a tenth more.
/// Images of three sets of samples, the candidates of each, and what filters and the network that weighs them hold.
constexpr double kWithFeatures = 680, kWithoutFeatures = 470;
/// The same beside images of Open Image Denoise, without the network that weighs.
constexpr double kWithFeaturesAndNetwork = 660, kWithNetwork = 560;
/// While Open Image Denoise runs: images of three sets of samples, its guides and images.
constexpr double kBesideNetwork = 320, kFeaturesBesideNetwork = 290;
/// The means without fireflies of both halves, which have none if they are single groups.
constexpr double kLimitedHalves = 2 * 12 * sizeof(float);
/// Before there are candidates, a half of the groups is copied, and once more without fireflies.
constexpr double kParts = 440, kCopiedGroup = 3 * sizeof(float);

double limited_halves(const MixtureSize& size) { return size.groups > 2 ? kLimitedHalves : 0; }

}  // namespace

double bytes_of_mixture(const MixtureSize& size) {
  const double candidates = size.has_network ? (size.has_features ? kWithFeaturesAndNetwork : kWithNetwork)
                                             : (size.has_features ? kWithFeatures : kWithoutFeatures);
  return std::max(candidates + limited_halves(size), kParts + kCopiedGroup * size.groups);
}

double memory_beside_network(const MixtureSize& size, double n_pixels) {
  const double of_pixel = kBesideNetwork + (size.has_features ? kFeaturesBesideNetwork : 0) + limited_halves(size);
  return n_pixels * of_pixel + network_tile_memory(n_pixels);
}

double memory_of_kept_rows(int halo, double width) {
  // Images of three sets of samples and their candidates; of the halo on both sides, all but what samples and
  // candidates themselves reach.
  constexpr double kOfPixel = 340, kOfHalo = 0.85;
  return kOfPixel * 2 * kOfHalo * halo * width;
}

double bytes_of_pair_mixture(bool with_network) {
  // Images of three sets of samples, planes of filters and sums, half of 12 groups; the network and its candidates.
  constexpr double kOfFilters = 440, kOfNetwork = 1250;
  return with_network ? kOfNetwork : kOfFilters;
}

}  // namespace covary
