// SPDX-License-Identifier: Apache-2.0
#include "json_output.h"

#include <sys/resource.h>
#include <cstdio>

#include "film/output_file.h"

namespace covary {

std::string json_text(const nlohmann::ordered_json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

void write_text_output(const std::string& path, const std::string& text) {
  if (path.empty() || path == "-")
    std::fputs(text.c_str(), stdout);  // main() checks whether that could be written
  else
    write_text_file(path, text);
}

double peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024;
}

}  // namespace covary
