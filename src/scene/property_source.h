// SPDX-License-Identifier: Apache-2.0
// Options (settings/settings.h) read from the properties of an object of a scene file, whose names have "_" for "-",
// and from what a caller gives in place of these.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/parameters.h"
#include "settings/settings.h"

namespace covary {

class PropertySource final : public SettingsSource {
 public:
  /// Values of the caller, by name, take the place of properties. A wrong value of a property is recorded in the
  /// diagnostics of `parameters`, one of the caller throws Error(kUsage).
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

/// Settings that have a declare(), as the properties say.
template <typename T>
T read_settings(Parameters& parameters, T settings = {}) {
  PropertySource source(parameters);
  Settings reader(source);
  declare(reader, settings);
  return settings;
}

/// Makes the properties of these options known, so that they are no error: they are those of an object that another one
/// takes the place of.
void ignore_properties(Parameters& parameters, const std::vector<Option>& options);

}  // namespace covary
