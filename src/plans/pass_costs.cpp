// SPDX-License-Identifier: Apache-2.0
#include "plans/pass_costs.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "core/error.h"
#include "core/json_depth.h"

namespace covary {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorCode::kInput, what); }

/// The member of `costs`, which must be a finite number from 0 on.
template <typename T>
T amount(const Json& costs, const char* key) {
  const auto it = costs.find(key);
  if (it == costs.end()) fail(fmt::format("'{}' is missing", key));
  const bool fits = std::is_integral_v<T> ? it->is_number_unsigned() : it->is_number();
  if (!fits || !(it->get<double>() >= 0) || !std::isfinite(it->get<double>()))
    fail(fmt::format("'{}' is {}, expected is a {} from 0 on", key, it->is_number() ? it->dump() : it->type_name(),
                     std::is_integral_v<T> ? "whole number" : "number"));
  return it->get<T>();
}

}  // namespace

PassCosts parse_pass_costs(std::string_view text) {
  if (line_nested_too_deep(text)) fail(fmt::format("arrays and objects nest deeper than {}", kMaxJsonDepth));
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) fail("expected is a JSON object");
  PassCosts costs{amount<uint64_t>(json, "samples"), amount<uint64_t>(json, "rays"), amount<double>(json, "seconds")};
  if (json.contains("estimate_seconds")) costs.estimate_seconds = amount<double>(json, "estimate_seconds");
  if (costs.estimate_seconds > costs.seconds) fail("'estimate_seconds' is above 'seconds'");
  return costs;
}

std::string to_text(const PassCosts& costs) {
  Json json = {{"samples", costs.samples}, {"rays", costs.rays}, {"seconds", costs.seconds}};
  if (costs.estimate_seconds > 0) json["estimate_seconds"] = costs.estimate_seconds;
  return json.dump(2) + "\n";
}

}  // namespace covary
