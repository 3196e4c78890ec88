// SPDX-License-Identifier: Apache-2.0
#include "film/denoised_by.h"

#include <gtest/gtest.h>

#include <vector>

namespace covary {
namespace {

TEST(DenoisedBy, IsToldByAttributesAndLayers) {
  EXPECT_EQ(denoised_by({}, {}), "");
  EXPECT_EQ(denoised_by({{"covary:estimator", "iicv"}, {"covary:samples", "64"}}, {}), "");
  EXPECT_EQ(denoised_by({{"covary:estimator", "mixture --denoise auto --oidn off"}}, {}),
            "mixture --denoise auto --oidn off");
  EXPECT_EQ(denoised_by({{"covary:denoiser", "Open Image Denoise 2.5.1"}}, {}), "Open Image Denoise 2.5.1");
  std::vector<ExrFile::Channel> channels(2);
  channels[0].name = "ViewLayer.Combined.R", channels[1].name = "ViewLayer.Denoising Albedo.R";
  EXPECT_EQ(denoised_by({}, channels), "") << "features alone";
  channels[1].name = "ViewLayer.Noisy Image.R";
  EXPECT_NE(denoised_by({}, channels).find("Cycles"), std::string::npos);
  EXPECT_NE(denoised_by({}, channels, "ViewLayer.Combined"), "");
  EXPECT_EQ(denoised_by({}, channels, "ViewLayer.Noisy Image"), "");
}

}  // namespace
}  // namespace covary
