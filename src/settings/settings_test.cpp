// SPDX-License-Identifier: Apache-2.0
// One declaration: reading, listing, validation, options without effect, settings text in films.
#include "settings/settings.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/number_text.h"
#include "settings/option_names.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of;
using Words = std::vector<std::string>;

enum class Colour { kRed, kBlue };

struct Fog {
  int steps = 4;
  uint32_t grid = 0;
  float density = 0.5f;
  std::optional<double> height;
  Colour colour = Colour::kRed;
  bool jitter = true, thick = false;
  std::string file, mode = "a";
  std::vector<std::string> names;
  int side = 0;
};

std::string read_side(const std::string& text, int& side) {
  const auto sides = parse_whole_numbers(text, 'x', 2);
  if (!sides || (*sides)[0] != (*sides)[1]) return "SIDExSIDE";
  side = static_cast<int>((*sides)[0]);
  return "";
}

void declare(Settings& s, Fog& v) {
  static constexpr std::pair<const char*, Colour> kColours[] = {{"red", Colour::kRed}, {"blue", Colour::kBlue}};
  s.group("Fog", OptionEffect::kPasses);
  if (s.preset("fog-thick")) v.steps = 32;
  s.whole("fog-steps", v.steps, {.low = 1, .high = 64}, "Steps of each ray", {.film = "steps={}"});
  s.whole<uint32_t>("fog-grid", v.grid, {.low = 1, .high = 9}, {"auto", 0}, "Cells", {.film = "grid={}"});
  s.real("fog-density", v.density, {.low = 0, .high = 1, .above_low = true}, "Density", {.film = "density={:f}"});
  s.real("fog-height", v.height, {}, "Height");
  s.choice("fog-colour", v.colour, kColours, "Colour", {.letter = "f", .level = OptionLevel::kBasic});
  s.on_off("fog-jitter", v.jitter, "Whether steps begin at random", {.film = "jitter"});
  s.flag("fog-thick", v.thick, "Many steps", {.film = "thick"});
  s.text("fog-file", v.file, "FILE", "File of densities", {.names = OptionNames::kFile});
  s.texts("fog-name", v.names, "NAME", "Names");
  s.one_of("fog-mode", v.mode, {"a", "b"}, "Mode");
  s.text_as("fog-size", v.side, "SIDExSIDE", read_side, "Size", {.effect = OptionEffect::kSamples});
  s.only_if(v.steps > 1, {"fog-jitter", "fog-height"}, "with `fog-steps` 1");
}

Fog read(const OptionValues& values) {
  Settings settings(values);
  Fog fog;
  declare(settings, fog);
  return fog;
}

std::vector<Option> listed() {
  Settings settings;
  Fog fog;
  declare(settings, fog);
  return settings.options();
}

std::string problem(const OptionValues& values) {
  return message_of([&] { read(values); }, ErrorCode::kUsage);
}

TEST(Settings, ValuesReachTheStruct) {
  const Fog fog = read({{"fog-steps", "8"},
                        {"fog-grid", "3"},
                        {"fog-density", "0.25"},
                        {"fog-height", "-2e3"},
                        {"fog-colour", "blue"},
                        {"fog-jitter", "off"},
                        {"fog-file", "a b.vol"},
                        {"fog-name", "x\ny"},
                        {"fog-mode", "b"},
                        {"fog-size", "7x7"}});
  EXPECT_EQ(fog.steps, 8);
  EXPECT_EQ(fog.grid, 3u);
  EXPECT_EQ(fog.density, 0.25f);
  EXPECT_EQ(fog.height, -2000);
  EXPECT_EQ(fog.colour, Colour::kBlue);
  EXPECT_FALSE(fog.jitter);
  EXPECT_FALSE(fog.thick);
  EXPECT_EQ(fog.file, "a b.vol");
  EXPECT_EQ(fog.names, (Words{"x", "y"}));
  EXPECT_EQ(fog.mode, "b");
  EXPECT_EQ(fog.side, 7);
  EXPECT_EQ(read({{"fog-grid", "auto"}}).grid, 0u);
}

