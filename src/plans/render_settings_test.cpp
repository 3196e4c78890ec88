// SPDX-License-Identifier: Apache-2.0
// Options of rendering: parsing, errors, and the passes they result in.
#include "plans/render_settings.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "support/files.h"

namespace covary {
namespace {

using test_support::message_of;
using Words = std::vector<std::string>;

TEST(RenderSettings, ValuesReachTheRequest) {
  const RenderSettings s = settings_from<RenderSettings>({{"spp", "48"},
                                                          {"until", "relmse-p95=0.25"},
                                                          {"time", "2.5"},
                                                          {"resolution", "640x360"},
                                                          {"crop", "1,2,30,40"},
                                                          {"split", "1:3"},
                                                          {"seed", "18446744073709551615"},
                                                          {"sampler", "sobol"},
                                                          {"rfilter", "tent"},
                                                          {"no-preview", ""}});
  EXPECT_EQ(s.request.spp, 48u);
  EXPECT_EQ(s.request.until, 0.25);
  EXPECT_TRUE(s.request.until_in_blocks);
  EXPECT_EQ(s.request.seconds, 2.5);
  EXPECT_EQ(s.width, 640);
  EXPECT_EQ(s.height, 360);
  EXPECT_EQ(s.request.crop, (CropWindow{1, 2, 30, 40}));
  EXPECT_EQ(s.passes.split, (std::array<double, 2>{0.25, 0.75}));
  EXPECT_EQ(s.request.seed, UINT64_MAX);
  EXPECT_EQ(s.request.sampler, Sampler::kSobol);
  EXPECT_EQ(s.request.filter->kind, FilterKind::kTent);
  EXPECT_FALSE(s.request.preview);
  const RenderSettings standard = settings_from<RenderSettings>({});
  EXPECT_TRUE(standard.request.preview);
  EXPECT_FALSE(standard.request.filter || standard.request.sampler || standard.passes.split || standard.request.crop);
}

TEST(RenderSettings, WhatIsNoValueIsRefused) {
  const auto problem = [](const char* name, const char* text) {
    return message_of([&] { settings_from<RenderSettings>({{name, text}}); }, ErrorCode::kUsage);
  };
  for (const char* text : {"640", "0x5", "5x65537", "5x5x5", "-5x5", "axb"})
    EXPECT_EQ(problem("resolution", text),
              fmt::format("`resolution` '{}': expected WIDTHxHEIGHT, each from 1 to 65536, e.g. 1280x720", text));
  for (const char* text : {"1,2,3", "1,2,3,4,5", "-1,2,3,4", "1,2,3,65537"})
    EXPECT_EQ(problem("crop", text),
              fmt::format("`crop` '{}': expected X,Y,WIDTH,HEIGHT in pixels, e.g. 240,560,240,160", text));
  for (const char* text : {"1", "0:1", "1:0", "1:2:3", "half"})
    EXPECT_EQ(problem("split", text),
              fmt::format("`split` '{}': expected CRN:INDEPENDENT, two numbers above 0, e.g. 1:1", text));
  for (const char* text : {"0.1", "relmse=0", "relmse=x", "relmse-p95=-1", "mse=1"})
    EXPECT_EQ(
        problem("until", text),
        fmt::format("`until` '{}': expected relmse=X, relmse-p95=X or relative=X with X > 0, e.g. relmse=0.005", text));
  EXPECT_EQ(message_of([] {
              settings_from<RenderSettings>({{"resume", ""}, {"overwrite", ""}});
            }),
            "`overwrite` excludes `resume`");
}

TEST(RenderSettings, TheDefaultIsDenoisedAndANamedEstimatorIsNot) {
  const auto modes = [](const OptionValues& values) {
    const RenderSettings s = settings_from<RenderSettings>(values);
    return s.estimator + " " + s.denoising.mode;
  };
  EXPECT_EQ(modes({}), "mixture auto");
  EXPECT_EQ(modes({{"denoise", "bias"}}), "mixture bias");
  EXPECT_EQ(modes({{"denoise", "none"}}), "mixture none");
  EXPECT_EQ(modes({{"oidn", "off"}}), "mixture auto");
  EXPECT_EQ(modes({{"estimator", "iicv"}}), "iicv none");
  EXPECT_EQ(modes({{"estimator", "none"}}), "none none");
  EXPECT_EQ(modes({{"estimator", "iicv"}, {"denoise", "auto"}}), "iicv auto");
  EXPECT_EQ(modes({{"sampling", "crn"}}), "none none");
  EXPECT_EQ(estimator_of(settings_from<RenderSettings>({{"oidn", "off"}}), {}).text,
            "mixture --denoise auto --oidn off");
}

/// Two methods of a suite may share films if these are equal.
TEST(RenderSettings, WordsOfPassesLeaveOutWhatOnlyTheImageNeeds) {
  const Words standard = pass_words({}, {}, {}), pair = pass_words({{"estimator", "iicv"}}, {}, {});
  EXPECT_EQ(pair, Words{"pair"});
  EXPECT_EQ(pass_words({{"denoise", "bias"}}, {}, {}), standard);
  EXPECT_EQ(pass_words({{"estimator", "none"}, {"denoise", "auto"}, {"oidn", "off"}}, {}, {}), standard);
  EXPECT_NE(pass_words({{"estimator", "none"}}, {}, {}), standard) << "a film without groups";
  const auto of_estimator = [](const char* name, const OptionValues& values) {
    return pass_words({{"estimator", name}}, {}, values);
  };
  EXPECT_EQ(of_estimator("iduw", {}), pair);
  EXPECT_EQ(of_estimator("iicv", {{"paper", ""}, {"k", "5"}}), pair);
  EXPECT_EQ(
      pass_words({{"estimator", "iicv"}, {"denoise", "error"}, {"oidn", "off"}, {"output", "a.exr"}, {"aovs", ""}}, {},
                 {}),
      pair);
  const auto more = [](const OptionValues::value_type& option) {
    return pass_words({{"estimator", "iicv"}, option}, {}, {});
  };
  // The same option affects the passes of one estimator but not of another.
  EXPECT_NE(of_estimator("dependent-tests", {{"paper", ""}}), of_estimator("dependent-tests", {}));
  EXPECT_EQ(of_estimator("dependent-tests", {{"window", "5"}}), of_estimator("dependent-tests", {}));
  for (const Words& other :
       {of_estimator("none", {}), of_estimator("dependent-tests", {}), of_estimator("polynomials", {}),
        of_estimator("iicv", {{"adaptive", ""}}), more({"groups", "4"}), more({"split", "1:3"}),
        more({"sampler", "sobol"}), more({"integrator", "bdpt"}),
        pass_words({{"estimator", "iicv"}}, {{"max-depth", "3"}}, {}), standard})
    EXPECT_NE(other, pair);
}

}  // namespace
}  // namespace covary
