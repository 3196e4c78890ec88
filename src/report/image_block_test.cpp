// SPDX-License-Identifier: Apache-2.0
#include "report/image_block.h"

#include <gtest/gtest.h>

#include <limits>

namespace covary {
namespace {

TEST(HalfBits, AreThoseOfIeeeBinary16) {
  EXPECT_EQ(half_bits(0), 0);
  EXPECT_EQ(half_bits(1), 0x3c00);
  EXPECT_EQ(half_bits(-2), 0xc000);
  EXPECT_EQ(half_bits(5.9604645e-8f), 1);  // the smallest subnormal, 2^-24
  EXPECT_EQ(half_bits(1 + 0.6f / 1024), 0x3c01) << "rounds to the nearest";
}

TEST(HalfBits, ClampFiniteValuesAndKeepOthers) {
  EXPECT_EQ(half_bits(1e9f), 0x7bff);
  EXPECT_EQ(half_bits(-1e9f), 0xfbff);
  EXPECT_EQ(half_bits(std::numeric_limits<float>::infinity()), 0x7c00);
  EXPECT_GT(half_bits(std::numeric_limits<float>::quiet_NaN()) & 0x7fff, 0x7c00);
}

TEST(Base64, AgreesWithTheExamplesOfRfc4648) {
  const auto encoded = [](const std::string& text) { return base64({text.begin(), text.end()}); };
  EXPECT_EQ(encoded(""), "");
  EXPECT_EQ(encoded("f"), "Zg==");
  EXPECT_EQ(encoded("fo"), "Zm8=");
  EXPECT_EQ(encoded("foo"), "Zm9v");
  EXPECT_EQ(encoded("foobar"), "Zm9vYmFy");
}

TEST(PredictedHalves, AreDifferencesFromTheNeighboursMean) {
  Image image(2, 2, 1);
  image.data = {1, 2, 0.5f, 0.5f};  // 0x3c00 0x4000 / 0x3800 0x3800
  // 0x3c00; 0x4000 - 0x3c00; 0x3800 - 0x3c00 = -0x400; 0x3800 - (0x3800 + 0x4000) / 2 = -0x400
  const std::vector<uint8_t> expected{0x78, 0x08, 0x07, 0x07, 0x00, 0x00, 0xff, 0xff};
  EXPECT_EQ(predicted_halves(image), expected);
}

TEST(PredictedHalves, OfChannelsInAFixedRatioAreSmall) {
  Image image(8, 1, 2);
  for (int x = 0; x < 8; ++x) image.pixel(x, 0)[0] = 1 << x, image.pixel(x, 0)[1] = 4 << x;
  const std::vector<uint8_t> bytes = predicted_halves(image);
  EXPECT_EQ(bytes[8], 0x10) << "a factor of 4 is 0x800 in the bits";
  for (int x = 1; x < 8; ++x) EXPECT_EQ(bytes[8 + x], 0);
}

TEST(EncodeImage, CompressesWhatIsUniform) {
  Image image(256, 256, 3);
  for (float& value : image.data) value = 0.25f;
  EXPECT_LT(encode_image(image).size(), 2000u);
}

}  // namespace
}  // namespace covary