TEST(Settings, PresetsChangeDefaultsOfWhatIsNotGiven) {
  EXPECT_EQ(read({{"fog-thick", ""}}).steps, 32);
  EXPECT_EQ(read({{"fog-thick", ""}, {"fog-steps", "5"}}).steps, 5);
  EXPECT_TRUE(read({{"fog-thick", ""}}).thick);
}

TEST(Settings, DefaultsAreThoseOfTheStruct) {
  const std::vector<Option> options = listed();
  const auto standard = [&](const char* name) { return find_option(options, name)->default_value; };
  EXPECT_EQ(standard("fog-steps"), "4");
  EXPECT_EQ(standard("fog-grid"), "auto");
  EXPECT_EQ(standard("fog-density"), "0.5");
  EXPECT_EQ(standard("fog-height"), "");
  EXPECT_EQ(standard("fog-colour"), "red");
  EXPECT_EQ(standard("fog-jitter"), "on");
  EXPECT_EQ(standard("fog-thick"), "");
  for (const Option& option : options) {
    EXPECT_EQ(option.group, "Fog");
    EXPECT_EQ(option.effect, option.name == "fog-size" ? OptionEffect::kSamples : OptionEffect::kPasses);
    EXPECT_EQ(option.level == OptionLevel::kBasic, option.name == "fog-colour");
    EXPECT_EQ(option.names == OptionNames::kFile, option.name == "fog-file");
  }
}

TEST(Settings, WhatIsNoValueIsRefused) {
  EXPECT_EQ(problem({{"fog-steps", "4.5"}}), "`fog-steps` '4.5': expected a whole number from 1 to 64");
  EXPECT_EQ(problem({{"fog-steps", "99999999999"}}), "`fog-steps` '99999999999': expected a whole number from 1 to 64");
  EXPECT_EQ(problem({{"fog-grid", "-1"}}), "`fog-grid` '-1': expected auto or a whole number from 1 to 9");
  EXPECT_EQ(problem({{"fog-density", "nan"}}), "`fog-density` 'nan': expected a number above 0 to 1");
  EXPECT_EQ(problem({{"fog-height", "1x"}}), "`fog-height` '1x': expected a number");
  EXPECT_EQ(problem({{"fog-colour", "blu"}}), "`fog-colour` 'blu': expected red, blue; did you mean 'blue'?");
  for (const char* size : {"7x8", "7", "7x", "-1x-1", "7x7x7", "x", ""})
    EXPECT_EQ(problem({{"fog-size", size}}), fmt::format("`fog-size` '{}': expected SIDExSIDE", size));
  EXPECT_EQ(problem({{"fog-jitter", "yes"}}), "`fog-jitter` 'yes': expected on, off");
}

TEST(Settings, OptionsWithoutEffectAreErrors) {
  EXPECT_EQ(problem({{"fog-steps", "1"}, {"fog-height", "2"}}), "`fog-height` has no effect with `fog-steps` 1");
  EXPECT_EQ(problem({{"fog-steps", "1"}, {"fog-height", "2"}, {"fog-jitter", "on"}}),
            "`fog-jitter`, `fog-height` have no effect with `fog-steps` 1");
  EXPECT_EQ(read({{"fog-steps", "1"}}).steps, 1);
}

TEST(Settings, FilmTextHasWhatHasAnEffect) {
  Fog fog;
  EXPECT_EQ(film_text_of(fog), "steps=4 grid=auto density=0.500000 jitter");
  fog.grid = 7, fog.jitter = false, fog.thick = true;
  EXPECT_EQ(film_text_of(fog), "steps=4 grid=7 density=0.500000 thick");
  fog.jitter = true, fog.steps = 1;
  EXPECT_EQ(film_text_of(fog), "steps=1 grid=7 density=0.500000 thick");
}

