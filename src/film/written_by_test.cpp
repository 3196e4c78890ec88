// SPDX-License-Identifier: Apache-2.0
#include "film/written_by.h"

#include <gtest/gtest.h>

namespace covary::written_by_test {
namespace {

TEST(WrittenBy, TellsByAttributes) {
  EXPECT_EQ(written_by({{"covary:seed", "1"}, {"cycles.ViewLayer.samples", "64"}}), Renderer::kCovary);
  EXPECT_EQ(written_by({{"cycles.ViewLayer.samples", "64"}}), Renderer::kBlender);
  EXPECT_EQ(written_by({{"BlenderMultiChannel", "Blender V2.55.1 and newer"}}), Renderer::kBlender);
  EXPECT_EQ(written_by({{"generatedBy", "Mitsuba version 3.9.1"}}), Renderer::kMitsuba);
  EXPECT_EQ(written_by({{"generatedBy", "another"}}), Renderer::kUnknown);
  EXPECT_EQ(written_by({{"samplesPerPixel", "64"}, {"renderTimeSeconds", "1.5"}}), Renderer::kPbrt);
  EXPECT_EQ(written_by({{"samplesPerPixel", "64"}}), Renderer::kUnknown);
  EXPECT_EQ(written_by({}), Renderer::kUnknown);
}

TEST(WrittenBy, SaysWhereASettingIs) {
  EXPECT_EQ(where_to_set(RenderSetting::kSeed, Renderer::kBlender), "in Blender scene.cycles.seed");
  EXPECT_EQ(where_to_set(RenderSetting::kFloats, Renderer::kMitsuba), "in Mitsuba component_format \"float32\"");
  EXPECT_EQ(where_to_set(RenderSetting::kSeed, Renderer::kCovary), "in covary --seed");
  EXPECT_EQ(where_to_set(RenderSetting::kSeed, Renderer::kUnknown),
            "in Blender scene.cycles.seed, in Mitsuba seed of mi.render(), in pbrt --seed, in LuxCore "
            "renderengine.seed");
}

}  // namespace
}  // namespace covary::written_by_test
