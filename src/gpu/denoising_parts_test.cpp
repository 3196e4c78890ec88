// SPDX-License-Identifier: Apache-2.0
// Means, their errors and limits of fireflies on a device, against denoising/denoising_parts.h.
#include "gpu/denoising_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "denoising/candidates.h"
#include "denoising/denoising_parts.h"
#include "denoising/limited_groups.h"
#include "estimators/test_images.h"
#include "filters/residual_correction.h"
#include "gpu/comparison.h"
#include "gpu/network_candidates.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;
using test_support::values_of;

/// A noisy image with fireflies and two pixels that are left out, one of them without any usable group.
test::Grouped image_of_groups(int groups, bool with_counts) {
  test::Grouped image = test::noisy_image(45, 37, groups, 3, 1, 0.05f);
  for (int x = 3; x < 45; x += 9) image.pixel(x, 20)[3 * (x % groups)] *= 1000;
  image.pixel(7, 5)[0] = std::numeric_limits<float>::quiet_NaN();
  std::fill_n(image.pixel(44, 36), 3 * groups, std::numeric_limits<float>::infinity());
  if (with_counts)
    for (int i = 0; i < 45 * 37; ++i) image.counts.push_back(static_cast<uint32_t>(4 * groups + i % 7));
  return image;
}

void expect_parts(int groups, bool with_counts) {
  SCOPED_TRACE(groups);
  device::Device& device = test_device();
  const test::Grouped image = image_of_groups(groups, with_counts);
  const DenoisingParts expected = covary::parts_of_mean(image.view());
  const Groups uploaded = upload(device, image.view());
  const std::array<PartBuffers, 3> found = gpu::parts_of_mean(device, uploaded);
  EXPECT_EQ(device.download(uploaded.valid), expected.valid);
  const std::array<const DenoisingPart*, 3> all = {&expected.whole, &expected.halves[0], &expected.halves[1]};
  for (size_t i = 0; i < all.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_TRUE(agree(all[i]->image.estimate.data, device.download(found[i].independent.mean)));
    EXPECT_TRUE(agree(all[i]->image.std_error.data, device.download(found[i].std_error)));
    EXPECT_TRUE(
        agree(values_of(all[i]->independent.variance_of_mean), device.download(found[i].independent.variance_of_mean)));
    ASSERT_EQ(all[i]->limited.has_value(), static_cast<bool>(found[i].limited));
    if (!all[i]->limited) continue;
    EXPECT_TRUE(agree(all[i]->limited->estimate.data, device.download(found[i].limited)));
    EXPECT_TRUE(agree(all[i]->limited->std_error.data, device.download(found[i].limited_error)));
  }
}

TEST(GpuParts, AreThoseOfTheProcessor) {
  for (const int groups : {12, 5, 3, 2}) expect_parts(groups, false);
}

TEST(GpuParts, WeightGroupsBySize) { expect_parts(12, true); }

TEST(GpuParts, NoticesAMissingLimit) {
  device::Device& device = test_device();
  const test::Grouped image = image_of_groups(12, false);
  const DenoisingParts expected = covary::parts_of_mean(image.view());
  const Groups uploaded = upload(device, image.view());
  const Limits limits = limits_of(device, uploaded, {});
  for (const bool planted : {false, true})
    EXPECT_EQ(agree(expected.whole.limited->estimate.data,
                    device.download(moments(device, uploaded, {}, &limits, planted).mean)),
              !planted);
}

TEST(GpuNetworkCandidates, HaveTheResidualsOfTheProcessor) {
  device::Device& device = test_device();
  const test::Grouped image = image_of_groups(12, true);
  const DenoisingParts parts = covary::parts_of_mean(image.view());
  const Image& clean = parts.halves[0].limited->estimate;  // stands for a network's image
  const Groups uploaded = upload(device, image.view());
  const std::array<PartBuffers, 3> on_device = gpu::parts_of_mean(device, uploaded);
  const auto result = device.make<float>(kNetworkCandidates * clean.data.size());
  for (const bool planted : {false, true}) {
    write_network_candidates(device, uploaded, on_device[0], relative_counts_of(device, image.view(), {}), clean,
                             result, planted);
    for (size_t i = 0; i < kNetworkResiduals.size(); ++i) {
      Image expected = clean;
      add_residual(parts.whole.limited->independent, kNetworkResiduals[i], parts.valid, expected);
      std::vector<float> found(clean.data.size());
      device.read(result, found, (i + 1) * found.size());
      EXPECT_EQ(static_cast<bool>(agree(expected.data, found)), !planted);
    }
  }
}

}  // namespace
}  // namespace covary::gpu
