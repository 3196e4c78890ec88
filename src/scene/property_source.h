// SPDX-License-Identifier: Apache-2.0
// Options (settings/settings.h) read from the properties of an object in a scene file, with "_" for "-" in names, and
// from overrides given by the caller.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/parameters.h"
#include "settings/settings.h"

namespace covary {

class PropertySource final : public SettingsSource {
 public:
  /// Values from the caller, by name, override properties. An invalid property is recorded in the diagnostics of
  /// `parameters`; an invalid value from the caller throws Error(kUsage).
  explicit PropertySource(Parameters& parameters, OptionValues of_caller = {})
      : parameters_(parameters), of_caller_(std::move(of_caller)) {}

  std::optional<std::string> find(const Option& option) override;
  bool is_of_caller(const Option& option) override { return of_caller_.contains(option.name); }
  void leave_out_others() override { only_caller_ = true; }
  void refuse(const Option& option, const std::string& problem) override;

 private:
  Parameters& parameters_;
  OptionValues of_caller_;
  bool only_caller_ = false;
};

/// Reads settings that have a declare() from properties.
template <typename T>
T read_settings(Parameters& parameters, T settings = {}) {
  PropertySource source(parameters);
  Settings reader(source);
  declare(reader, settings);
  return settings;
}

/// Marks the properties of these options as known, so that they are not errors: they belong to an object that another
/// one replaces.
void ignore_properties(Parameters& parameters, const std::vector<Option>& options);

}  // namespace covary
