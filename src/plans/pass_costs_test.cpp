// SPDX-License-Identifier: Apache-2.0
#include "plans/pass_files.h"

#include <gtest/gtest.h>

#include "support/files.h"

namespace covary {
namespace {

using test_support::message_of;

std::string error(const std::string& text) {
  return message_of([&] { parse_pass_costs(text); });
}
std::string with(const std::string& key, const std::string& value) {
  std::string text = R"({"samples": 1, "rays": 2, "seconds": 3, "estimate_seconds": 0.5})";
  const size_t at = text.find("\"" + key + "\": ") + key.size() + 4;
  return text.replace(at, text.find_first_of(",}", at) - at, value);
}

TEST(PassCosts, AreReadAsTheyWereWritten) {
  for (const PassCosts& costs :
       {PassCosts{18446744073709551615u, 7, 1.25, 0.5, 2.5}, PassCosts{}, PassCosts{1, 2, 0.1}}) {
    const PassCosts read = parse_pass_costs(to_text(costs));
    EXPECT_EQ(read.samples, costs.samples);
    EXPECT_EQ(read.rays, costs.rays);
    EXPECT_EQ(read.seconds, costs.seconds);
    EXPECT_EQ(read.estimate_seconds, costs.estimate_seconds);
    EXPECT_EQ(read.processor_seconds, costs.processor_seconds);
  }
}

TEST(PassCosts, AreRefusedWhenTheyCannotBeRight) {
  EXPECT_EQ(error(with("rays", "3")), "no error");
  EXPECT_EQ(error(with("seconds", "-1e9")), "'seconds' is -1000000000.0, expected a number from 0 on");
  EXPECT_EQ(error(with("seconds", "\"1\"")), "'seconds' is string, expected a number from 0 on");
  EXPECT_EQ(error(with("rays", "-1")), "'rays' is -1, expected a whole number from 0 on");
  EXPECT_EQ(error(with("rays", "1.5")), "'rays' is 1.5, expected a whole number from 0 on");
  EXPECT_EQ(error(with("samples", "18446744073709551616")),
            "'samples' is 1.8446744073709552e+19, expected a whole number from 0 on");
  EXPECT_EQ(error(with("samples", "null")), "'samples' is null, expected a whole number from 0 on");
  EXPECT_EQ(error(with("estimate_seconds", "4")), "'estimate_seconds' is above 'seconds'");
  EXPECT_EQ(error("{\"samples\": 1}"), "'rays' is missing");
  for (const std::string& text :
       {std::string(), std::string("[1]"), with("seconds", "1e999"), std::string("{\"rays\"")})
    EXPECT_EQ(error(text), "expected a JSON object") << text;
  EXPECT_EQ(error(std::string(200000, '[')), "arrays and objects nest deeper than 64");
}

}  // namespace
}  // namespace covary
