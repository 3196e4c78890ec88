// SPDX-License-Identifier: Apache-2.0
#include "defines.h"

#include "core/error.h"

namespace covary {

void add_define_option(CLI::App& command, std::vector<std::string>& defines) {
  command.add_option("-D,--define", defines, "Value of one of the scene's <default> elements")
      ->type_name("name=value")
      ->take_all()
      ->expected(1)
      ->allow_extra_args(false);
}

std::map<std::string, std::string> parse_defines(const std::vector<std::string>& defines) {
  std::map<std::string, std::string> result;
  for (const std::string& define : defines) {
    const size_t equals = define.find('=');
    if (equals == 0 || equals == std::string::npos)
      throw Error(ErrorCode::kUsage, "-D '" + define + "': expected name=value");
    result[define.substr(0, equals)] = define.substr(equals + 1);
  }
  return result;
}

}  // namespace covary
