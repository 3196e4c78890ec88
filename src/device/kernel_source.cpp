// SPDX-License-Identifier: Apache-2.0
#include "device/kernel_source.h"

#include <set>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "device/embedded.h"

namespace covary::device {
namespace {

/// A function: the texts, in files of their own, may be initialised later than other constants.
const std::vector<std::pair<std::string, std::string_view>>& files() {
  static const std::vector<std::pair<std::string, std::string_view>> table = {
#include "device/kernel_table.inc"
  };
  return table;
}

std::string_view text_of(const std::string& name) {
  for (const auto& [known, text] : files())
    if (known == name) return text;
  throw Error(ErrorCode::kInternal, "no kernel file '" + name + "' is part of this program");
}

void append(const std::string& name, std::set<std::string>& seen, std::string& result) {
  if (!seen.insert(name).second) return;
  constexpr std::string_view kInclude = "#include \"";
  for (std::string_view text = text_of(name); !text.empty();) {
    const size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end);
    if (line.starts_with(kInclude))
      append(std::string(line.substr(kInclude.size(), line.rfind('"') - kInclude.size())), seen, result);
    else
      result += line;
  }
}

}  // namespace

std::vector<std::string> kernel_names() {
  std::vector<std::string> names;
  for (const auto& [name, text] : files())
    if (name.ends_with(".cl")) names.push_back(name);
  return names;
}

std::string kernel_source(const std::string& name) {
  std::set<std::string> seen;
  std::string result;
  append(name, seen, result);
  return result;
}

}  // namespace covary::device
