// SPDX-License-Identifier: Apache-2.0
#include "formats/xml_values.h"

#include <gtest/gtest.h>

#include "support/files.h"

namespace covary {
namespace {

using test_support::message_of;

TEST(XmlValues, ReadsNumbers) {
  EXPECT_EQ(parse_number(" -1.5e-3\n"), -1.5e-3);
  EXPECT_EQ(parse_number("+2"), 2);
  EXPECT_EQ(parse_integer(" -7 "), -7);
  EXPECT_TRUE(parse_boolean("True"));
  EXPECT_FALSE(parse_boolean(" false"));
  EXPECT_EQ(parse_numbers("1, 2 3\t4", 4), (std::vector<double>{1, 2, 3, 4}));
}

TEST(XmlValues, RejectsWhatIsNotANumber) {
  EXPECT_EQ(message_of([] { parse_number("1.5x"); }), "'1.5x' is not a number");
  EXPECT_EQ(message_of([] { parse_number(""); }), "'' is not a number");
  EXPECT_EQ(message_of([] { parse_number("nan"); }), "'nan' is not finite");
  EXPECT_EQ(message_of([] { parse_number("inf"); }), "'inf' is not finite");
  EXPECT_EQ(message_of([] { parse_integer("1.5"); }), "'1.5' is not an integer");
  EXPECT_EQ(message_of([] { parse_integer("99999999999999999999"); }), "'99999999999999999999' is too large");
  EXPECT_EQ(message_of([] { parse_boolean("yes"); }), "'yes' is not a boolean; expected 'true' or 'false'");
  EXPECT_EQ(message_of([] { parse_numbers("1 2", 3); }), "'1 2' has 2 values; expected 3");
  EXPECT_EQ(message_of([] { parse_number(std::string(100, 'a')); }),
            "'" + std::string(57, 'a') + "...' is not a number");
}

TEST(XmlValues, ReadsColours) {
  EXPECT_EQ(parse_rgb("0.1, 0.2, 0.3").rgb, Spectrum(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(parse_rgb("0.5").rgb, Spectrum(0.5f));
  // IEC 61966-2-1: 0x80 = 128/255 is 0.21586 linear; 0x0a = 10/255 lies on the straight part, 10/255/12.92.
  const Spectrum hex = parse_rgb("#ff800a").rgb;
  EXPECT_EQ(hex.r, 1.0f);
  EXPECT_NEAR(hex.g, 0.215861f, 1e-6f);
  EXPECT_NEAR(hex.b, 10 / 255.0f / 12.92f, 1e-8f);
  EXPECT_EQ(parse_srgb("#ff800a").rgb, hex);
  EXPECT_NEAR(parse_srgb("0.5").rgb.g, 0.214041f, 1e-6f);
}

TEST(XmlValues, RejectsWrongColours) {
  EXPECT_EQ(message_of([] { parse_rgb("1 2"); }), "'1 2' has 2 values; a colour is one or three numbers or '#rrggbb'");
  EXPECT_EQ(message_of([] { parse_rgb("#ff00"); }), "'#ff00' is not a colour; expected '#rrggbb'");
  EXPECT_EQ(message_of([] { parse_rgb("#gg0000"); }), "'#gg0000' is not a colour; expected '#rrggbb'");
  EXPECT_EQ(message_of([] { parse_rgb("1e99"); }), "1e+99 is too large");
}

TEST(XmlValues, ReadsSpectra) {
  EXPECT_EQ(parse_spectrum("0.5").samples, (std::vector<std::pair<float, float>>{{0.0f, 0.5f}}));
  EXPECT_EQ(parse_spectrum("400:0.5, 700:0.25").samples,
            (std::vector<std::pair<float, float>>{{400.0f, 0.5f}, {700.0f, 0.25f}}));
  EXPECT_EQ(parse_spectrum_file("# a comment\n400 0.5 # more\r\n\n700, 0.25").samples,
            (std::vector<std::pair<float, float>>{{400.0f, 0.5f}, {700.0f, 0.25f}}));
}

TEST(XmlValues, RejectsWrongSpectra) {
  EXPECT_EQ(message_of([] { parse_spectrum("400:1, 400:2"); }),
            "the wavelengths of a spectrum must increase, but 400 follows 400");
  EXPECT_EQ(message_of([] { parse_spectrum("400:1"); }), "a spectrum needs at least two wavelengths");
  EXPECT_EQ(message_of([] { parse_spectrum("0.1 0.2 0.3"); }),
            "'0.1' is not a spectrum sample; expected one number, or 'wavelength:value' pairs");
  EXPECT_EQ(message_of([] { parse_spectrum("400:a, 500:1"); }), "'a' is not a number");
  EXPECT_EQ(message_of([] { parse_spectrum_file("400 1\n500 x\n"); }),
            "line 2 is '500 x'; expected a wavelength and a value");
}

TEST(XmlValues, BlackbodyFollowsPlancksLaw) {
  // B(500 nm, 5000 K) = 1.2107e13 W/(m^3 sr), that is 12107 per nanometre.
  const SampledSpectrum spectrum = blackbody_spectrum(5000, 1);
  ASSERT_EQ(spectrum.samples.size(), 471u);
  EXPECT_EQ(spectrum.samples[140].first, 500);
  EXPECT_NEAR(spectrum.samples[140].second, 12107, 1);
  EXPECT_NEAR(blackbody_spectrum(5000, 0.5).samples[140].second, 12107 / 2.0, 1);
  // Wien's law: the maximum at 5000 K lies at 2897772 nm K / 5000 K = 579.6 nm.
  const auto brightest = std::max_element(spectrum.samples.begin(), spectrum.samples.end(),
                                          [](const auto& a, const auto& b) { return a.second < b.second; });
  EXPECT_NEAR(brightest->first, 579.6f, 1);
  EXPECT_EQ(message_of([] { blackbody_spectrum(0, 1); }),
            "the temperature 0 K of a black body must lie in (0, 1000000]");
}

}  // namespace
}  // namespace covary