TEST(OptionNames, AreShownAsTheReaderKnowsThem) {
  const std::string text = "`cv-grid`, `k` have no effect with `cv` off; 'a`b', ``, `No name` and `x y` `z`";
  EXPECT_EQ(as_flags(text), "--cv-grid, --k have no effect with --cv off; 'a`b', ``, `No name` and `x y` --z");
  EXPECT_EQ(as_arguments(text), "cv_grid, k have no effect with cv off; 'a`b', ``, `No name` and `x y` z");
  const std::vector<Option> parameters = {{.name = "cv", .type = Option::Type::kChoice, .choices = {"rgb", "off"}},
                                          {.name = "cv-grid", .type = Option::Type::kWhole}};
  EXPECT_EQ(as_flags(text, parameters),
            "--set cv-grid, --k have no effect with --set cv=off; 'a`b', ``, `No name` and `x y` --z");
  EXPECT_EQ(as_flags("`cv-grid` 64 `cv` or `cv` rgb: `cv-grid` 'x'", parameters),
            "--set cv-grid=64 --set cv or --set cv=rgb: --set cv-grid 'x'");
  for (const char* same : {"", "`", "no names", "an open `name"}) EXPECT_EQ(as_flags(same), same);
}

TEST(NumberText, ListsOfNumbers) {
  EXPECT_EQ(parse_whole_numbers("3,010", ',', 2), (std::vector<int64_t>{3, 10}));
  EXPECT_EQ(parse_reals("0.5:+2e1", ':', 2), (std::vector<double>{0.5, 20}));
  for (const char* text : {"3", "3,4,5", "3,", ",3", "3,-1", "3, 4", "3,4.5", "3,9223372036854775807"})
    EXPECT_FALSE(parse_whole_numbers(text, ',', 2)) << text;
  for (const char* text : {"1:nan", "1:inf", "1:", "1:-1"}) EXPECT_FALSE(parse_reals(text, ':', 2)) << text;
}

TEST(Options, AcceptedTextsAreThoseOfNumbers) {
  const std::vector<Option> options = listed();
  const auto kept = [&](const char* name, const char* text) {
    return accepted(*find_option(options, name), text).value_or("refused");
  };
  EXPECT_EQ(kept("fog-steps", "+010"), "10");
  EXPECT_EQ(kept("fog-steps", "0"), "refused");
  EXPECT_EQ(kept("fog-steps", "65"), "refused");
  EXPECT_EQ(kept("fog-steps", "0x10"), "refused");
  EXPECT_EQ(kept("fog-grid", "auto"), "auto");
  EXPECT_EQ(kept("fog-grid", "4294967297"), "refused");
  EXPECT_EQ(kept("fog-density", "0"), "refused");
  EXPECT_EQ(kept("fog-density", "1"), "1");
  EXPECT_EQ(kept("fog-density", "+.5"), ".5");
  EXPECT_EQ(kept("fog-height", "1e300"), "refused");
  EXPECT_EQ(kept("fog-height", "inf"), "refused");
}

TEST(Options, WordsOfACommandLine) {
  const OptionValues values = {{"fog-name", "x\ny"}, {"fog-thick", ""}, {"fog-steps", "8"}, {"other", "1"}};
  EXPECT_EQ(option_words(listed(), values),
            (Words{"--fog-steps", "8", "--fog-thick", "--fog-name", "x", "--fog-name", "y"}));
}

TEST(Options, WordsOfMethods) {
  std::vector<Option> options = listed();
  const auto level_of = [&](const char* name) -> OptionLevel& {
    return std::find_if(options.begin(), options.end(), [&](const Option& o) { return o.name == name; })->level;
  };
  const OptionValues values = {{"fog-thick", ""}, {"fog-steps", "8"}, {"fog-grid", "auto"}, {"other", "1"}};
  EXPECT_EQ(method_words(options, values), (Words{"--set", "fog-steps=8", "--set", "fog-grid=auto", "--fog-thick"}));
  level_of("fog-steps") = OptionLevel::kBasic;
  EXPECT_EQ(method_words(options, values), (Words{"--fog-steps", "8", "--set", "fog-grid=auto", "--fog-thick"}));
}

TEST(Options, MergedListsTellWhereTheyDiffer) {
  std::vector<Option> other = listed();
  other.erase(other.begin() + 1, other.end());
  other[0].default_value = "9";
  std::vector<Option> third = other;
  third[0].help = "Steps of light", third[0].default_value = "";
  const std::vector<Option> merged = merged_options({"fog", "mist", "smoke"}, {listed(), other, third});
  EXPECT_EQ(merged.size(), listed().size());
  EXPECT_EQ(merged[0].help, "Steps of each ray; default 4 (mist: 9); smoke: Steps of light");
}

}  // namespace
}  // namespace covary
