// SPDX-License-Identifier: Apache-2.0
// The estimators by name: defaults and values of options, ranges, messages, and docs/estimators.md.
#include "combine/registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "dependent_tests/dependent_tests.h"
#include "estimators/cv_baseline.h"
#include "estimators/iduw.h"
#include "estimators/iicv.h"
#include "estimators/polynomials.h"
#include "estimators/test_images.h"
#include "settings/option_names.h"
#include "support/files.h"

namespace covary::registry_test {
namespace {

using test_support::contains, test_support::message_of;
using Type = Option::Type;

constexpr int kWidth = 12, kHeight = 10, kGroups = 4;
const test::Grouped& crn() {
  static const test::Grouped image = test::crn_image(kWidth, kHeight, kGroups, 1);
  return image;
}
const test::Grouped& independent() {
  static const test::Grouped image = test::independent_image(kWidth, kHeight, kGroups, 1);
  return image;
}

std::vector<float> made(const std::string& name, const OptionValues& values,
                        const MethodSettings& settings = {48, true}) {
  return make_estimator(name, values).image({crn().view(), independent().view()}, settings).estimate.data;
}

TEST(EstimatorRegistry, BeginsWithTheDefaultAndRepeatsNothing) {
  const std::vector<std::string> names = estimator_names();
  EXPECT_EQ(names.front(), kDefaultEstimator);
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
  EXPECT_TRUE(make_estimator(kNoEstimator).is_mean());
}

/// Options with the same name have the same meaning on the command line, whichever estimators have them.
TEST(EstimatorRegistry, OptionsOfOneNameAgree) {
  std::map<std::string, Option> seen;
  for (const std::string& name : estimator_names())
    for (const Option& option : options_of_estimator(name)) {
      const auto [first, is_new] = seen.emplace(option.name, option);
      EXPECT_FALSE(option.help.empty());
      if (is_new) continue;
      EXPECT_EQ(first->second.type, option.type) << option.name;
      EXPECT_EQ(first->second.choices, option.choices) << option.name;
    }
}

TEST(EstimatorRegistry, DefaultsAreThoseOfTheOptions) {
  const GroupedImage g = crn().view(), h = independent().view();
  IicvOptions with_error;
  with_error.std_error = true;
  EXPECT_EQ(made("iicv", {}), iicv(g, h, with_error).estimate.data);
  EXPECT_EQ(made("iicv", {{"paper", ""}}), iicv(g, h, IicvOptions::paper()).estimate.data);
  EXPECT_EQ(made("cv-baseline", {}), cv_baseline(g, h).estimate.data);
  IduwOptions iduw_options;
  iduw_options.samples = 48;
  EXPECT_EQ(made("iduw", {}), iduw(g, h, iduw_options).estimate.data);
  EXPECT_EQ(made("dependent-tests", {}), dependent_tests(g, h).estimate.data);
  EXPECT_EQ(made("dependent-tests", {{"paper", ""}}),
            dependent_tests(g, h, DependentTestsOptions::paper()).estimate.data);
  EXPECT_EQ(make_estimator("polynomials").pixel_pass()->dimensions, PolynomialsOptions().dimensions);
}

bool has(const std::vector<Option>& options, const std::string& name) {
  return std::any_of(options.begin(), options.end(), [&](const Option& o) { return o.name == name; });
}

/// Options that an option requires to have an effect.
OptionValues with_what_it_needs(const std::string& name, OptionValues values) {
  const auto given = [&](std::initializer_list<const char*> options) {
    return std::any_of(options.begin(), options.end(), [&](const char* o) { return values.contains(o); });
  };
  if (given({"max-region", "min-centre-drop", "falloff", "norm", "allocation"})) values["paper"] = "";
  if (has(options_of_estimator(name), "adaptive")) values["adaptive"] = "";
  return values;
}

/// Every default, given as a value, changes nothing.
TEST(EstimatorRegistry, ListsTheDefaults) {
  for (const std::string& name : pair_estimator_names())
    for (const Option& option : options_of_estimator(name)) {
      if (option.default_value.empty()) continue;
      const OptionValues values = with_what_it_needs(name, {{option.name, option.default_value}});
      OptionValues without = values;
      without.erase(option.name);
      EXPECT_EQ(made(name, values), made(name, without)) << name << " " << option.name;
    }
}

TEST(EstimatorRegistry, ValuesReachTheOptions) {
  const GroupedImage g = crn().view(), h = independent().view();
  IicvOptions o;
  o.k = 9, o.window = 7, o.penalty = Penalty::kAsymmetric;
  EXPECT_EQ(made("iicv", {{"k", "9"}, {"window", "7"}, {"penalty", "asymmetric"}}), iicv(g, h, o).estimate.data);
  o = IicvOptions::paper(), o.penalty = Penalty::kSample;
  EXPECT_EQ(made("iicv", {{"paper", ""}, {"penalty", "sample"}}), iicv(g, h, o).estimate.data);
  CvBaselineOptions baseline;
  baseline.k = 9, baseline.window = 5, baseline.ridge = 0.001f;
  EXPECT_EQ(made("cv-baseline", {{"k", "9"}, {"window", "5"}, {"ridge", "0.001"}}),
            cv_baseline(g, h, baseline).estimate.data);
  DependentTestsOptions tests = DependentTestsOptions::paper();
  tests.regions = {6, 0.001f, Falloff::kSpline}, tests.norm = Norm::kEuclidean;
  EXPECT_EQ(made("dependent-tests", {{"paper", ""},
                                     {"max-region", "6"},
                                     {"min-centre-drop", "0.001"},
                                     {"falloff", "spline"},
                                     {"norm", "euclidean"}}),
            dependent_tests(g, h, tests).estimate.data);
  const OptionValues by_variance = {{"paper", ""}, {"norm", "euclidean"}, {"allocation", "variance"}};
  const CountOptions counts = make_estimator("dependent-tests", by_variance).adaptive->counts;
  EXPECT_EQ(std::pair(counts.allocation, counts.norm), std::pair(Allocation::kVariance, Norm::kEuclidean));
  DependentTestsOptions exact;
  exact.window = 5;
  EXPECT_EQ(made("dependent-tests", {{"window", "5"}}), dependent_tests(g, h, exact).estimate.data);
  EXPECT_EQ(make_estimator("polynomials").pixel_pass()->film_settings, "polynomials dimensions=4");
  EXPECT_EQ(make_estimator("iicv", {{"paper", ""}, {"k", "50"}}).text, "iicv --paper --set k=50");
}

/// What each estimator claims is true.
TEST(EstimatorRegistry, EachEstimatorDoesWhatItSays) {
  const auto groups = [](int n, uint64_t seed, bool common) {
    return common ? test::crn_image(kWidth, kHeight, n, seed) : test::independent_image(kWidth, kHeight, n, seed);
  };
  for (const std::string& name : pair_estimator_names()) {
    const Method estimator = make_estimator(name);
    SCOPED_TRACE(name);
    const auto run = [&](int n) {
      const test::Grouped g = groups(n, 1, true), h = groups(n, 1, false);
      return estimator.image({g.view(), h.view()}, {4 * n, estimator.predicts_error});
    };
    const EstimatorResult result = run(estimator.min_groups);
    EXPECT_EQ(result.estimate.data.size(), size_t{kWidth} * kHeight * 3);
    EXPECT_EQ(!result.std_error.data.empty(), estimator.predicts_error);
    EXPECT_THROW(run(estimator.min_groups - 1), Error);
    if (!estimator.pair()->explain) continue;
    EXPECT_FALSE(estimator.pair()->explain(crn().view(), independent().view(), 5, 5).empty());
  }
}

TEST(EstimatorRegistry, AdaptiveEstimatorsHaveTheirNumbers) {
  const Method usual = make_estimator("dependent-tests");
  ASSERT_TRUE(usual.adaptive);
  EXPECT_EQ(usual.adaptive->counts.allocation, Allocation::kMinError);
  EXPECT_FALSE(usual.adaptive->counts.classes);
  const Method paper = make_estimator("dependent-tests", {{"paper", ""}});
  EXPECT_EQ(paper.adaptive->counts.allocation, Allocation::kEqualError);
  EXPECT_TRUE(paper.adaptive->counts.classes);
  EXPECT_EQ(paper.adaptive->counts.min_spp, 0);
  EXPECT_FALSE(make_estimator("none").adaptive);
  const Method plain = make_estimator("none", {{"adaptive", ""}, {"dependent-spp", "7"}, {"max-spp", "30"}});
  ASSERT_TRUE(plain.adaptive);
  EXPECT_EQ(plain.adaptive->first_spp, 7);
  const CountOptions& counts = plain.adaptive->counts;
  EXPECT_EQ(counts.max_spp, 30);
  EXPECT_FALSE(counts.first_pass_counts);
  const auto message = [](const std::string& name, const OptionValues& values) {
    return message_of([&] { make_estimator(name, values); }, ErrorCode::kUsage);
  };
  EXPECT_TRUE(contains(message("none", {{"max-spp", "9"}}), "`max-spp` has no effect without `adaptive`"));
  EXPECT_EQ(message("dependent-tests", {{"max-spp", "0"}}), "`max-spp` '0': expected a whole number of at least 1");
  EXPECT_TRUE(contains(message("iduw", {{"max-spp", "1"}}),
                       "is an option of `estimator` mixture, iicv, dependent-tests, none"));
  const Method iicv = make_estimator("iicv", {{"adaptive", ""}, {"max-spp", "99"}});
  ASSERT_TRUE(iicv.adaptive);
  EXPECT_EQ(iicv.adaptive->counts.max_spp, 99);
  EXPECT_TRUE(iicv.adaptive->reads_groups);
  EXPECT_FALSE(make_estimator("iicv").adaptive);
}

TEST(EstimatorRegistry, SamplesOfAPixel) {
  const Method estimator = make_estimator("polynomials");
  ASSERT_TRUE(estimator.pixel_pass());
  const std::vector<Spectrum> values(40, Spectrum(2.0f));
  std::vector<float> coordinates;
  for (uint64_t i = 0; i < 160; ++i) coordinates.push_back(0.5f + test::noise(1, i, 0));
  EXPECT_EQ(estimator.pixel_pass()->pixel(values, coordinates).r, 2.0f);
  EXPECT_TRUE(estimator.pixel_pass()->check_samples(16).empty());
  EXPECT_FALSE(estimator.pixel_pass()->check_samples(15).empty());
}

TEST(EstimatorRegistry, RangesAreThoseThatAreChecked) {
  for (const std::string& name : estimator_names())
    for (const Option& option : options_of_estimator(name)) {
      if (option.type != Type::kWhole && option.type != Type::kReal) continue;
      SCOPED_TRACE(name + " " + option.name);
      const auto accepts = [&](double value) {
        OptionValues values{{option.name, fmt::format("{:g}", value)}};
        const std::vector<Option> all = options_of_estimator(name);
        if (option.name == "window" && has(all, "k")) values["k"] = "1";  // of few pixels
        values = with_what_it_needs(name, values);
        return message_of([&] { make_estimator(name, values); }) == "no error";
      };
      const OptionRange& range = option.range;
      const double step = option.type == Type::kWhole ? (range.odd ? 2 : 1) : 0.25;
      EXPECT_TRUE(option.default_value.empty() || range.contains(std::stod(option.default_value)));
      EXPECT_EQ(accepts(range.low), !range.above_low);
      EXPECT_TRUE(accepts(range.low + step));
      EXPECT_FALSE(accepts(range.low - step));
      if (!std::isfinite(range.high)) continue;
      EXPECT_TRUE(accepts(range.high));
      EXPECT_FALSE(accepts(range.high + step));
      EXPECT_EQ(accepts(range.high - 1), !range.odd && range.high - 1 >= range.low);
    }
  EXPECT_TRUE((OptionRange{.low = 3, .high = 7, .odd = true}.contains(5)));
  EXPECT_FALSE((OptionRange{.low = 3, .high = 7, .odd = true}.contains(4)));
  EXPECT_EQ((OptionRange{.low = 0, .above_low = true}.text()), "above 0");
}

TEST(EstimatorRegistry, OptionsWithoutEffectAreErrors) {
  const auto message = [](const std::string& name, const OptionValues& values) {
    return message_of([&] { make_estimator(name, values); }, ErrorCode::kUsage);
  };
  struct Case {
    const char *estimator, *option;
    OptionValues values;
  };
  const Case cases[] = {
      {"iicv", "max-spp", {{"max-spp", "99"}}},
      {"dependent-tests", "max-region", {{"max-region", "3"}}},
      {"dependent-tests", "min-centre-drop", {{"min-centre-drop", "0.1"}}},
      {"dependent-tests", "falloff", {{"falloff", "count"}}},
      {"dependent-tests", "window", {{"paper", ""}, {"window", "5"}}},
  };
  for (const Case& c : cases)
    EXPECT_TRUE(message(c.estimator, c.values).starts_with(fmt::format("`{}` has no effect ", c.option)))
        << message(c.estimator, c.values);
  // These check for themselves that the others are given.
  EXPECT_NO_THROW(make_estimator("dependent-tests", {{"window", "5"}}));
  EXPECT_NO_THROW(make_estimator("dependent-tests", {{"paper", ""}, {"max-region", "5"}}));
}

TEST(EstimatorRegistry, SaysWhatIsWrong) {
  const auto message = [](const std::string& name, const OptionValues& values) {
    return message_of([&] { make_estimator(name, values); });
  };
  EXPECT_EQ(message("iidw", {}),
            fmt::format("no estimator is named 'iidw'; expected {}; did you mean 'iduw' or 'iicv'?",
                        fmt::join(estimator_names(), ", ")));
  EXPECT_EQ(message("iduw", {{"k", "3"}}), "`k` is an option of `estimator` iicv, cv-baseline, not of iduw");
  EXPECT_EQ(message("iicv", {{"windwo", "3"}}), "`windwo` is not an option of any estimator; did you mean 'window'?");
  EXPECT_EQ(message("iicv", {{"k", "3x"}}), "`k` '3x': expected a whole number of at least 1");
  EXPECT_EQ(message("cv-baseline", {{"ridge", "nan"}}), "`ridge` 'nan': expected a number of at least 0");
  EXPECT_EQ(message("iicv", {{"penalty", "sampl"}}),
            "`penalty` 'sampl': expected pilot, sample, asymmetric; did you mean 'sample'?");
  EXPECT_TRUE(contains(message("iicv", {{"k", "500"}}), "k is 500, expected 1 to 121"));
}

// ---- docs/estimators.md ---------------------------------------------------------------------------------------------

std::string yes_or_no(bool value) { return value ? "yes" : "no"; }

std::string row_of(const Method& e) {
  const bool pair = e.pair();
  const bool is_default = e.name == kDefaultEstimator;
  const char* passes = is_default       ? "independent, or CRN and independent"
                       : pair           ? "CRN and independent"
                       : e.pixel_pass() ? "independent, all samples of a pixel"
                                        : "one of either kind";
  const std::string combine = pair && e.halo < 0 ? "whole images" : pair || is_default ? "in bands" : "no";
  return fmt::format("| `{}` | {} | {} | {} | {} | {} |", e.name, passes, e.min_groups, yes_or_no(e.predicts_error),
                     yes_or_no(pair && e.pair()->explain), combine);
}

std::string row_of(const Option& o) {
  const std::string values = o.type == Type::kFlag     ? "flag"
                             : o.type == Type::kChoice ? fmt::format("{}", fmt::join(o.choices, ", "))
                             : o.type == Type::kWhole  ? "whole, " + o.range.text()
                                                       : o.range.text();
  return fmt::format("| `{}{}` | {} | {} | {} |", is_parameter(o) ? "" : "--", o.name, values,
                     o.type == Type::kFlag ? "off" : o.default_value, as_flags(o.help));
}

/// The page has a row for each estimator, and below its heading one for each of its options; no others.
TEST(EstimatorRegistry, IsDocumented) {
  std::string expected;
  for (const std::string& name : estimator_names()) expected += row_of(make_estimator(name)) + "\n";
  for (const std::string& name : estimator_names()) {
    expected += "## `" + name + "`\n";
    for (const Option& option : options_of_estimator(name)) expected += row_of(option) + "\n";
  }
  std::ifstream file(std::string(COVARY_SOURCE_DIR) + "/docs/estimators.md");
  std::string line, found;
  while (std::getline(file, line))
    if (line.starts_with("| `") || line.starts_with("## `")) found += line + "\n";
  EXPECT_EQ(found, expected);
}

TEST(EstimatorRegistry, IsNamedInTheReadme) {
  std::ifstream file(std::string(COVARY_SOURCE_DIR) + "/README.md");
  std::string text, list;
  for (std::string word; file >> word;) text += word + " ";  // wherever lines end
  for (const std::string& name : estimator_names()) list += (list.empty() ? "`" : ", `") + name + "`";
  EXPECT_TRUE(contains(text, "Estimators: " + list)) << list;
}

}  // namespace
}  // namespace covary::registry_test
